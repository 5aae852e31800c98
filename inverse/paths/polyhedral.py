"""From a room of flat faces, roughly known, to a fitted one."""

import json
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from inverse.paths.bank import ideal_bank
from inverse.paths.bent import bends, bent_sound
from inverse.paths.coloring import Coloring
from inverse.paths.mesh_fit import (
    MeshStep,
    PlaneFit,
    family_sd,
    fit_planes,
    squared_errors,
)
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.polish import polished, without_coloring
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.shoebox import FIRST_FACTOR, ROUNDS, first_parts, low_part
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import POOR, unexplained_energy
from rir import GainPattern, Poses
from rir.arrays import FloatArray

__all__ = [
    "WIDE_M",
    "FittedMesh",
    "fit_drawn",
    "fit_polyhedron",
    "mesh_alarms",
    "mesh_error",
    "with_paths",
    "without_bent",
]

STAGES = (
    MeshStep(1500.0, 1, 4, pattern=False),
    MeshStep(3000.0, 2, 4),
    MeshStep(6000.0, 4, 3),
)
LOW_ROWS, FULL_ROWS = 60, 40
"""Rows of the coarse stages, which are cheap, and of the whole band."""
MOST_ORDER = 16
"""Reflections of a path: trees of more cost minutes and carry little energy."""
ORDERS = (5, 9, MOST_ORDER)
"""Depths that trees are grown to, the next only where the last is not enough."""
WORTH_BENDING = 0.98
"""Bent sound must lower the error by 2 %: less is chance, and edges are dear."""
WIDE_M = 0.02  # a wall known worse is named: at 2 cm, paths are a wave of 8 kHz off
MOST_FACES = 4000  # triangles of a mesh: mirror trees of more do not end in minutes


