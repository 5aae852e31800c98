"""The opening between two rooms, and the face of the wall it leads through."""

from dataclasses import dataclass

import numpy as np

from inverse.paths.oriented_box import OrientedBox
from inverse.walls.opening import Opening, find_opening, find_thickness
from inverse.walls.slabs import find_slab, half_slab, with_face
from rir.arrays import BoolArray, FloatArray

__all__ = ["PairsAcross", "find_doorway"]


@dataclass(frozen=True, eq=False)
class PairsAcross:
    """Hold pairs with one end in each of two rooms.

    Parameters
    ----------
    first, second : ndarray, shape (pairs, 3)
        Ends in the first and in the second room.
    lengths : ndarray, shape (pairs,)
        Shortest ways of sound, metres; NaN where unknown.
    """

    first: FloatArray
    second: FloatArray
    lengths: FloatArray

    @classmethod
    def of(
        cls,
        ends: tuple[FloatArray, FloatArray],
        ahead: BoolArray,
        turned: BoolArray,
        lengths: FloatArray,
    ) -> "PairsAcross":
        """Pick pairs whose emitter is in the first room, and in the second."""
        known = np.isfinite(lengths)
        ahead, turned = ahead & known, turned & known
        return cls(
            np.concatenate([ends[0][ahead], ends[1][turned]]),
            np.concatenate([ends[1][ahead], ends[0][turned]]),
            np.concatenate([lengths[ahead], lengths[turned]]),
        )

    @property
    def back(self) -> "PairsAcross":
        """The same pairs seen from the second room."""
        return PairsAcross(self.second, self.first, self.lengths)


def find_doorway(
    one: OrientedBox, other: OrientedBox, pairs: PairsAcross
) -> tuple[OrientedBox, OrientedBox, Opening, bool] | None:
    """Return two rooms, the opening between them, and whether its depth is known.

    Where one of the two faces of the wall was not heard, the way sound bends round
    the opening says how thick the wall is.
    """
    if len(pairs.lengths) == 0:
        return None
    slab = find_slab(one, other)
    if slab is not None:
        opening = find_opening(slab, pairs.first, pairs.second, pairs.lengths)
        return None if opening is None else (one, other, opening, True)
    for before, behind, seen in ((one, other, pairs), (other, one, pairs.back)):
        half = half_slab(before, behind, seen.second)
        if half is None:
            continue
        opening, known = find_thickness(half, seen.first, seen.second, seen.lengths)
        if opening is not None:
            behind = with_face(behind, opening.slab)
            first, second = (before, behind) if before is one else (behind, before)
            return first, second, opening, known
    return None
