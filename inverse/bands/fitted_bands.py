"""A fitted box whose walls depend on frequency and angle."""

from dataclasses import dataclass

import numpy as np

from inverse.bands.banded_room import BandedRoom
from inverse.paths.shoebox import FittedRoom
from inverse.rows.tiles import Tiles
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["FittedBandedRoom", "bands_of"]


@dataclass(frozen=True, eq=False)
class FittedBandedRoom(FittedRoom):
    """Hold a fitted box with what each half octave adds."""

    banded: BandedRoom
    """Walls, air and devices of each half octave."""
    tones: FloatArray | None = None
    """Gains that give each tile the energy it has on average. Shape (octaves, bins)."""

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return all paths' sound, shape (rows, n_samples)."""
        plain = self.banded.render(emitters, listeners, n_samples)
        if self.tones is None:
            return plain
        grid, out = self.banded.grid, plain.copy()
        kept = min(grid.n_samples, plain.shape[1])
        tiles = Tiles(grid.sample_rate, kept)
        gains = self.tones[None, :, : tiles.bins]
        gains = np.broadcast_to(gains, (len(plain), *gains.shape[1:]))
        out[:, :kept] = tiles.gained(plain[:, :kept], gains)
        return out


def bands_of(fitted: object) -> BandedRoom | None:
    """Return a fitted room's half octaves; None where it has none."""
    return fitted.banded if isinstance(fitted, FittedBandedRoom) else None
