"""Paths of a clean box, followed to the end of long rows.

Walls are read from the first tenth of a second. Where the paths tell that almost
wholly, they tell what comes later as well: no late field is nearer than they are.
"""

from dataclasses import replace

import numpy as np

from inverse.paths.polyhedral import FittedMesh
from inverse.paths.shoebox import FittedRoom, with_right_order
from inverse.rows.fitset import FitSet
from inverse.rows.unexplained import CLEAN, unexplained_energy

__all__ = ["reach_row_ends"]

FEW_ROWS = 20  # enough to tell 10 % of energy; long rows are dear
MOST_IMAGES = 40_000  # in the reach followed, on average
BEYOND = 1.02  # of the rows' length: the last arrivals' pulses begin before the end
BETTER = 0.9  # a tenth less unexplained, else rows end in noise or late sound


def reach_row_ends(
    rows: FitSet, fitted: FittedRoom | FittedMesh
) -> FittedRoom | FittedMesh:
    """Return a box whose paths reach to the end of the rows, where that is right.

    Parameters
    ----------
    rows : FitSet
        Measured rows at their whole length.
    fitted : FittedRoom or FittedMesh
        What was fitted to their beginnings; returned as it is where its paths
        leave more than 0.3 % there, or reach far enough.
    """
    if isinstance(fitted, FittedMesh):
        return fitted
    room, few = fitted.room, rows.spread(FEW_ROWS)
    end = BEYOND * rows.n_samples / room.scale - room.latency_s * room.speed_of_sound
    known = round(
        (room.reach_m / room.speed_of_sound + room.latency_s) * few.sample_rate
    )
    if room.reach_m >= end or unexplained_energy(few.cut(known), fitted) > CLEAN:
        return fitted
    size = np.minimum(room.box.high - room.box.low, end)
    most = (3 * MOST_IMAGES * float(np.prod(size)) / (4 * np.pi)) ** (1 / 3)
    longer = replace(room, reach_m=min(end, most), order=400)
    onward = replace(fitted, room=with_right_order(few, longer))
    better = unexplained_energy(few, onward) < BETTER * unexplained_energy(few, fitted)
    return onward if better else fitted
