"""What stands in the way of paths: voxels that keep sound, alike from both ends."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.half_octaves import LoopInput
from inverse.paths.oriented_box import OrientedBox
from rir.arrays import ComplexArray, FloatArray

__all__ = ["Occluders", "voxels_of"]

VOXEL_M, MOST_VOXELS = 0.25, 20000  # half a wave of 700 Hz; large rooms get larger ones
SHADED_ORDER = 3  # later echoes cross the room so often that all lose much alike
LEAST_VOXELS = 4  # that touch: a sixteenth of a cubic metre, less than a chair
SOLID = 0.35
"""Share of what most voxels in the way keep that makes a voxel solid."""


def voxels_of(box: OrientedBox) -> NDArray[np.int64]:
    """Return how many voxels a box holds along each of its axes."""
    size = box.high - box.low
    edge = max(VOXEL_M, float(np.prod(size) / MOST_VOXELS) ** (1 / 3))
    return np.maximum(np.round(size / edge), 1).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Occluders:
    """Hold voxels of a box, x slowest, and what a metre through each keeps."""

    shape: NDArray[np.int64]
    """Voxels along each axis. Shape (3,)."""
    hertz: FloatArray
    """Middles of the bands that were measured. Shape (groups,)."""
    depths: FloatArray
    """Nepers a metre. Shape (groups, voxels)."""

    @cached_property
    def solid(self) -> NDArray[np.bool_]:
        """Whether each voxel is in the way, shape (nx, ny, nz)."""
        mean = self.depths.mean(axis=0)
        if not (mean > 0).any():
            return np.zeros(self.shape, dtype=bool)
        least = SOLID * float(np.quantile(mean[mean > 0.1 * mean.max()], 0.9))
        return (mean > least).reshape(self.shape)

    def blocks(self, box: OrientedBox) -> list[tuple[FloatArray, FloatArray]]:
        """Return low and high corner of each block, in the frame of the box.

        Corners are relative to the box's origin; voxels that share a face are one
        block, and lone ones none.
        """
        from scipy.ndimage import find_objects, label

        step = (box.high - box.low) / self.shape
        numbers, _ = label(self.solid)  # type: ignore[misc]
        found = []
        for number, where in enumerate(find_objects(numbers), start=1):
            if (numbers[where] == number).sum() < LEAST_VOXELS:
                continue
            low = np.array([part.start for part in where])
            high = np.array([part.stop for part in where])
            found.append((box.low + low * step, box.low + high * step))
        return found

    def banded(self, centers: FloatArray) -> FloatArray:
        """Return nepers a metre at other frequencies, shape (bands, voxels).

        Shadows fade towards low frequencies with the root of the frequency.
        """
        where = np.interp(np.log(centers), np.log(self.hertz), range(len(self.hertz)))
        low = where.astype(int)
        high = np.minimum(low + 1, len(self.hertz) - 1)
        part = (where - low)[:, None]
        depths = (1 - part) * self.depths[low] + part * self.depths[high]
        return depths * np.minimum(np.sqrt(centers / self.hertz[0]), 1.0)[:, None]

    def add(
        self,
        taken: LoopInput,
        box: OrientedBox,
        centers: FloatArray,
        chosen: NDArray[np.bool_],
        out: ComplexArray,
    ) -> None:
        """Take what is kept from the `chosen` bands of (rows, total) envelopes.

        `centers` are the middles of the bands, hertz; for the rest see
        :meth:`inverse.bands.scatterers.Scatterers.add`.
        """
        from inverse.bands.occlusion_kernel import add_shadows

        add: Any = add_shadows
        order = min(taken.interior.order, SHADED_ORDER)
        interior = taken.interior._replace(order=order)
        add(
            *taken._replace(interior=interior),
            chosen,
            (box.high - box.low) / self.shape,
            self.shape,
            self.banded(centers),
            out,
        )

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return plain arrays, for a file."""
        return {
            "voxels": self.shape,
            "voxel_hertz": self.hertz,
            "voxel_depths": self.depths,
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, Any]) -> "Occluders | None":
        """Take out of `arrays` what :meth:`as_arrays` put in, if it did."""
        if "voxels" not in arrays:
            return None
        names = "voxels", "voxel_hertz", "voxel_depths"
        return cls(*(arrays.pop(name) for name in names))
