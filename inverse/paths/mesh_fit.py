"""Fit the planes, air and devices of a room of flat faces: Levenberg-Marquardt.

The mirror paths are listed once a stage and kept while the planes move by
centimetres; their lengths and gains are exact for the planes of each step.
"""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.box_fit import quick_energies, slow_columns
from inverse.paths.descent import (
    TRIES,
    damped_step,
    root_mean_square,
    row_weights,
    spread_of,
    trust,
)
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.polyhedron import tangents
from inverse.rows.fitset import FitSet
from rir.arrays import BoolArray, FloatArray, IntArray

__all__ = ["MeshStep", "PlaneFit", "family_sd", "fit_planes", "squared_errors"]

AIR = 2  # parameters before the planes': speed of sound and latency
LEAST_MET = 12  # a plane that fewer paths meet is not moved
LEAST_TILTED_M = 0.8  # a face that reaches less far is moved, not tilted
# weak priors and largest steps, as for boxes: metres per second and seconds, radians
# and metres, factors
AIR_SIGMAS, AIR_BOUND = (2.0, 2e-3), (1.5, 5e-4)
PLANE_SIGMAS, PLANE_BOUND = (0.02, 0.02, 0.05), (0.02, 0.02, 0.03)
FACTOR_SIGMA, FACTOR_BOUND = 0.5, 0.3
PATTERN_SIGMA = 3.0
SMALL = 1e-3
"""Least factor: at zero a wall's derivatives vanish and it could not come back."""


@dataclass(frozen=True)
class MeshStep:
    """One stage of the fit: how much of the sound, and what may move."""

    edge_hz: float
    order: int
    turns: int
    planes: bool = True
    pattern: bool = True


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """Hold the fitted room and the covariance of what moved."""

    room: MeshRoom
    """The room, its paths kept."""
    covariance: FloatArray
    """Of the active parameters."""
    active: BoolArray
    """Speed of sound, latency, two tilts and a shift a plane, factors, pattern. Shape
    (2 + 4 P + harmonics,)."""
    errors: FloatArray
    """Squared errors. Shape (rows,)."""

    def plane_sd(self) -> FloatArray:
        """Return each plane's standard deviation, shape (P,), metres; NaN if fixed."""
        count = len(self.room.walls)
        spread = spread_of(self.covariance, self.active)
        return spread[AIR : AIR + 3 * count].reshape(count, 3)[:, 2]


def family_sd(fit: PlaneFit) -> dict[str, float]:
    """Return the standard deviation of each kind of parameter, rms over it."""
    count, room = len(fit.room.walls), fit.room
    spread = spread_of(fit.covariance, fit.active)
    planes = spread[AIR : AIR + 3 * count].reshape(count, 3)
    level = max(abs(float(room.emitting[0])), 1e-300)
    families = {
        "turn_rad": planes[:, :2].ravel(),
        "walls_m": planes[:, 2],
        "speed_of_sound_m_s": spread[:1],
        "latency_s": spread[1:2],
        "reflection": spread[AIR + 3 * count : AIR + 4 * count],
        "emitter_pattern": spread[AIR + 4 * count :] / level,
    }
    return {name: root_mean_square(part) for name, part in families.items()}


def fit_planes(
    rows: FitSet, room: MeshRoom, step: MeshStep, filtered: FloatArray
) -> PlaneFit:
    """Run one stage on a room that holds the rows' paths."""
    active = _active(room, step)
    frame = _frame(room)
    power = (filtered**2).sum(axis=1)
    weights = row_weights(power)
    errors = squared_errors(rows, room, filtered)
    best, damping = float(weights @ np.minimum(errors, 4 * power)), 1e-3
    square = np.zeros((len(active), len(active)))
    right = np.zeros((len(rows), len(active)))
    for _ in range(step.turns):
        trusted = weights * trust(errors, power)
        square, right = _sums(rows, room, frame, active, filtered, trusted)
        pull = right.sum(axis=0)
        before = best
        for _ in range(TRIES):
            moved = _moved(room, frame, damped_step(square, pull, active, damping))
            found = squared_errors(rows, moved, filtered)
            now = float(weights @ np.minimum(found, 4 * power))
            if now < best:
                room, best, errors = moved, now, found
                damping = max(damping / 10, 1e-7)
                break
            damping *= 10
        if before - best < 1e-4 * best:
            break
    noise = best / max(float(np.count_nonzero(weights)) * filtered.shape[1], 1.0)
    inner = square[np.ix_(active, active)]
    inner = inner + np.diag(noise / _sigmas(room)[active] ** 2)
    room = replace(room, shape=room.shape.moved(room.shape.planes))
    inverse = np.asarray(np.linalg.pinv(inner), dtype=np.float64)
    spread = _covariance(inverse, right[:, active], rows.places, noise)
    return PlaneFit(room, spread, active, errors)


def _covariance(
    inverse: FloatArray, pulls: FloatArray, places: IntArray, noise: float
) -> FloatArray:
    """Return the covariance where errors of one row, and of one emitter, agree.

    A pose that is off pulls a whole row, and a whole emitter's rows, one way; the
    scatter of these pulls tells more than the noise of samples.

    References
    ----------
    H. White, Econometrica 48, 817 (1980).
    """
    best = inverse * noise
    groups = np.zeros((int(places.max(initial=0)) + 1, pulls.shape[1]))
    np.add.at(groups, places, pulls)
    for sums in (pulls, groups):
        count = len(sums)
        if count < 3:
            continue
        away = sums - sums.mean(axis=0)
        found = inverse @ (away.T @ away) @ inverse * count / (count - 1)
        if np.diag(found).sum() > np.diag(best).sum():
            best = found
    return best