@dataclass(frozen=True, eq=False)
class FittedMesh:
    """Hold a room of flat faces and how it was fitted."""

    room: MeshRoom
    """The room."""
    coloring: Coloring
    """The slow part of the source."""
    plane_sd: FloatArray
    """Standard deviation of each plane's place, metres; NaN where it was not moved.
    Shape (P,)."""
    bending: bool = False
    """Whether sound bends around edges."""
    family_sd: dict[str, float] = field(default_factory=dict)
    """Standard deviation of each kind of parameter."""

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return all paths' sound, shape (rows, n_samples)."""
        render = partial(self._plain, emitters, listeners)
        return self.coloring.heard(render, n_samples)

    def _plain(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        plain = self.room.render(emitters, listeners, n_samples)
        if self.bending:
            plain += bent_sound(self.room, emitters, listeners, n_samples)
        return plain

    @property
    def n_walls(self) -> int:
        """Number of planes."""
        return len(self.room.walls)

    @property
    def speed_of_sound(self) -> float:
        """Metres per second, fitted."""
        return self.room.speed_of_sound

    def length_sd(self, lengths: FloatArray) -> FloatArray:
        """Return the standard deviation of paths of given lengths, metres.

        Each bounce adds a wall's error; bounces grow with length over the mean
        free path of the room.
        """
        shape = self.room.shape
        known = self.plane_sd[np.isfinite(self.plane_sd)]
        spread = float(known.mean()) if len(known) else 0.0
        volume = max(float(shape.mesh.volume), 1e-3)
        free = 4 * volume / max(float(shape.areas.sum()), 1e-3)
        bounces = np.asarray(lengths) / max(free, 0.1)
        return 1.16 * spread * bounces / np.sqrt(6)

    def report(self) -> dict[str, Any]:
        """Return what was found, in plain values."""
        room = self.room
        return {
            "walls": len(room.walls),
            "planes": room.shape.planes.tolist(),
            "plane_sd_m": [float(one) for one in self.plane_sd],
            "reflection": room.walls.tolist(),
            "speed_of_sound": float(room.speed_of_sound),
            "latency_s": float(room.latency_s),
            "volume_m3": float(room.shape.mesh.volume),
            "sd": dict(self.family_sd),
        }

    def as_arrays(self) -> dict[str, Any]:
        """Return everything as plain arrays, for a file."""
        room = self.room
        return {
            **room.as_arrays(),
            **{name: getattr(room.shape, name) for name in _SHAPE},
            "coloring": self.coloring.factors,
            "plane_sd": self.plane_sd,
            "bending": self.bending,
            "family_sd": json.dumps(self.family_sd),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "FittedMesh":
        """Rebuild what :meth:`as_arrays` returned."""
        shape = Polyhedron(**{name: arrays[name] for name in _SHAPE})
        room = MeshRoom(shape, **MeshRoom.parts_of(arrays))
        coloring = Coloring(arrays["coloring"], room.sample_rate)
        bending = bool(arrays.get("bending", False))
        spread = json.loads(str(arrays.get("family_sd", "{}")))
        return cls(room, coloring, arrays["plane_sd"], bending, spread)


_SHAPE = ("planes", "vertices", "faces", "plane_of")


def fit_polyhedron(
    rows: FitSet,
    direct: DirectSound,
    shape: Polyhedron,
    reach_m: float = 40.0,
    listening: GainPattern | None = None,
) -> FittedMesh:
    """Fit planes, air, devices and pulse of a room of flat faces to rows.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the equations cannot be solved.
    """
    room = replace(_start(rows, direct, shape), reach_m=reach_m)
    if listening is not None:
        room = replace(room, listening=listening.coefficients.mean(axis=0))
    few = rows.spread(LOW_ROWS)
    for step in STAGES:
        if 2.4 * step.edge_hz <= rows.sample_rate:
            room = staged(few, room, step).room
    few = rows.spread(FULL_ROWS)
    room = replace(room, order=MOST_ORDER, bank=ideal_bank(36))
    whole = MeshStep(0.5 * rows.sample_rate, MOST_ORDER, 2)
    coloring = Coloring.none(rows.sample_rate)
    room = _with_right_order(few, room)
    fitted = fit_planes(few, with_paths(few, room), whole, few.responses)
    few, bending = without_bent(few, fitted.room)
    for turn in range(ROUNDS):
        coloring, room = polished(few, fitted.room, coloring, turn, mesh_error)
        fitted = replace(fitted, room=room)
        if turn < ROUNDS - 1:
            rest = without_coloring(few, fitted.room, coloring)
            room = with_paths(few, fitted.room)
            fitted = fit_planes(few, room, whole, rest)
    spread = family_sd(fitted)
    return FittedMesh(fitted.room.free(), coloring, fitted.plane_sd(), bending, spread)


def without_bent(rows: FitSet, room: MeshRoom) -> tuple[FitSet, bool]:
    """Take the sound bent around edges out of rows, where it explains some."""
    if not bends(room):
        return rows, False
    bent = bent_sound(room, rows.emitters, rows.listeners, rows.n_samples)
    rest = rows.responses - bent
    if mesh_error(rows, room, rest) > WORTH_BENDING * mesh_error(
        rows, room, rows.responses
    ):
        return rows, False
    return replace(rows, responses=rest), True


def fit_drawn(
    rows: FitSet,
    direct: DirectSound,
    shape: Polyhedron,
    reach_s: float,
    listening: GainPattern | None = None,
) -> tuple[FittedMesh | None, list[str]]:
    """Fit a room as it was drawn; None, and why, if it is not where rows are from."""
    instead = "; walls are looked for in the responses instead"
    if len(shape.faces) > MOST_FACES:
        return None, [
            f"the room's mesh has {len(shape.faces)} triangles, more than "
            f"{MOST_FACES}: give a simpler one{instead}"
        ]
    ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
    outside = shape.mesh.outside(ends)
    if outside.mean() > 0.1:
        return None, [
            f"{100 * outside.mean():.0f} % of the poses stand outside the room as "
            f"drawn: their coordinates differ{instead}"
        ]
    try:
        fitted = fit_polyhedron(
            rows, direct, shape, reach_s * rows.speed_of_sound, listening
        )
    except np.linalg.LinAlgError:
        return None, [f"the fit of the room as drawn did not come to an end{instead}"]
    few = rows.spread(FULL_ROWS)
    if not unexplained_energy(few, fitted) < 1:
        return None, [f"the room as drawn explains nothing of the responses{instead}"]
    return fitted, []


def mesh_alarms(fitted: FittedMesh, unexplained: float) -> list[str]:
    """Return what a person should know of a room of flat faces."""
    alarms = []
    if unexplained > POOR:
        alarms.append(
            f"paths explain only {100 * (1 - unexplained):.0f} % of the energy: the "
            "room has other walls than these, or the poses are off"
        )
    unheard = int(np.isnan(fitted.plane_sd).sum())
    if unheard:
        alarms.append(
            f"{unheard} of {fitted.n_walls} planes are met by too few paths to be "
            "checked; they stand as drawn"
        )
    for wall in np.flatnonzero(fitted.plane_sd > WIDE_M):
        alarms.append(
            f"plane {wall + 1} is known to {1000 * fitted.plane_sd[wall]:.0f} mm only"
        )
    return alarms


def staged(rows: FitSet, room: MeshRoom, step: MeshStep) -> PlaneFit:
    """Fit a room to the low part of rows, with paths of low order."""
    bank, low = low_part(rows, step.edge_hz)
    moved = with_paths(rows, replace(room, bank=bank, order=step.order))
    return fit_planes(rows, moved, step, low)


def _start(rows: FitSet, direct: DirectSound, shape: Polyhedron) -> MeshRoom:
    factors = np.full(len(shape.planes), FIRST_FACTOR)
    return MeshRoom(shape, **first_parts(rows, direct), walls=factors)


def with_paths(rows: FitSet, room: MeshRoom) -> MeshRoom:
    """Return the room with the paths of these rows listed."""
    return room.free().holding(rows.emitters, rows.listeners, rows.n_samples)


def _with_right_order(rows: FitSet, room: MeshRoom) -> MeshRoom:
    """Stop at the order where the sound stops, as simulators do.

    The last order is the one that leaves the smallest error; deeper trees are
    only grown while more order helps.
    """
    best, errors, most = 1, [0.0], ORDERS[0]
    for most in ORDERS:
        held = with_paths(rows, replace(room, order=most))
        paths = held.paths
        if paths is None:
            return room
        deepest = int(paths.order.max(initial=0))
        errors = [
            mesh_error(rows, replace(held, paths=paths.below(order)), rows.responses)
            for order in range(deepest + 1)
        ]
        best = int(np.argmin(errors))
        if best < most - 1 or deepest < most:
            break
    whole = errors[-1] <= 1.02 * errors[best]
    return replace(room, order=most if whole else max(best, 1))


def mesh_error(rows: FitSet, room: MeshRoom, target: FloatArray) -> float:
    """Return the squared error of a room's paths, summed over rows."""
    return float(squared_errors(rows, room, target).sum())
