"""Truths of decays: closed forms, and the same definitions on noise-free samples."""

from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rir.decay import FIT_RANGES_DB, fit_line, remaining_energy

__all__ = ["exponential_truth", "measured_truth", "range_above_noise"]


SPLITS = {"C50": 0.05, "C80": 0.08}
DIRECT_WINDOW = 0.0025
"""Direct sound of DRR after its peak [s] (Zahorik, JASA 112, 2002)."""


def exponential_truth(reverberation_time: float) -> dict[str, float]:
    """Return the parameters of an endless exponential decay without direct sound.

    Examples
    --------
    >>> round(exponential_truth(1.0)["C80"], 3)
    3.053
    """
    decay = reverberation_time / (6.0 * np.log(10.0))
    ratio = 10.0 ** (6.0 * 0.05 / reverberation_time)
    return {
        "EDT": reverberation_time,
        "T20": reverberation_time,
        "T30": reverberation_time,
        "C50": float(10.0 * np.log10(ratio - 1.0)),
        "C80": float(10 * np.log10(10.0 ** (6.0 * 0.08 / reverberation_time) - 1.0)),
        "D50": 1.0 - 1.0 / ratio,
        "TS": decay,
    }


def measured_truth(
    clean: FloatArray, rate: float, onset: int = 0, *, direct: bool = False
) -> dict[str, float]:
    """Return the parameters of noise-free samples by the plain definitions.

    The response must be long enough for what lies behind its end not to matter.
    """
    energy = np.square(clean[onset:] / np.max(np.abs(clean)))
    curve = remaining_energy(energy)
    curve = curve[curve > 1e-14 * curve[0]]
    level = 10.0 * np.log10(curve / curve[0])
    truth = {
        name: _line_time(level, *ends) / rate for name, ends in FIT_RANGES_DB.items()
    }
    for name, time in SPLITS.items():
        truth[name] = _early_to_late(curve, int(time * rate + 0.5))
    truth["D50"] = 1.0 - _value_at(curve, int(0.05 * rate + 0.5)) / curve[0]
    truth["TS"] = float(np.sum(curve[1:]) / curve[0] / rate)
    if direct:
        reach = int(DIRECT_WINDOW * rate + 0.5)
        peak = int(np.argmax(energy[: reach + 1]))
        truth["DRR"] = _early_to_late(curve, peak + reach + 1)
    return {name: float(value) for name, value in truth.items()}


def _line_time(level: FloatArray, upper: float, lower: float) -> float:
    slope, inside = fit_line(np.arange(len(level), dtype=float), level, upper, lower)
    if len(inside) < 4 or level[inside[0]] - level[inside[-1]] < 2.0:
        return float("nan")
    return -60.0 / slope


def _value_at(curve: FloatArray, sample: int) -> float:
    return float(curve[sample]) if sample < len(curve) else 0.0


def _early_to_late(curve: FloatArray, sample: int) -> float:
    late = _value_at(curve, sample)
    return 10 * np.log10((curve[0] - late) / late) if late > 0 else float("nan")


def range_above_noise(clean: FloatArray, noise_rms: float, envelope: Any) -> float:
    """Return how far the decay curve falls before its envelope meets the noise [dB].

    Parameters
    ----------
    clean : ndarray, shape (n,)
        Noise-free response from its direct sound on.
    noise_rms : float
        Root mean square of the noise.
    envelope : ndarray, shape (n,)
        Root mean square of the decay over time.
    """
    under = np.flatnonzero(envelope <= noise_rms)
    curve = remaining_energy(np.square(clean))
    end = under[0] if len(under) else len(clean) - 1
    return float(-10 * np.log10(max(curve[end], 1e-300) / curve[0]))
