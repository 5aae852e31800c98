"""Poses on a line or in a plane, which leave the room's walls ambiguous."""

import numpy as np

from inverse.rows.fitset import FitSet

__all__ = ["pose_alarms"]

THIN_M = 0.03  # rms off a line or plane: poses off by centimetres tell no side of it


def pose_alarms(rows: FitSet) -> list[str]:
    """Return alarms on what the arrangement of the poses leaves ambiguous.

    Paths between poses of one line stay as long when the room is turned about it;
    those of one plane when it is mirrored in it.
    """
    ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
    spread = np.linalg.svd(ends - ends.mean(axis=0), compute_uv=False)
    spread = np.pad(spread, (0, 3))[:3] / np.sqrt(len(ends))
    if spread[1] < THIN_M:
        return [
            "all poses stand on one line: the walls may be turned about it as a "
            "whole, and answers hold on that line only; record poses off the line"
        ]
    if spread[2] < THIN_M:
        return [
            "all poses stand in one plane: walls on either side of it may be mirrored "
            "(a floor for a ceiling); record poses at another height"
        ]
    return []
