"""Small objects in a box: points that send on what reaches them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.bands.half_octaves import LoopInput
from inverse.paths.oriented_box import OrientedBox
from rir.arrays import ComplexArray, FloatArray

__all__ = ["Scatterers"]


@dataclass(frozen=True, eq=False)
class Scatterers:
    """Hold points that scatter alike to all sides, so that ends may be exchanged."""

    points: FloatArray
    """Where they stand in the room, metres. Shape (points, 3)."""
    gains: ComplexArray
    """Complex amplitude at 1 m of a wave of amplitude 1, metres. Shape (bands,
    points)."""

    def __len__(self) -> int:
        return len(self.points)

    @classmethod
    def none(cls, bands: int) -> "Scatterers":
        """Return no points."""
        return cls(np.zeros((0, 3)), np.zeros((bands, 0), dtype=np.complex128))

    def add(
        self,
        taken: LoopInput,
        box: OrientedBox,
        chosen: NDArray[np.bool_],
        out: ComplexArray,
    ) -> None:
        """Add what the points send on to the `chosen` bands of (rows, total).

        Parameters
        ----------
        taken : LoopInput
            Poses, room and kernels.
        box : OrientedBox
            The walls.
        chosen : ndarray of bool, shape (bands,)
            Bands to change.
        out : ndarray, shape (rows, total)
            Envelopes of all bands, changed in place.
        """
        from inverse.bands.scatter_kernel import add_points

        if not len(self):
            return
        add: Any = add_points
        add(
            *taken,
            box.inside(self.points),
            np.where(chosen[:, None], self.gains, 0.0),
            out,
        )

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return plain arrays, for a file."""
        return {"points": self.points, "gains": self.gains}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Any]) -> "Scatterers | None":
        """Take out of `arrays` what :meth:`as_arrays` put in, if it did."""
        if "points" not in arrays:
            return None
        return cls(arrays.pop("points"), arrays.pop("gains"))
