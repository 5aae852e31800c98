"""A fitted room from above, with the spread of each wall."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from inverse.acoustics import Acoustics
from inverse.bands.fitted_bands import bands_of
from inverse.objects.found_objects import FoundObjects
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.shoebox import FittedRoom
from inverse.walls.cells import cut_cells, label_cells, shape_of
from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.schema import Schema

__all__ = ["GROUND_PLAN", "GroundPlan", "PlanWall", "box_shape", "cut_at", "plan_of"]

GROUND_PLAN = Schema("ground plan", 1)
BOUNDS_M = 30.0
"""A box open to one side is drawn so far: beyond any room that was heard."""
PIECE_M, HEARD_M = 0.25, 0.5
"""Walls are drawn in pieces; a reflection within half a metre speaks for one."""
LEVEL = 0.99  # of the vertical: planes within 8 degrees are floors and ceilings


@dataclass(frozen=True, eq=False)
class PlanWall:
    """Hold one wall of a plan and how well it is known.

    Parameters
    ----------
    normal, offset_m : ndarray, float
        Plane n . x = d, normal into the air.
    sd_mm : float
        Standard deviation of its place, millimetres; NaN where it stands as drawn.
    reflection : float
        Mean reflection factor.
    pieces : ndarray, shape (n, 2, 2)
        Ends of its pieces in the plan, metres; empty for floor and ceiling.
    heard : ndarray of bool, shape (n,)
        Whether reflections of the training rows fall on each piece.
    """

    normal: FloatArray
    offset_m: float
    sd_mm: float
    reflection: float
    pieces: FloatArray
    heard: NDArray[np.bool_]

    @property
    def level(self) -> str:
        """Floor, ceiling, or nothing for a wall."""
        if abs(self.normal[2]) < LEVEL:
            return ""
        return "floor" if self.normal[2] > 0 else "ceiling"

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "normal": self.normal.tolist(),
            "offset_m": self.offset_m,
            "sd_mm": self.sd_mm if np.isfinite(self.sd_mm) else None,
            "reflection": self.reflection,
            "level": self.level,
            "pieces": self.pieces.tolist(),
            "heard": self.heard.tolist(),
        }


@dataclass(frozen=True, eq=False)
class GroundPlan:
    """Hold the walls, places and alarms of a room, as a drawing shows them.

    Parameters
    ----------
    walls : list of PlanWall
        What was found.
    emitters, listeners : ndarray, shape (n, 2)
        Places of the training rows.
    known : ndarray, shape (n, 2, 2)
        Walls of the room's description, for comparison; empty where unknown.
    height_m : float
        Where the room is cut.
    unexplained : float
        Part of the energy that paths do not predict.
    alarms : list of str
        What a person should know, walls that were not heard among it.
    mark : str
        SIMULATED or MEASURED.
    furnishing : FoundObjects
        What stands in the room.
    """

    walls: list[PlanWall]
    emitters: FloatArray
    listeners: FloatArray
    known: FloatArray
    height_m: float
    unexplained: float
    mark: str
    alarms: list[str] = field(default_factory=list)
    furnishing: FoundObjects = field(default_factory=FoundObjects)

    def save(self, path: Path) -> None:
        """Write the plan as JSON."""
        content = {
            **GROUND_PLAN.stamp,
            "mark": self.mark,
            "height_m": self.height_m,
            "unexplained": self.unexplained,
            "alarms": self.alarms,
            "walls": [wall.as_dict() for wall in self.walls],
            "furnishing": self.furnishing.as_dict(),
            "known": self.known.tolist(),
            "emitters": self.emitters.tolist(),
            "listeners": self.listeners.tolist(),
        }
        path.write_text(json.dumps(content, indent=1) + "\n")


def plan_of(
    acoustics: Acoustics,
    emitters: FloatArray,
    listeners: FloatArray,
    known: FloatArray,
    mark: str,
) -> GroundPlan:
    """Return the plan of a room.

    Parameters
    ----------
    acoustics : Acoustics
        What was found.
    emitters, listeners : ndarray, shape (rows, 3)
        Ends of the training rows.
    known : ndarray, shape (T, 3, 3)
        Triangles of the room's description; empty where unknown.
    mark : str
        SIMULATED or MEASURED.

    Raises
    ------
    SignalError
        If there are no rows.
    """
    fitted = acoustics.fitted
    if len(emitters) == 0:
        raise SignalError("a plan needs the ends of at least one row")
    height = float(np.median(np.concatenate([emitters[:, 2], listeners[:, 2]])))
    owner = np.zeros(len(known), dtype=np.int64)
    pieces = [piece for _, piece in cut_at(known, owner, height)]
    return GroundPlan(
        [] if fitted is None else _walls(fitted, emitters, listeners, height),
        np.unique(emitters[:, :2].round(3), axis=0),
        np.unique(listeners[:, :2].round(3), axis=0),
        np.array(pieces).reshape(-1, 2, 2),
        height,
        acoustics.unexplained,
        mark,
        acoustics.alarms,
        FoundObjects.of(bands_of(fitted)),
    )


def _walls(
    fitted: FittedRoom | FittedMesh,
    emitters: FloatArray,
    listeners: FloatArray,
    height: float,
) -> list[PlanWall]:
    if fitted.n_walls == 0:
        return []
    shape, spread, factors = _shape_of(fitted)
    cuts = cut_at(shape.vertices[shape.faces], shape.plane_of, height)
    walls = []
    for number, plane in enumerate(shape.planes):
        mine = [piece for owner, piece in cuts if owner == number]
        pieces = _pieces(mine)
        hits = _hits(shape, number, emitters, listeners)
        walls.append(
            PlanWall(
                plane[:3],
                float(plane[3]),
                float(1000 * spread[number]),
                float(factors[number]),
                pieces,
                _near(pieces, hits[:, :2]),
            )
        )
    return walls


def _shape_of(
    fitted: FittedRoom | FittedMesh,
) -> tuple[Polyhedron, FloatArray, FloatArray]:
    """Return faces, standard deviations and reflection factors, one a plane."""
    if isinstance(fitted, FittedMesh):
        return fitted.room.shape, fitted.plane_sd, fitted.room.walls
    box = fitted.room.box
    return (
        box_shape(box),
        fitted.wall_sd()[box.found],
        fitted.room.walls[box.found],
    )


def box_shape(box: OrientedBox) -> Polyhedron:
    """Return the faces of a box's heard walls, in their order."""
    planes = box.planes[box.found]
    low, high = box.origin - BOUNDS_M, box.origin + BOUNDS_M
    cells = cut_cells(planes, low, high)
    air = np.array([all(side > 0 for side in cell.sides) for cell in cells])
    support = np.ones((len(cells), len(planes)))
    shape = shape_of(cells, label_cells(cells, air, support) & air, planes)
    if shape is None:
        raise SignalError("a box without heard walls has no shape")
    order = [int(np.argmin(np.abs(planes - row).sum(axis=1))) for row in shape.planes]
    return Polyhedron(
        planes, shape.vertices, shape.faces, np.array(order)[shape.plane_of]
    )


