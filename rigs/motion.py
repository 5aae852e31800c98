"""How long motions take."""

import numpy as np

from rir.pose import Pose


def travel_time(distance: float, speed: float, acceleration: float) -> float:
    """Return the seconds of a rest-to-rest move with limited speed and acceleration.

    Parameters
    ----------
    distance
        Length of the move, m (or degrees, with the other two to match).
    speed, acceleration
        Limits, m/s and m/s².

    Examples
    --------
    >>> travel_time(1.0, speed=0.5, acceleration=0.5)
    3.0
    >>> travel_time(0.02, speed=0.5, acceleration=0.5)
    0.4
    """
    distance = abs(distance)
    if distance < speed**2 / acceleration:
        return 2.0 * float(np.sqrt(distance / acceleration))
    return distance / speed + speed / acceleration


def turn_angle(start: Pose, end: Pose) -> float:
    """Return the angle in degrees between two orientations.

    Examples
    --------
    >>> turn = turn_angle(Pose.at(0, 0, 0, yaw_deg=-10), Pose.at(0, 0, 0, yaw_deg=80))
    >>> round(turn, 6)
    90.0
    """
    overlap = abs(float(np.dot(start.orientation, end.orientation)))
    return float(np.degrees(2.0 * np.arccos(min(1.0, overlap))))
