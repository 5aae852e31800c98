"""Planes and rims of triangles, as the compiled loops look them up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray

__all__ = ["Tables", "make_tables"]


@dataclass(frozen=True, eq=False)
class Tables:
    """What the compiled loops look up."""

    rims: FloatArray
    """Half-spaces within which a point of the plane lies in the triangle. Shape (F, 3,
    4)."""
    planes: FloatArray
    """Normal and offset of each triangle. Shape (F, 4)."""
    blockers: IntArray
    """Triangles that can stand between two points of the room. Shape (B,)."""


def make_tables(corners: FloatArray, blocking: NDArray[np.bool_]) -> Tables:
    """Return the tables of triangles, of which some can stand between two points.

    Parameters
    ----------
    corners : ndarray, shape (F, 3, 3)
        Corners of each triangle [m].
    blocking : ndarray of bool, shape (F,)
        Whether a triangle can stand between two points of the room.
    """
    sides = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(sides[:, 0], sides[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inward = np.cross(normal[:, None], sides)
    inward /= np.linalg.norm(inward, axis=2, keepdims=True)
    rim = np.einsum("fsk,fsk->fs", inward, corners)
    offset = np.einsum("fk,fk->f", normal, corners[:, 0])
    return Tables(
        np.ascontiguousarray(np.concatenate([inward, rim[:, :, None]], axis=2)),
        np.column_stack([normal, offset]),
        np.nonzero(blocking)[0],
    )