def cut_at(
    triangles: FloatArray, owner: NDArray[np.int64], height: float
) -> list[tuple[int, FloatArray]]:
    """Return where triangles meet a horizontal plane: owner and ends in plan."""
    cuts = []
    # a corner at just that height would count twice or not at all
    level = height + 1.7e-6
    for number, corners in zip(owner.tolist(), triangles, strict=True):
        above = corners[:, 2] > level
        if above.all() or not above.any():
            continue
        ends = []
        for k in range(3):
            one, other = corners[k], corners[(k + 1) % 3]
            if (one[2] > level) != (other[2] > level):
                share = (level - one[2]) / (other[2] - one[2])
                ends.append((one + share * (other - one))[:2])
        cuts.append((number, np.array(ends)))
    return cuts


def _pieces(cuts: list[FloatArray]) -> FloatArray:
    """Cut lines into short pieces, shape (n, 2, 2)."""
    made = []
    for one, other in cuts:
        count = max(int(np.ceil(np.linalg.norm(other - one) / PIECE_M)), 1)
        share = np.linspace(0, 1, count + 1)[:, None]
        points = one + share * (other - one)
        made.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate([np.empty((0, 2, 2)), *made])


def _hits(
    shape: Polyhedron, number: int, emitters: FloatArray, listeners: FloatArray
) -> FloatArray:
    """Return where first reflections of the rows meet a plane's faces, (n, 3)."""
    plane = shape.planes[number]
    a, b = emitters @ plane[:3] - plane[3], listeners @ plane[:3] - plane[3]
    ahead = (a > 0) & (b > 0)
    a, b, one, other = a[ahead], b[ahead], emitters[ahead], listeners[ahead]
    foot, far = one - a[:, None] * plane[:3], other - b[:, None] * plane[:3]
    points = foot + (a / (a + b))[:, None] * (far - foot)
    faces = shape.vertices[shape.faces[shape.plane_of == number]]
    points = points[_within(points, faces, plane[:3])]
    return points


def _within(
    points: FloatArray, triangles: FloatArray, normal: FloatArray
) -> NDArray[np.bool_]:
    inside = np.zeros(len(points), dtype=bool)
    for corners in triangles:
        sides = np.roll(corners, -1, axis=0) - corners
        inward = np.cross(normal, sides)
        inward *= np.sign(np.sum(inward * (np.roll(corners, -2, axis=0) - corners), 1))[
            :, None
        ]
        heights = np.einsum("psx,sx->ps", points[:, None] - corners, inward)
        inside |= (heights > -1e-9).all(axis=1)
    return inside


def _near(pieces: FloatArray, hits: FloatArray) -> NDArray[np.bool_]:
    if len(pieces) == 0 or len(hits) == 0:
        return np.zeros(len(pieces), dtype=bool)
    middles = pieces.mean(axis=1)
    gap = np.linalg.norm(middles[:, None] - hits, axis=2).min(axis=1)
    return gap < HEARD_M
