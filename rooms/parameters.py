"""Room-acoustic parameters of simulated responses: free of noise, so by definition."""

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray
from rir.decay import FIT_RANGES_DB, fit_line, remaining_energy
from rir.errors import SignalError
from rir.physics import decibels

__all__ = ["hall_parameters"]

_LEAD = 0.002
"""Energy counts from this long before the direct sound [s]: pulses have a rise."""


def hall_parameters(
    responses: ArrayLike, sample_rate: int, arrival: ArrayLike, centers: ArrayLike
) -> dict[str, FloatArray]:
    """Return parameters per octave of responses whose direct sound is 1/d.

    Parameters
    ----------
    responses : array_like, shape (..., n)
        Simulated responses; sample 0 is the emission.
    sample_rate : int
        Samples per second [Hz].
    arrival : array_like, shape (...)
        When the direct sound comes, or would without what hides it [s].
    centers : array_like, shape (bands,)
        Octave centres [Hz].

    Returns
    -------
    dict
        "EDT", "T20", "T30", "TS" [s], "C50", "C80", "G" [dB], "D50", each of shape
        (..., bands). NaN where the response ends before the decay has fallen 10 dB
        below the range of a fit, or before the early sound does, and above half of
        the sample rate.

    References
    ----------
    ISO 3382-1:2009, annex A: equations A.1 (G, against 10 m of free field), A.9
    (C50, C80), A.11 (D50), A.12 (TS).

    Examples
    --------
    >>> pulse = np.zeros((1, 4800))
    >>> pulse[0, 480] = 1 / 5
    >>> found = hall_parameters(pulse, 48000, [0.01], [1000.0])
    >>> found["G"].round(2).tolist()
    [[6.02]]
    """
    h = np.asarray(responses, dtype=float)
    when = np.asarray(arrival, dtype=float)
    f = np.asarray(centers, dtype=float)
    if h.ndim < 1 or when.shape != h.shape[:-1] or h.shape[-1] < 2:
        raise SignalError(
            f"responses of shape {h.shape} need arrivals of shape {h.shape[:-1]}, not"
            f" {when.shape}"
        )
    rows = h.reshape(-1, h.shape[-1])
    starts = np.maximum(np.round((when.ravel() - _LEAD) * sample_rate), 0).astype(int)
    # close places hear the direct sound sooner than the lead
    leads = np.minimum(np.round(when.ravel() * sample_rate), round(_LEAD * sample_rate))
    found = [
        _of_one(row, sample_rate, start, int(lead), f)
        for row, start, lead in zip(rows, starts, leads, strict=True)
    ]
    shape = (*when.shape, len(f))
    names = found[0] if found else _of_one(np.zeros(2), sample_rate, 0, 0, f)
    return {
        name: np.array([each[name] for each in found]).reshape(shape) for name in names
    }


def _octave(f: FloatArray, center: float) -> FloatArray:
    """Return the squared gain of a third-order Butterworth octave filter."""
    width = center / np.sqrt(2)
    with np.errstate(divide="ignore"):
        off = (f - center**2 / np.maximum(f, 1e-9)) / width
    return 1 / (1 + off**6)


def _of_one(
    response: FloatArray, rate: int, start: int, lead: int, centers: FloatArray
) -> dict[str, FloatArray]:
    n = len(response)
    length = 2 * n
    f = np.asarray(np.fft.rfftfreq(length, 1 / rate), dtype=np.float64)
    spectrum = np.fft.rfft(response, length)
    columns = []
    for center in centers:
        gain = np.sqrt(_octave(f, center))
        band = np.fft.irfft(spectrum * gain, length)
        pulse = np.fft.irfft(gain, length)
        # what rings before the start belongs to the direct sound
        energy = band[:n] ** 2
        energy[start : start + 1] += energy[:start].sum()
        known = center < rate / 2
        size = float(pulse @ pulse)
        columns.append(_of_band(energy[start:], rate, lead, size, known))
    return {name: np.array([c[name] for c in columns]) for name in columns[0]}


def _of_band(
    energy: FloatArray, rate: int, lead: int, pulse: float, known: bool
) -> dict[str, float]:
    total = float(energy.sum())
    if not known or total <= 0:
        names = (*FIT_RANGES_DB, "TS", "C50", "C80", "G", "D50")
        return dict.fromkeys(names, float("nan"))
    times = np.maximum(np.arange(len(energy)) - lead, 0) / rate
    early = {ms: _early(energy, lead + ms * rate // 1000) for ms in (50, 80)}
    left = remaining_energy(energy)
    curve = decibels(np.maximum(left / total, 1e-30))
    found = {
        name: _fitted(times, curve, *limits) for name, limits in FIT_RANGES_DB.items()
    }
    with np.errstate(divide="ignore"):
        clarity = {
            f"C{ms}": float(decibels(part / max(total - part, 1e-30 * total)))
            for ms, part in early.items()
        }
    return {
        **found,
        "TS": float(energy @ times) / total,
        **clarity,
        "G": float(decibels(total / (0.01 * pulse))),
        "D50": early[50] / total,
    }


def _early(energy: FloatArray, end: int) -> float:
    """Return the energy before a sample; NaN if the response ends there itself."""
    return float(energy[:end].sum()) if end < len(energy) else float("nan")


def _fitted(times: FloatArray, curve: FloatArray, high: float, low: float) -> float:
    """Return 60 dB over the slope between two levels [s], NaN if it is cut short."""
    slope, inside = fit_line(times, curve, high, low)
    if np.isnan(slope) or inside[-1] == len(curve) - 1:
        return float("nan")
    # the decay at the end of the response, had the sum behind it not been cut off
    reached = curve[inside[-1]] + slope * (times[-1] - times[inside[-1]])
    return -60 / slope if slope < 0 and reached <= low - 10 else float("nan")
