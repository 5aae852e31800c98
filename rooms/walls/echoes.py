"""A reflection that turns phase, as a few arrivals around its own.

Arrivals have one real gain per octave. A wall turns the phase and colours the sound
inside octaves, so its echo is written as seven arrivals per octave, a quarter of that
octave's period apart, whose gains fit the reflection over frequency.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.reflection import ECHO_FREQUENCIES, Spectra
from rooms.sound import Arrivals

__all__ = ["spread_echoes"]

_SIDE = 3
"""Arrivals before and after: with two, thirds of an octave stray by 1 dB at grazing."""

_DAMPING = 1e-3
"""Keeps gains of neighbours from cancelling; costs less than 0.1 dB."""


def spread_echoes(
    arrivals: Arrivals, spectra: Spectra, centers: FloatArray
) -> list[Arrivals]:
    """Return arrivals with those that angled walls reflected spread over time.

    Parameters
    ----------
    arrivals : Arrivals
        One for each path.
    spectra : Spectra
        Of the paths.
    centers : ndarray, shape (bands,)
        Octave centres of the gains [Hz].
    """
    some = np.nonzero(spectra.angled)[0]
    if not len(some):
        return [arrivals]
    shifts, matrix = _rule(tuple(map(float, centers)))
    wanted = np.concatenate([spectra.factor.real, spectra.factor.imag], axis=1)[some]
    # what other effects did to the octaves they do to every arrival
    other = arrivals.gain[some] / spectra.octaves[some]
    taps = (wanted @ matrix).reshape(len(some), len(centers), -1) * other[..., None]
    bands, each = taps.shape[1:]
    gain = np.zeros((len(some), bands, each, bands))
    gain[:, np.arange(bands), :, np.arange(bands)] = taps.swapaxes(0, 1)
    many = np.repeat(some, bands * each)
    spread = _picked(arrivals, many)
    echoes = replace(
        spread,
        delay=spread.delay + np.tile(shifts.ravel(), len(some)),
        gain=gain.reshape(-1, bands),
    )
    return [_picked(arrivals, np.nonzero(~spectra.angled)[0]), echoes]


def _picked(arrivals: Arrivals, which: IntArray) -> Arrivals:
    corners = arrivals.corners
    return Arrivals(
        listener=arrivals.listener[which],
        delay=arrivals.delay[which],
        gain=arrivals.gain[which],
        departure=arrivals.departure[which],
        arrival=arrivals.arrival[which],
        order=arrivals.order[which],
        corners=None if corners is None else corners[which],
    )


@lru_cache(maxsize=4)
def _rule(centers: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return shifts [s], (bands, taps), and what turns spectra into gains.

    The least squares of what the crossed-over octaves make of the arrivals.
    """
    quarter = 1 / (4 * np.array(centers))
    shifts = quarter[:, None] * np.arange(-_SIDE, _SIDE + 1)
    windows = _crossed_over(centers)
    turn = np.exp(-2j * np.pi * ECHO_FREQUENCIES * shifts[..., None])
    basis = (windows[:, None] * turn).reshape(-1, len(ECHO_FREQUENCIES))
    rows = np.concatenate([basis.real, basis.imag], axis=1)
    count = len(rows)
    damped = rows @ rows.T
    damped += _DAMPING * len(ECHO_FREQUENCIES) / count * np.eye(count)
    return shifts, np.asarray(np.linalg.solve(damped, rows).T, float)


def _crossed_over(centers: tuple[float, ...]) -> FloatArray:
    """Return the gains of the octaves' filters, (bands, frequencies).

    As `rir.bands.crossover_gains` has them.
    """
    place = np.interp(
        np.log(ECHO_FREQUENCIES), np.log(centers), np.arange(len(centers))
    )
    distance = np.abs(place - np.arange(len(centers))[:, None])
    return np.cos(np.pi / 2 * np.minimum(distance, 1)) ** 2
