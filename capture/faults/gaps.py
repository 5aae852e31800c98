"""Samples that get lost, doubled or silenced on their way."""

import numpy as np

from capture.faults.table import FAULTS, FaultKind, FaultScene, FloatArray, TakeFault

__all__: list[str] = []


def _lost(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    start, count = _place(samples, fault, scene)
    rest = np.delete(samples, slice(start, start + count), axis=-1)
    return np.pad(rest, ((0, 0), (0, samples.shape[-1] - rest.shape[-1])))


def _inserted(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    start, count = _place(samples, fault, scene)
    gap = np.zeros((len(samples), count))
    longer = np.concatenate((samples[:, :start], gap, samples[:, start:]), axis=-1)
    return longer[:, : samples.shape[-1]]


def _repeated(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    start, count = _place(samples, fault, scene)
    longer = np.concatenate((samples[:, : start + count], samples[:, start:]), axis=-1)
    return longer[:, : samples.shape[-1]]


def _zeroed(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    start, count = _place(samples, fault, scene)
    samples = samples.copy()
    samples[:, start : start + count] = 0.0
    return samples


def _dead(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> FloatArray:
    start, _ = _place(samples, fault, scene)
    samples = samples.copy()
    samples[:, start:] = 0.0
    return samples


def _place(samples: FloatArray, fault: TakeFault, scene: FaultScene) -> tuple[int, int]:
    """Return where it begins and how many samples it concerns."""
    start = min(round(fault.at_s * scene.sample_rate), samples.shape[-1])
    return start, max(0, round(fault.amount))


FAULTS.add("lost")(FaultKind("samples are left out (samples)", _lost))
FAULTS.add("inserted")(FaultKind("zeros come between (samples)", _inserted))
FAULTS.add("repeated")(FaultKind("a stretch comes twice (samples)", _repeated))
FAULTS.add("zeroed")(FaultKind("samples become zero (samples)", _zeroed))
FAULTS.add("dead")(FaultKind("zero from a moment on: a pulled cable (-)", _dead))
