"""What the room and the people in it do wrong."""

from importlib import import_module
from typing import Any

import numpy as np

from capture.faults.table import FAULTS, FaultKind, FaultScene, FloatArray, TakeFault

__all__: list[str] = []

KNOCK_S = 0.15  # five decays: what is cut off is 43 dB down
KNOCK_DECAY_S = 0.03  # a tap on a stand or a table rings so long


def _level(fault: TakeFault, scene: FaultScene) -> float:
    """Return a root mean square given in dB re the sweep."""
    return float(scene.level * 10 ** (fault.amount / 20))


def _white(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    noise = scene.rng.standard_normal(samples.shape)
    return samples + _level(fault, scene) * noise


def _pink(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(samples.shape[-1], real=True)
    frequencies = fft.rfftfreq(n, 1 / scene.sample_rate)
    # Below 20 Hz the density stays constant: without a floor it has no bound.
    slope = 1 / np.sqrt(np.maximum(frequencies, 20.0))
    noise = fft.irfft(slope * fft.rfft(scene.rng.standard_normal((len(samples), n))))
    noise = noise[:, : samples.shape[-1]]
    noise /= np.sqrt(np.mean(noise**2, axis=-1, keepdims=True))
    return samples + _level(fault, scene) * noise


def _knock(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    count = round(KNOCK_S * scene.sample_rate)
    times = np.arange(count) / scene.sample_rate
    knock = scene.rng.standard_normal(count) * np.exp(-times / KNOCK_DECAY_S)
    knock *= _level(fault, scene) / np.sqrt(np.mean(knock**2))
    start = min(round(fault.at_s * scene.sample_rate), samples.shape[-1])
    samples = samples.copy()
    part = samples[:, start : start + count]
    part += knock[: part.shape[-1]]
    return samples


FAULTS.add("white")(FaultKind("white noise (dB rms re the sweep)", _white))
FAULTS.add("pink")(FaultKind("pink noise (dB rms re the sweep)", _pink))
FAULTS.add("knock")(FaultKind("a knock of 150 ms (dB rms re the sweep)", _knock))
