"""What amplifiers, converters and cables do wrong."""

import numpy as np

from capture.faults.table import FAULTS, FaultKind, FaultScene, FloatArray, TakeFault
from rir import InterfaceError

__all__: list[str] = []


def _ratio(fault: TakeFault) -> float:
    return float(10 ** (fault.amount / 20))


def _gain(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del scene
    return samples * _ratio(fault)


def _clip(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del scene
    ceiling = np.abs(samples).max(axis=-1, keepdims=True) / _ratio(fault)
    return np.clip(samples, -ceiling, ceiling)


def _distortion(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del scene
    peak = np.abs(samples).max(axis=-1, keepdims=True)
    bent = samples**2 / np.where(peak > 0, peak, 1.0)
    return samples + 2 * _ratio(fault) * (bent - bent.mean(axis=-1, keepdims=True))


def _crosstalk(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    return samples + _ratio(fault) * scene.played


def _dc(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del scene
    return samples + _ratio(fault)


def _hum(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    times = np.arange(samples.shape[-1]) / scene.sample_rate
    hum = np.zeros_like(times)
    for order, level in ((1, 1.0), (2, 0.5), (3, 0.3)):
        phase = scene.rng.uniform(0, 2 * np.pi)
        hum += level * np.sin(2 * np.pi * 50 * order * times + phase)
    return samples + _ratio(fault) * hum


def _polarity(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del fault, scene
    return -samples


def _swapped(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del fault, scene
    return samples[::-1]


def _agc(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    times = np.arange(samples.shape[-1]) / scene.sample_rate
    slope = np.clip((times - fault.at_s) / 1.0, 0.0, 1.0)
    return samples * 10 ** (fault.amount * slope / 20)


def _vanish(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    del samples, scene
    raise InterfaceError(
        f"the audio device vanished {fault.at_s:g} s into the take; connect it again"
    )


FAULTS.add("gain")(FaultKind("somebody turned a knob (dB)", _gain))
FAULTS.add("clip")(FaultKind("the peak is cut off (dB of it)", _clip))
FAULTS.add("distortion")(FaultKind("second harmonic (dB re the peak)", _distortion))
FAULTS.add("crosstalk")(FaultKind("the output leaks in (dB)", _crosstalk))
FAULTS.add("dc")(FaultKind("a constant offset (dBFS)", _dc))
FAULTS.add("hum")(FaultKind("50, 100 and 150 Hz (dBFS of 50 Hz)", _hum))
FAULTS.add("polarity")(FaultKind("inverted (-)", _polarity))
FAULTS.add("swapped")(FaultKind("channels in reverse order (-)", _swapped))
FAULTS.add("agc")(FaultKind("the gain creeps for a second (dB)", _agc))
FAULTS.add("vanish")(FaultKind("the device goes away (-)", _vanish))
