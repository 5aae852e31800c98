"""Look for points whose paths agree with the residual of the images."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from inverse.bands.band_fit import BandData
from inverse.bands.banded_room import BandedRoom
from rir import Poses
from rir.arrays import ComplexArray, FloatArray

__all__ = ["ResidualSignals", "residual_signals"]

FINER = 2
"""Samples of an analytic signal over those of a response."""
CONSTANT, FIRST = np.sqrt(1 / (4 * np.pi)), np.sqrt(3 / (4 * np.pi))
"""Norms of the orthonormal harmonics of order 0 and 1."""


@dataclass(frozen=True, eq=False)
class ResidualSignals:
    """Hold what is left of rows between two frequencies.

    Parameters
    ----------
    banded : BandedRoom
        What the walls and devices are.
    band : int
        The half octave in the middle.
    emitters, listeners : Poses
        Believed places.
    signals : ndarray, shape (rows, times)
        Analytic, filtered as an arrival is, rows of equal weight.
    """

    banded: BandedRoom
    band: int
    emitters: Poses
    listeners: Poses
    signals: ComplexArray

    def rows(self, count: int) -> "ResidualSignals":
        """Return the first rows only."""
        return replace(
            self,
            emitters=self.emitters[:count],
            listeners=self.listeners[:count],
            signals=self.signals[:count],
        )

    def agreement(self, points: FloatArray) -> FloatArray:
        """Return how well paths by way of each point agree, shape (points,)."""
        from inverse.bands.scatter_kernel import sum_points

        room = self.banded.room
        sums = np.zeros(len(points), dtype=np.complex128)
        norms = np.zeros(len(points))
        add: Any = sum_points
        add(
            room.ends(self.emitters, self.listeners),
            self.banded.geometry,
            self.banded.walls[self.band],
            self.banded.angled,
            _first_order(self.banded.emitting[self.band]),
            _first_order(self.banded.listening[self.band]),
            np.ascontiguousarray(room.box.inside(points)),
            self.signals,
            float(FINER),
            sums,
            norms,
        )
        return np.abs(sums) / np.sqrt(np.maximum(norms, 1e-300))


def residual_signals(
    data: BandData,
    banded: BandedRoom,
    residual: ComplexArray,
    low_hz: float,
    high_hz: float,
) -> ResidualSignals:
    """Return envelopes that are left as signals between two frequencies."""
    grid = banded.grid
    spectra = grid.joined(residual)
    power = np.abs(spectra) ** 2
    rows = np.sqrt(1 / np.maximum((np.abs(residual) ** 2).sum(axis=1), 1e-300))
    noise = _smoothed((rows[:, None] ** 2 * power).sum(axis=0), grid.masks)
    middle = np.sqrt(low_hz * high_hz)
    place = np.log(np.maximum(grid.hertz, 1.0) / middle) / np.log(high_hz / middle)
    window = np.where(np.abs(place) < 1, np.cos(0.5 * np.pi * place) ** 2, 0.0)
    filtered = spectra * rows[:, None] * (window * data.weight / noise)
    band = int(np.argmin(np.abs(np.log(grid.centers / middle))))
    whole = np.zeros((len(residual), FINER * grid.size), dtype=np.complex128)
    whole[:, : len(grid.hertz)] = filtered * np.exp(-1j * banded.phase[band])
    signals = np.fft.ifft(whole, axis=1)
    kept = FINER * grid.n_samples
    return ResidualSignals(
        banded,
        band,
        data.emitters,
        data.listeners,
        np.ascontiguousarray(signals[:, :kept]),
    )


def _smoothed(power: FloatArray, masks: FloatArray) -> FloatArray:
    """Return power as half octaves see it."""
    mean = masks @ power / np.maximum(masks.sum(axis=1), 1e-300)
    return mean @ masks + 1e-9 * float(mean.max()) + 1e-300


def _first_order(coefficients: FloatArray) -> FloatArray:
    """Return gains of constant and first order of a pattern."""
    if len(coefficients) < 4:
        return np.array([coefficients[0] * CONSTANT])
    return np.concatenate([coefficients[:1] * CONSTANT, coefficients[1:4] * FIRST])
