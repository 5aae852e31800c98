"""How a room is looked for, and what is known of it beforehand."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, NonNegativeFloat

from inverse.paths.polyhedron import Polyhedron
from rir import GainPattern
from rir.arrays import FloatArray

__all__ = ["NOTHING_KNOWN", "USUAL_SETTINGS", "PriorKnowledge", "SearchSettings"]


@dataclass(frozen=True)
class SearchSettings:
    """Sizes of a search."""

    scan_rows: Annotated[int, Field(ge=1)] = 120
    "responses the walls are looked for in"
    reach_s: NonNegativeFloat = 0.12
    "longest path, seconds; beyond it the late field speaks alone"
    late: bool = True
    "complete the paths with a late field"
    pose_sd_m: NonNegativeFloat = 0.003
    "standard deviation of each stated coordinate of fitted rows, metres; 0: exact"


@dataclass(frozen=True, eq=False)
class PriorKnowledge:
    """Hold what is known of a room and its devices before it is looked for.

    Parameters
    ----------
    shape : Polyhedron, optional
        The room as drawn, to some centimetres; looked for blind when left out.
    emitting : GainPattern, optional
        Pattern of the emitter; used where no wall is found.
    listening : GainPattern, optional
        Pattern of the listener; omnidirectional when left out.
    aimed : bool, optional
        Whether the devices differ in pattern; found out when left out.
    """

    shape: Polyhedron | None = None
    emitting: GainPattern | None = None
    listening: GainPattern | None = None
    aimed: bool | None = None

    @classmethod
    def of(
        cls,
        geometry: str,
        triangles: FloatArray | None,
        emitting: GainPattern | None,
        listening: GainPattern | None,
    ) -> "PriorKnowledge":
        """Return what a description of a room and of both devices tells.

        Parameters
        ----------
        geometry : str
            "auto": the room of `triangles`, where they are known; "blind": none; or
            the name of a mesh, a room file or a built-in scene.
        triangles : ndarray, shape (T, 3, 3), optional
            Surfaces of the room, metres.
        emitting, listening : GainPattern, optional
            Patterns of the devices.
        """
        shape = None
        if geometry == "auto":
            shape = None if triangles is None else Polyhedron.of_triangles(triangles)
        elif geometry != "blind":
            shape = Polyhedron.load(geometry)
        known = emitting is not None and listening is not None
        return cls(shape, emitting, listening, emitting != listening if known else None)


USUAL_SETTINGS, NOTHING_KNOWN = SearchSettings(), PriorKnowledge()