def squared_errors(rows: FitSet, room: MeshRoom, targets: FloatArray) -> FloatArray:
    """Return each row's squared error above the slow part, shape (rows,)."""
    gap = targets - room.render(rows.emitters, rows.listeners, targets.shape[1])
    return quick_energies(gap, room.sample_rate)


def _active(room: MeshRoom, step: MeshStep) -> BoolArray:
    count = len(room.walls)
    met = np.zeros(count) if room.paths is None else room.paths.met(count)
    active = np.zeros(AIR + 4 * count + len(room.emitting), dtype=bool)
    active[:AIR] = step.planes
    moving = np.repeat((met >= LEAST_MET)[:, None], 3, axis=1)
    moving[:, :2] &= _extents(room) > LEAST_TILTED_M
    active[AIR : AIR + 3 * count] = step.planes & moving.ravel()
    active[AIR + 3 * count : AIR + 4 * count] = met > 0
    active[AIR + 4 * count :] = step.pattern
    return active


def _extents(room: MeshRoom) -> FloatArray:
    """Return how far each plane's faces reach along its tilts, shape (P, 2)."""
    shape, (tilts, _) = room.shape, _frame(room)
    reach = np.zeros((len(shape.planes), 2))
    for number in range(len(shape.planes)):
        corners = shape.vertices[shape.faces[shape.plane_of == number]].reshape(-1, 3)
        if len(corners):
            reach[number] = np.ptp(corners @ tilts[number].T, axis=0)
    return reach


def _sigmas(room: MeshRoom) -> FloatArray:
    count = len(room.walls)
    return np.concatenate(
        [
            AIR_SIGMAS,
            np.tile(PLANE_SIGMAS, count),
            np.full(count, FACTOR_SIGMA),
            np.full(len(room.emitting), PATTERN_SIGMA),
        ]
    )


def _frame(room: MeshRoom) -> tuple[FloatArray, FloatArray]:
    """Return the tilts, shape (P, 2, 3), and centers, (P, 3), of all planes."""
    shape = room.shape
    tilts = np.array([tangents(plane[:3]) for plane in shape.planes])
    middles = shape.vertices[shape.faces].mean(axis=1)
    a, b, c = np.moveaxis(shape.vertices[shape.faces], 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    centers = np.empty((len(shape.planes), 3))
    total = np.bincount(shape.plane_of, areas, minlength=len(centers))
    for axis in range(3):
        held = np.bincount(
            shape.plane_of, areas * middles[:, axis], minlength=len(centers)
        )
        centers[:, axis] = held / np.maximum(total, 1e-300)
    return tilts, centers


def _sums(
    rows: FitSet,
    room: MeshRoom,
    frame: tuple[FloatArray, FloatArray],
    active: BoolArray,
    targets: FloatArray,
    weights: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    from inverse.paths.mesh_kernel import accumulate_paths
    from inverse.paths.room import turns_of

    ends = rows.emitters.positions, rows.listeners.positions
    paths = room.paths or room.listed(*ends, targets.shape[1])
    square = np.zeros((len(active), len(active)))
    right = np.zeros((len(rows), len(active)))
    accumulate_paths(
        *ends,
        paths.starts,
        paths.order,
        paths.walls,
        room.shape.planes,
        *frame,
        turns_of(rows.emitters, np.eye(3)),
        turns_of(rows.listeners, np.eye(3)),
        room.scale,
        room.latency_s * room.sample_rate,
        room.walls,
        room.emitting,
        room.listening,
        room.bank.taps,
        room.bank.lead,
        room.speed_of_sound,
        room.sample_rate,
        active,
        targets,
        weights,
        slow_columns(targets.shape[1], room.sample_rate),
        square,
        right,
        np.zeros(len(rows)),
    )
    # latency is counted in samples inside
    square[1] *= room.sample_rate
    square[:, 1] *= room.sample_rate
    right[:, 1] *= room.sample_rate
    return square, right


def _moved(
    room: MeshRoom, frame: tuple[FloatArray, FloatArray], step: FloatArray
) -> MeshRoom:
    count = len(room.walls)
    air = np.clip(step[:AIR], -np.array(AIR_BOUND), AIR_BOUND)
    bound = np.array(PLANE_BOUND)
    moves = np.clip(step[AIR : AIR + 3 * count].reshape(count, 3), -bound, bound)
    planes = _tilted(room.shape.planes, frame, moves)
    change = step[AIR + 3 * count : AIR + 4 * count]
    walls = room.walls + np.clip(change, -FACTOR_BOUND, FACTOR_BOUND)
    walls = np.clip(walls, -1.0, 1.0)
    small = np.abs(walls) < SMALL
    return replace(
        room,
        # corners follow when the stage is over
        shape=replace(room.shape, planes=planes),
        speed_of_sound=room.speed_of_sound + air[0],
        latency_s=room.latency_s + air[1],
        walls=np.where(small, np.where(walls < 0, -SMALL, SMALL), walls),
        emitting=room.emitting + step[AIR + 4 * count :],
    )


def _tilted(
    planes: FloatArray, frame: tuple[FloatArray, FloatArray], moves: FloatArray
) -> FloatArray:
    tilts, centers = frame
    normals = planes[:, :3] + np.einsum("pk,pkx->px", moves[:, :2], tilts)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    height = np.einsum("px,px->p", planes[:, :3], centers) - planes[:, 3]
    offsets = np.einsum("px,px->p", normals, centers) - height + moves[:, 2]
    return np.column_stack([normals, offsets])
