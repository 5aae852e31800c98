"""Where a device is and which way it looks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.numbers import read_array, read_number

__all__ = ["Pose", "Poses", "from_spherical", "rotate"]

_IDENTITY = (0.0, 0.0, 0.0, 1.0)  # no turn; the scalar stands last


def from_spherical(
    azimuth_deg: ArrayLike, elevation_deg: ArrayLike, radius: ArrayLike = 1.0
) -> NDArray[np.float64]:
    """Return places given by azimuth and elevation [°] and distance, shape (..., 3)."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    level = radius * np.cos(elevation)
    height = radius * np.sin(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), height], axis=-1)


def rotate(quaternions: ArrayLike, vectors: ArrayLike) -> FloatArray:
    """Rotate vectors by unit quaternions.

    Parameters
    ----------
    quaternions : array_like, shape (..., 4)
        Unit quaternions, scalar last.
    vectors : array_like, shape (..., 3)
        Vectors; leading axes broadcast against those of `quaternions`.

    Examples
    --------
    >>> half = 0.5**0.5
    >>> rotate([0, 0, half, half], [0, 0, 1]).round(12).tolist()
    [0.0, 0.0, 1.0]
    """
    q = np.asarray(quaternions, dtype=float)
    v = np.asarray(vectors, dtype=float)
    axis, scalar = q[..., :3], q[..., 3:]
    turned = 2.0 * np.cross(axis, v)
    return v + scalar * turned + np.cross(axis, turned)


def _turned(yaw_deg: float, pitch_deg: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a pitch (front up) followed by a yaw (about z)."""
    yaw, pitch = np.radians([yaw_deg / 2, -pitch_deg / 2])
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return (float(-sy * sp), float(cy * sp), float(sy * cp), float(cy * cp))


def _checked(values: ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    array = read_array(values, what, f"give numbers of shape {shape}")
    if array.shape != shape:
        raise SignalError(f"{what} needs shape {shape}, not {array.shape}")
    wrong = ~np.isfinite(array)
    if wrong.any():
        row = array[np.argmax(wrong.reshape(len(array), -1).any(axis=1))]
        count = f"; {wrong.sum()} numbers are not" if wrong.sum() > 1 else ""
        raise SignalError(f"{what} must be finite, not {row.tolist()}{count}")
    array.setflags(write=False)
    return array


def _unit(quaternion: FloatArray) -> FloatArray:
    norm = np.linalg.norm(quaternion, axis=-1, keepdims=True)
    if np.any(np.abs(norm - 1) > 1e-3):
        raise SignalError(
            f"orientation must be a unit quaternion; its norm is {norm.ravel()[0]:.4f}"
        )
    return quaternion / norm


def _rows(values: ArrayLike, width: int, what: str) -> FloatArray:
    """Return numbers as rows of a width; a single row may be flat."""
    array = read_array(values, what, f"give rows of {width} numbers")
    if array.size and (array.ndim not in (1, 2) or array.shape[-1] != width):
        raise SignalError(f"{what} need shape (N, {width}), not {array.shape}")
    return array.reshape(-1, width)


@dataclass(frozen=True, eq=False)
class Pose:
    """A position and an orientation in the room frame (right-handed, z up).

    Parameters
    ----------
    position : array_like, shape (3,)
        Acoustic centre [m].
    orientation : array_like, shape (4,)
        Unit quaternion, scalar last, turning device axes into room axes. A
        device looks along its own x, its z is up.

    Examples
    --------
    >>> Pose.at(1, 2, 1.2, yaw_deg=60).forward.round(4).tolist()
    [0.5, 0.866, 0.0]
    """

    position: FloatArray
    orientation: FloatArray = field(default_factory=lambda: np.array(_IDENTITY))

    def __post_init__(self) -> None:
        position = _checked(self.position, (3,), "position")
        orientation = _unit(_checked(self.orientation, (4,), "orientation"))
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "orientation", orientation)

    @staticmethod
    def at(
        x: float, y: float, z: float, yaw_deg: float = 0.0, pitch_deg: float = 0.0
    ) -> "Pose":
        """Return a pose from coordinates [m] and yaw and pitch [°]."""
        position = [read_number(v, "a coordinate [m]") for v in (x, y, z)]
        yaw, pitch = (read_number(v, "an angle [°]") for v in (yaw_deg, pitch_deg))
        return Pose(np.array(position), np.array(_turned(yaw, pitch)))

    @staticmethod
    def facing(position: ArrayLike, target: ArrayLike) -> "Pose":
        """Return a pose at `position` whose front looks at `target`.

        A target straight above or below keeps the yaw at zero.
        """
        ends = _checked(position, (3,), "position"), _checked(target, (3,), "target")
        x, y, z = ends[1] - ends[0]
        level = float(np.hypot(x, y))
        yaw = np.degrees(np.arctan2(y, x)) if level > 0 else 0.0
        pitch = np.degrees(np.arctan2(z, level))
        return Pose(ends[0], np.array(_turned(float(yaw), float(pitch))))

    @property
    def forward(self) -> FloatArray:
        """Unit vector the device looks along, in the room frame, shape (3,)."""
        return rotate(self.orientation, [1.0, 0.0, 0.0])

    @property
    def yaw_deg(self) -> float:
        """Heading of the front in the horizontal plane [°]."""
        x, y, _ = self.forward
        return float(np.degrees(np.arctan2(y, x)))

    def to_local(self, directions: ArrayLike) -> FloatArray:
        """Turn room-frame directions, shape (..., 3), into the device frame."""
        return rotate(self.orientation * [-1, -1, -1, 1], directions)

    def distance(self, other: "Pose") -> float:
        """Return the distance between two poses' positions [m]."""
        return float(np.linalg.norm(self.position - other.position))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Pose):
            return NotImplemented
        same = np.array_equal(self.position, other.position)
        return same and np.array_equal(self.orientation, other.orientation)

    def __hash__(self) -> int:
        return hash((self.position.tobytes(), self.orientation.tobytes()))

    def __str__(self) -> str:
        x, y, z = self.position
        return f"({x:.3f}, {y:.3f}, {z:.3f}) m, yaw {self.yaw_deg:.0f}°"


