"""From a fitted box to one whose walls depend on frequency and angle."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fields.path.band_fit import BandData, fit_walls, hear_bands
from fields.path.banded_room import BandedRoom
from fields.path.direct import DirectSound
from fields.path.fitset import FitSet
from fields.path.half_octaves import HalfOctaves
from fields.path.room import OMNI, BoxRoom
from rir.physics import air_absorption

__all__ = ["start_banded"]

FloatArray = NDArray[np.float64]
SLANT = 0.6
"""Cosine at which a factor and an admittance are taken for the same wall."""


def start_banded(
    rows: FitSet, direct: DirectSound, room: BoxRoom, *, angled: bool
) -> BandedRoom:
    """Return a banded room that says what a plain one does."""
    grid = HalfOctaves(rows.sample_rate, rows.n_samples)
    omega = 2 * np.pi * np.arange(len(grid.hertz)) / grid.size
    pulse = np.fft.rfft(direct.pulse, grid.size)
    source = pulse * np.exp(1j * omega * direct.lead)
    factors = np.clip(np.abs(room.walls), 0.05, 0.97)
    walls = SLANT * (1 - factors) / (1 + factors) if angled else factors
    emitting = np.zeros((grid.bands, len(room.emitting)))
    emitting[:, 0] = OMNI[0]
    loss = np.asarray(air_absorption(grid.centers)) * np.log(10) / 20
    return BandedRoom(
        replace(room, latency_s=direct.latency_s),
        grid,
        np.tile(walls.astype(np.complex128), (grid.bands, 1)),
        angled,
        loss,
        np.zeros(grid.bands),
        emitting,
        np.tile(room.listening, (grid.bands, 1)),
        source,
    )
