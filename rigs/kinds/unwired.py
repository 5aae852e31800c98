"""What every rig without a line and without switches answers."""

import numpy as np

from rir import Pose

__all__ = ["UnwiredRig"]


class UnwiredRig:
    """Answers of a rig that has nothing to connect, home or compare with."""

    _pose: Pose | None

    def connect(self) -> None:
        """Do nothing: there is no line."""

    def home(self) -> None:
        """Do nothing: there is no reference switch to look for."""

    def homing_sweep(self) -> np.ndarray:
        """Return no boxes: homing moves nothing."""
        return np.zeros((0, 2, 3))

    def whereabouts(self) -> np.ndarray:
        """Return the place it is at, if there is one."""
        places = [] if self._pose is None else [[self._pose.position] * 2]
        return np.array(places).reshape(-1, 2, 3)

    def confirm(self) -> float:
        """Return NaN: there is nothing to compare with."""
        return float("nan")

    def reference_place(self) -> np.ndarray | None:
        """Return nothing: `confirm` moves nothing."""
        return None

    def trouble(self) -> str:
        """Return nothing: it can always move."""
        return ""