@dataclass(frozen=True, eq=False)
class Poses:
    """Many poses as two arrays.

    Parameters
    ----------
    positions : array_like, shape (N, 3)
        Positions [m].
    orientations : array_like, shape (N, 4), optional
        Unit quaternions, scalar last; looking along x when left out.
    """

    positions: FloatArray
    orientations: FloatArray = field(default_factory=lambda: np.empty((0, 4)))

    def __post_init__(self) -> None:
        positions = _rows(self.positions, 3, "positions")
        orientations = _rows(self.orientations, 4, "orientations")
        if not len(orientations):
            orientations = np.tile(np.array(_IDENTITY), (len(positions), 1))
        if len(positions):
            _checked(positions, (len(positions), 3), f"{len(positions)} positions")
            _checked(orientations, (len(positions), 4), "orientations")
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "orientations", _unit(orientations))

    @staticmethod
    def of(things: Any) -> "Poses":
        """Return poses from a Pose, a sequence of them, an array, or Poses.

        Arrays have shape (3,), (N, 3), or (N, 7): position, then quaternion.

        Raises
        ------
        SignalError
            If they are no finite numbers of such a shape.
        """
        if isinstance(things, Poses):
            return things
        if isinstance(things, Pose):
            things = [things]
        if isinstance(things, Sequence) and things and isinstance(things[0], Pose):
            if not all(isinstance(pose, Pose) for pose in things):
                raise SignalError(
                    "poses and numbers cannot be mixed; give one or the other"
                )
            positions = np.array([pose.position for pose in things])
            return Poses(positions, np.array([pose.orientation for pose in things]))
        hint = "give Pose, Poses or numbers of shape (N, 3) or (N, 7)"
        array = read_array(things, "poses", hint)
        array = array.reshape(1, -1) if array.ndim == 1 and array.size else array
        if array.size == 0:
            return Poses(np.empty((0, 3)))
        if array.ndim != 2 or array.shape[1] not in (3, 7):
            raise SignalError(
                f"poses need shape (3,), (N, 3) or (N, 7), not {array.shape}"
            )
        return Poses(array[:, :3], array[:, 3:])

    @property
    def forward(self) -> FloatArray:
        """Unit vectors the devices look along, shape (N, 3)."""
        return rotate(self.orientations, np.array([1.0, 0.0, 0.0]))

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[Pose]:
        return (self[i] for i in range(len(self)))

    @overload
    def __getitem__(self, index: int | np.integer) -> Pose: ...
    @overload
    def __getitem__(self, index: slice | NDArray[Any] | list[int]) -> "Poses": ...
    def __getitem__(self, index: Any) -> "Pose | Poses":
        if isinstance(index, int | np.integer):
            return Pose(self.positions[index], self.orientations[index])
        return Poses(self.positions[index], self.orientations[index])
