"""Read the direct sounds: latency, speed of sound and the shape of the source."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["DirectSound", "read_direct", "whitened"]

BEFORE_S, AFTER_S = 0.0015, 0.0025
"""Of the pulse that is read: a small loudspeaker's, before walls answer."""
MOST_ROWS = 300  # averaged: noise of more falls by less than a decibel
MOST_LATENCY_S = 0.02  # searched: converters and drivers, not rooms, delay by less
NEARLY, SURER = 0.25, 2.0
"""Energy of an earlier arrival over the loudest, and how much surer it must be."""


@dataclass(frozen=True, eq=False)
class DirectSound:
    """Hold the latency and the pulse that all direct sounds share."""

    latency_s: float
    """Delay of every arrival beyond distance over speed of sound, seconds."""
    pulse: FloatArray
    """Mean direct sound of a path of 1 m, from `lead` samples before the arrival on."""
    lead: int
    """Samples of the pulse before the arrival."""
    clearness: float
    """Energy of the mean pulse over what aligned noise would leave; far above 1 when
    the direct sounds stand where the poses say."""


def read_direct(rows: FitSet) -> DirectSound:
    """Align all responses on their direct path and average them.

    Reflections come at other delays in every row and average out; what stays is
    the source's own response, and where it stands is the latency.
    """
    rows = rows.spread(MOST_ROWS)
    rate = rows.sample_rate
    before, after = round(BEFORE_S * rate), round(AFTER_S * rate)
    search = round(MOST_LATENCY_S * rate)
    aligned = _aligned(rows, before + after, search + after)
    mean = aligned.mean(axis=0)
    noise = float(np.mean(aligned.var(axis=0))) / max(len(rows), 1)
    peak = _arrival(aligned, mean, before + after, search, after)
    pulse = mean[peak - before : peak + after]
    energy = float((pulse**2).sum())
    latency = (peak - before - after) / rate
    clear = energy / max(noise * len(pulse), 1e-300)
    return DirectSound(latency, pulse * _taper(before, after), before, clear)


def _arrival(
    aligned: FloatArray, mean: FloatArray, first: int, search: int, apart: int
) -> int:
    """Return the sample of the loudest common arrival, or of a surer one before it.

    A loudspeaker that faces a wall sends less to its listeners than the wall does;
    but only direct sounds are alike in all rows.
    """
    loud = np.convolve(mean**2, np.ones(3), mode="same")
    spread = np.convolve(aligned.var(axis=0), np.ones(3), mode="same")
    sure = loud / np.maximum(spread, 1e-300)
    peak = first + int(np.argmax(loud[first : first + search]))
    early = np.arange(first, peak - apart)
    early = early[loud[early] > NEARLY * loud[peak]]
    if len(early) == 0:
        return peak
    best = int(early[np.argmax(sure[early])])
    return best if sure[best] > SURER * sure[peak] else peak


def _aligned(rows: FitSet, before: int, after: int) -> FloatArray:
    """Return rows times distance, their direct path moved to sample `before`."""
    length = before + after
    delay = rows.distances / rows.speed_of_sound * rows.sample_rate
    size = int(2 ** np.ceil(np.log2(rows.n_samples + length + 1)))
    spectra = np.fft.rfft(rows.responses, size)
    shift = (before - delay)[:, None]
    turn = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size * shift)
    moved = np.fft.irfft(spectra * turn, size)[:, :length]
    return moved * rows.distances[:, None]


def _taper(before: int, after: int) -> FloatArray:
    rise, fall = max(before // 2, 1), max(after // 2, 1)
    taper = np.ones(before + after)
    taper[:rise] = np.sin(0.5 * np.pi * (np.arange(rise) + 0.5) / rise) ** 2
    taper[-fall:] = np.cos(0.5 * np.pi * (np.arange(fall) + 0.5) / fall) ** 2
    return taper


def whitened(rows: FitSet, direct: DirectSound, size: int) -> NDArray[np.complex128]:
    """Return spectra with latency, source phase and direct sound taken away.

    Shape (rows, size // 2 + 1); an arrival of a path of length L then is a
    zero-phase pulse at L over the speed of sound.
    """
    spectra = np.fft.rfft(rows.responses, size)
    omega = 2 * np.pi * np.arange(size // 2 + 1) / size
    pulse = np.fft.rfft(direct.pulse, size) * np.exp(1j * omega * direct.lead)
    late = direct.latency_s * rows.sample_rate
    delay = rows.distances / rows.speed_of_sound * rows.sample_rate + late
    standing = pulse * np.exp(-1j * omega * delay[:, None])
    power = np.sum(np.abs(standing) ** 2, axis=1)
    level = np.sum(spectra * standing.conj(), axis=1).real / np.maximum(power, 1e-300)
    left = spectra - level[:, None] * standing
    floor = 1e-3 * np.max(np.abs(pulse)) + 1e-300
    return left * np.exp(1j * omega * late) * pulse.conj() / (np.abs(pulse) + floor)
