"""A rig made of motion controllers: poses in the room become positions of axes."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise, product
from typing import Any

import numpy as np

from rigs.calibration.mount import AXES, FIXED_TOLERANCE, Mount
from rigs.controller import Controller
from rigs.faults import LineError
from rigs.planning.envelope import Envelope
from rigs.rig import Surroundings
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

RECONNECT_WAITS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
"""Doubled, s: a plug that slipped is back at once, and a minute restarts any board."""


class MachineRig:
    """Carry a device by one or several controllers.

    Parameters
    ----------
    name
        For messages and records.
    kind
        Its name in the table of rigs.
    controllers
        Each moves its own axes; they move one after another.
    envelope
        Reach and keep-outs in the room.
    mount
        Frame, fixed axes, orientation.
    around
        Clock, callbacks and consent.
    truth
        For simulated machines: returns the true machine position of every axis.
    """

    def __init__(
        self,
        name: str,
        kind: str,
        controllers: Sequence[Controller],
        envelope: Envelope,
        mount: Mount,
        around: Surroundings,
        truth: Callable[[], dict[str, float]] | None = None,
    ) -> None:
        self.name = name
        self.kind = kind
        self.controllers = tuple(controllers)
        self._envelope = envelope
        self.mount = mount
        self.around = around
        self.simulated = any(c.simulated for c in self.controllers)
        self._truth = truth
        self._connected = False
        self._orientation: np.ndarray | None = None
        self._way: list[np.ndarray] | None = None
        self.moves = 0

    @property
    def envelope(self) -> Envelope:
        """Reach and keep-outs; within the machine's travel once that is known."""
        return self._envelope

    def _cut_to_travel(self) -> None:
        """Take the travel the controllers report into the reach."""
        ends = []
        for side in (0, 1):
            axes = {axis: self.mount.fixed.get(axis, 0.0) for axis in AXES}
            for controller in self.controllers:
                values = (float(value) for value in controller.limits()[side])
                axes |= dict(zip(controller.axes, values, strict=True))
            ends.append([axes[a] for a in "xyz"])
        corners = np.array(list(product(*zip(*ends, strict=True))))
        room = self.mount.frame.to_room(corners).round(9)
        self._envelope = self._envelope.within(room.min(axis=0), room.max(axis=0))

    # -- poses and axes -------------------------------------------------------------

    def axes_of(self, pose: Pose) -> dict[str, float]:
        """Return the position of every axis for a pose, mm and degrees."""
        x, y, z = self.mount.frame.to_machine(pose.position)
        yaw = (pose.yaw_deg - self.mount.frame.yaw_deg + 180.0) % 360.0 - 180.0
        return {"x": float(x), "y": float(y), "z": float(z), "yaw": float(yaw)}

    def pose_of(self, axes: dict[str, float]) -> Pose:
        """Return the pose for positions of the axes."""
        point = self.mount.frame.to_room(np.array([axes[a] for a in "xyz"]))
        if self.mount.free_orientation and self._orientation is not None:
            return Pose(point, self._orientation)
        turned = Pose.at(*point, yaw_deg=axes["yaw"] + self.mount.frame.yaw_deg)
        return Pose(point, turned.orientation)

    def _moved(self) -> set[str]:
        return {axis for c in self.controllers for axis in c.axes}

    def check(self, pose: Pose) -> None:
        """Raise `OutOfReachError` if the pose cannot be reached; move nothing."""
        self.envelope.check(pose, self.name)
        axes = self.axes_of(pose)
        for axis in AXES:
            if axis not in self._moved():
                self._check_fixed(axis, axes[axis])
        if abs(float(pose.forward[2])) > 0.02 and not self.mount.free_orientation:
            raise OutOfReachError(
                f"{self.name} cannot pitch; the pose looks up or down; ask for level"
            )
        if self._connected:
            self._check_travel(axes)

    def _check_fixed(self, axis: str, asked: float) -> None:
        if axis == "yaw" and self.mount.free_orientation:
            return
        fixed = self.mount.fixed.get(axis, 0.0)
        off = abs(asked - fixed)
        if axis == "yaw":
            off = abs((asked - fixed + 180.0) % 360.0 - 180.0)
        unit = "°" if axis == "yaw" else "mm"
        if off > FIXED_TOLERANCE[axis]:
            raise OutOfReachError(
                f"{self.name} cannot move {axis}: the pose needs {asked:.1f} {unit}, "
                f"it is fixed at {fixed:.1f} {unit}; ask for poses with that, or add "
                "an axis"
            )

    def _check_travel(self, axes: dict[str, float]) -> None:
        for controller in self.controllers:
            low, high = controller.limits()
            for k, axis in enumerate(controller.axes):
                if not low[k] - 1e-6 <= axes[axis] <= high[k] + 1e-6:
                    raise OutOfReachError(
                        f"{self.name}: {axis} at {axes[axis]:.1f} is outside the "
                        f"travel of {low[k]:.1f} to {high[k]:.1f}; choose a pose inside"
                    )

    # -- moving -----------------------------------------------------------------------

    def connect(self) -> None:
        """Open all lines and read the controllers."""
        for controller in self.controllers:
            controller.connect()
        self._connected = True
        self._cut_to_travel()

    def move(self, pose: Pose, via: Sequence[Pose] = ()) -> Pose:
        """Go to a pose past way-points; return the pose reached.

        Raises
        ------
        OutOfReachError
            Before anything moves, if a point or the straight way to it is not allowed.
        RigError
            If it did not arrive; everything has been stopped.
        """
        for point in (*via, pose):
            self.check(point)
        start = self._require_known()
        corners = self._corners([start, *map(self.axes_of, (*via, pose))])
        points = [self.pose_of(axes).position for axes in corners]
        self.envelope.check_path(np.array(points), self.name)
        self._way = points if len(points) > 1 else points * 2
        try:
            self._follow(corners)
        finally:
            self._report()
        self._orientation = np.asarray(pose.orientation)
        self.moves += 1
        self._report()
        return self._believed()

    def _corners(self, path: list[dict[str, float]]) -> list[dict[str, float]]:
        """Return the way with a corner wherever another controller takes over."""
        corners = [path[0]]
        for axes in path[1:]:
            for controller in self.controllers:
                corner = dict(corners[-1])
                corner |= {axis: axes[axis] for axis in controller.axes}
                if corner != corners[-1]:
                    corners.append(corner)
        return corners if len(corners) > 1 else [path[0], path[0]]

    def _follow(self, corners: list[dict[str, float]]) -> None:
        """Send each controller its stretches of the way, as long as possible."""
        done = 0
        while done < len(corners) - 1:
            controller = self._mover(corners[done], corners[done + 1])
            end = done + 1
            while end < len(corners) - 1 and controller is self._mover(
                corners[end], corners[end + 1]
            ):
                end += 1
            stretch = corners[done + 1 : end + 1]
            controller.move(
                [np.array([axes[a] for a in controller.axes]) for axes in stretch]
            )
            done = end

    def _mover(self, before: dict[str, float], after: dict[str, float]) -> Controller:
        for controller in self.controllers:
            if any(before[a] != after[a] for a in controller.axes):
                return controller
        return self.controllers[0]

    def _require_known(self) -> dict[str, float]:
        here = self._axes_now()
        if here is None:
            raise RigError(
                f"where {self.name} is is not known: {self.trouble()}; home it first"
            )
        return here

    def _axes_now(self) -> dict[str, float] | None:
        here = {axis: self.mount.fixed.get(axis, 0.0) for axis in AXES}
        for controller in self.controllers:
            position = controller.position() if self._connected else None
            if position is None:
                return None
            values = (float(value) for value in position)
            here |= dict(zip(controller.axes, values, strict=True))
        return here

    def _believed(self) -> Pose:
        return self.pose_of(self._require_known())

    def _report(self) -> None:
        if self._truth is not None and self.around.on_pose is not None:
            fixed = {axis: self.mount.fixed.get(axis, 0.0) for axis in AXES}
            self.around.on_pose(self.pose_of(fixed | self._truth()))

    def trouble(self) -> str:
        """Return why the position is not known, nothing if it is."""
        if not self._connected:
            return "it is not connected"
        return "; ".join(c.why for c in self.controllers if c.why)

    # -- the rest of a rig ------------------------------------------------------------

    def home(self) -> None:
        """Connect, again if the line was lost, and find the reference."""
        if not self._connected:
            self._reconnect()
        try:
            self._home_all()
        except LineError:
            self._reconnect()
            self._home_all()
        here = self.where()
        self._way = None if here is None else [here.position, here.position]
        self._report()

    def _home_all(self) -> None:
        for controller in self.controllers:
            controller.home()

    def _reconnect(self) -> None:
        for wait in RECONNECT_WAITS:
            try:
                self.connect()
                return
            except LineError as error:
                self.around.tell(f"{self.name}: {error}; trying again in {wait:g} s")
                self.around.clock.sleep(wait)
        self.connect()

    def whereabouts(self) -> np.ndarray:
        """Return the straight pieces of its last way: it must be on one of them."""
        pieces = [] if self._way is None else list(pairwise(self._way))
        return np.array(pieces).reshape(-1, 2, 3)

    def _corner(self) -> np.ndarray:
        """Return the place of the homed machine, m."""
        ends = {axis: self.mount.fixed.get(axis, 0.0) for axis in AXES}
        for controller in self.controllers:
            homed = (float(value) for value in controller.home_position())
            ends |= dict(zip(controller.axes, homed, strict=True))
        return self.mount.frame.to_room(np.array([ends[a] for a in "xyz"]))

    def homing_sweep(self) -> np.ndarray:
        """Return boxes that hold any way homing may take.

        Homing moves the axes in an order that depends on the board, so the box between
        the place and the homed corner counts. A machine never moved since it was
        connected may be anywhere, and no boxes are returned.
        """
        if not self._connected:
            return np.zeros((0, 2, 3))
        corner, places = self._corner(), self.whereabouts()
        low = np.minimum(places.min(axis=1), corner)
        high = np.maximum(places.max(axis=1), corner)
        return np.stack([low, high], axis=1)

    def reference_place(self) -> np.ndarray | None:
        """Return the place of the homed machine, m, while it is connected."""
        return self._corner() if self._connected else None

    def confirm(self) -> float:
        """Compare with the reference switches; return the largest drift in m.

        NaN where no controller has the means. The way there is straight: start near
        the reference place, as `Carriers.confirm` does.

        Raises
        ------
        RigError
            If steps were lost; the position is unknown then.
        """
        start = self.pose_of(self._require_known()).position
        self._way = [start, self._corner()]
        drifts = [controller.confirm() for controller in self.controllers]
        self._report()
        every = np.abs(np.concatenate(drifts)) * 1e-3
        return float(np.nanmax(every)) if np.isfinite(every).any() else float("nan")

    def where(self) -> Pose | None:
        """Ask the machine where it is; None while that is not known."""
        here = self._axes_now()
        return None if here is None else self.pose_of(here)

    @contextmanager
    def quiet(self) -> Iterator[None]:
        """Switch off what makes noise; nothing is asked or moved inside.

        Raises
        ------
        RigError
            Before, if the position is not known; after, if it moved or restarted.
        """
        for controller in self.controllers:
            controller.quieten()
        try:
            yield
        finally:
            for controller in self.controllers:
                controller.unquieten()

    def duration(self, start: Pose, end: Pose) -> float:
        """Estimate the seconds of a move."""
        a, b = self.axes_of(start), self.axes_of(end)
        if not self._connected:
            return float("nan")
        total = 0.0
        for controller in self.controllers:
            ends = [np.array([axes[n] for n in controller.axes]) for axes in (a, b)]
            total += controller.seconds(*ends)
        return total

    def stop(self) -> None:
        """Stop every controller, whatever one of them answers."""
        problems = []
        for controller in self.controllers:
            try:
                controller.stop()
            except RigError as error:
                problems.append(str(error))
        if problems:
            self.around.tell(f"{self.name}: {'; '.join(problems)}")

    def close(self) -> None:
        """Close all lines."""
        for controller in self.controllers:
            controller.close()
        self._connected = False

    def describe(self) -> dict[str, Any]:
        """Return what a data set should remember."""
        return {
            "name": self.name,
            "kind": self.kind,
            "simulated": self.simulated,
            "frame": {
                "origin_m": self.mount.frame.origin.tolist(),
                "orientation": self.mount.frame.orientation.tolist(),
            },
            "moves": self.moves,
            "controllers": [c.describe() for c in self.controllers],
        }
