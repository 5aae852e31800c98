"""A reflection that turns phase, as a few arrivals after its own.

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

_COUNT = 7
"""Arrivals an octave: with five, thirds of an octave stray by 0.8 dB at grazing."""

_LEAD = 2
"""So many of them before the geometric arrival, since octaves ring before it: with
three, resonances of panels come out 1.4 dB off, with none stated octaves that no real
wall has."""

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
    if not np.any(spectra.angled):
        return [arrivals]
    places = tuple(map(float, centers))
    parts = [_picked(arrivals, np.nonzero(~spectra.angled)[0])]
    # close to a wall fewer come before: nothing arrives before emission
    quarters = 4 * np.outer(arrivals.delay, centers)
    leads, kind = np.unique(
        np.clip(quarters, 0, _LEAD).astype(int), axis=0, return_inverse=True
    )
    for k, lead in enumerate(leads.tolist()):
        some = np.nonzero(spectra.angled & (kind.ravel() == k))[0]
        if len(some):
            rule = _rule(places, tuple(lead))
            parts.append(_spread(arrivals, spectra, some, rule))
    return parts


def _spread(
    arrivals: Arrivals,
    spectra: Spectra,
    some: IntArray,
    rule: tuple[FloatArray, IntArray, FloatArray],
) -> Arrivals:
    """Return some arrivals spread over time."""
    shifts, place, matrix = rule
    bands, each = place.shape
    wanted = np.concatenate([spectra.factor.real, spectra.factor.imag], axis=1)[some]
    # what other effects did to the octaves they do to every arrival
    other = arrivals.gain[some] / spectra.octaves[some]
    taps = (wanted @ matrix).reshape(len(some), bands, each) * other[..., None]
    gain = np.zeros((len(some), len(shifts), bands))
    gain[:, place, np.arange(bands)[:, None]] = taps
    spread = _picked(arrivals, np.repeat(some, len(shifts)))
    return replace(
        spread,
        delay=spread.delay + np.tile(shifts, len(some)),
        gain=gain.reshape(-1, bands),
    )


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


@lru_cache(maxsize=32)
def _rule(
    centers: tuple[float, ...], leads: tuple[int, ...]
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return shifts [s], which of them bands use, and what turns spectra into gains.

    The least squares of what the crossed-over octaves make of the arrivals, `leads` of
    which come before the geometric one in each octave.
    """
    quarter = 1 / (4 * np.array(centers))
    shifts = quarter[:, None] * (np.arange(_COUNT) - np.array(leads)[:, None])
    windows = _crossed_over(centers)
    turn = np.exp(-2j * np.pi * ECHO_FREQUENCIES * shifts[..., None])
    basis = (windows[:, None] * turn).reshape(-1, len(ECHO_FREQUENCIES))
    rows = np.concatenate([basis.real, basis.imag], axis=1)
    count = len(rows)
    damped = rows @ rows.T
    damped += _DAMPING * len(ECHO_FREQUENCIES) / count * np.eye(count)
    # octaves are twice each other, so that they share every other arrival
    different, place = np.unique(shifts, return_inverse=True)
    matrix = np.asarray(np.linalg.solve(damped, rows).T, float)
    return different, place.reshape(shifts.shape), matrix


def _crossed_over(centers: tuple[float, ...]) -> FloatArray:
    """Return the gains of the octaves' filters, (bands, frequencies).

    As `rir.bands.crossover_gains` has them.
    """
    place = np.interp(
        np.log(ECHO_FREQUENCIES), np.log(centers), np.arange(len(centers))
    )
    distance = np.abs(place - np.arange(len(centers))[:, None])
    return np.cos(np.pi / 2 * np.minimum(distance, 1)) ** 2
