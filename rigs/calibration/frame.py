"""The machine's own frame and the room's: calibration by touching surveyed points."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rir.errors import ConfigError
from rir.pose import rotate

MM = 1e-3  # machines count millimetres, rooms metres


@dataclass(frozen=True, eq=False)
class Frame:
    """Turn machine millimetres into room metres and back.

    Examples
    --------
    >>> frame = Frame.at([1.0, 2.0, 0.5], yaw_deg=90)
    >>> frame.to_room(np.array([100.0, 0.0, 0.0])).round(6).tolist()
    [1.0, 2.1, 0.5]
    """

    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Where the machine's zero lies in the room, m."""
    orientation: np.ndarray = field(default_factory=lambda: np.array([0.0, 0, 0, 1]))
    """Unit quaternion, scalar last, turning machine axes into room axes."""

    @cached_property
    def _turn(self) -> np.ndarray:
        """Rows are the machine's axes in the room, shape (3, 3)."""
        return rotate(self.orientation, np.eye(3))

    @staticmethod
    def at(origin: ArrayLike, yaw_deg: float = 0.0) -> "Frame":
        """Return a frame from its origin in m and its turn about z in degrees."""
        half = np.radians(yaw_deg) / 2
        return Frame(
            np.asarray(origin, dtype=float),
            np.array([0.0, 0.0, np.sin(half), np.cos(half)]),
        )

    @property
    def yaw_deg(self) -> float:
        """Heading of the machine's x axis in the room, degrees."""
        x, y, _ = rotate(self.orientation, [1.0, 0.0, 0.0])
        return float(np.degrees(np.arctan2(y, x)))

    def to_room(self, machine: np.ndarray) -> np.ndarray:
        """Return room metres of machine millimetres, shape (..., 3)."""
        return self.origin + np.asarray(machine) @ self._turn * MM

    def to_machine(self, room: np.ndarray) -> np.ndarray:
        """Return machine millimetres of room metres, shape (..., 3)."""
        return (np.asarray(room) - self.origin) @ self._turn.T / MM


@dataclass(frozen=True, eq=False)
class FrameFit:
    """A frame found from touched points, and how well it fits."""

    frame: Frame
    residuals: np.ndarray
    """Distance of each point to its surveyed place, shape (N,), m."""

    @property
    def rms(self) -> float:
        """Root mean square residual, m."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def fit_frame(machine: ArrayLike, room: ArrayLike) -> FrameFit:
    """Find the frame that brings touched points onto their surveyed places.

    Parameters
    ----------
    machine
        Positions the rig reported at the points, shape (N, 3), mm; N >= 3, not in a
        line.
    room
        Surveyed positions of the same points, shape (N, 3), m.

    Raises
    ------
    ConfigError
        If the points are too few or lie in a line.

    References
    ----------
    W. Kabsch, "A solution for the best rotation to relate two sets of vectors",
    Acta Cryst. A32, 922 (1976).

    Examples
    --------
    >>> touched = [[0, 0, 0], [500, 0, 0], [0, 300, 0]]
    >>> fit = fit_frame(touched, [[1, 1, 1], [1, 1.5, 1], [0.7, 1, 1]])
    >>> round(fit.frame.yaw_deg, 6), bool(fit.rms < 1e-12)
    (90.0, True)
    """
    a = np.asarray(machine, dtype=float) * MM
    b = np.asarray(room, dtype=float)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 3 or len(a) < 3:
        raise ConfigError(
            f"a frame needs at least 3 points, as (N, 3) twice; got {a.shape} touched "
            f"and {b.shape} surveyed"
        )
    centre_a, centre_b = a.mean(axis=0), b.mean(axis=0)
    spread = np.linalg.svd(a - centre_a, compute_uv=False)
    if spread[1] < 1e-3 * max(spread[0], 1e-12):
        raise ConfigError("the touched points lie in a line; add one beside it")
    u, _, vt = np.linalg.svd((a - centre_a).T @ (b - centre_b))
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(vt.T @ u.T)))])
    turn = vt.T @ flip @ u.T
    frame = Frame(centre_b - turn @ centre_a, _quaternion(turn))
    gaps = np.linalg.norm(frame.to_room(a / MM) - b, axis=-1)
    return FrameFit(frame, gaps)


def _quaternion(turn: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(turn).as_quat()
