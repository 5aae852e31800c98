"""Rooms that hear one another through a door: heard one by one, then joined."""

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedral import FittedMesh, fit_polyhedron
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.shoebox import FittedRoom
from inverse.rows.direct import DirectSound, read_direct
from inverse.rows.fitset import FitSet
from inverse.rows.onsets import read_onsets
from inverse.rows.regions import Regions
from inverse.rows.sight import Sight, read_sight
from inverse.rows.unexplained import unexplained_energy
from inverse.walls.doorway import PairsAcross, find_doorway
from inverse.walls.inner_walls import BETTER, EXPLAINING, JUDGED_ROWS
from inverse.walls.opening import Opening
from inverse.walls.room_boxes import LEAST_ROWS, find_boxes
from inverse.walls.slabs import joined_shape
from rir import GainPattern
from rir.arrays import FloatArray

__all__ = ["JoinedRooms", "find_joined", "join_rooms"]

WORTH_JOINING = 0.05  # what one room leaves; a door hides more than that
LEAST_CLEARNESS = 4.0  # of direct sounds; fainter ones do not tell who sees whom
EDGES = ("one side", "the other side", "lower edge", "upper edge")


@dataclass(frozen=True, eq=False)
class JoinedRooms:
    """Hold rooms put together, and their alarms."""

    shape: Polyhedron | None
    """The rooms with the holes between them; None where they were not all found."""
    boxes: list[OrientedBox] = field(default_factory=list)
    """The rooms."""
    openings: list[Opening] = field(default_factory=list)
    """Holes between them."""
    alarms: list[str] = field(default_factory=list)
    """What was not found."""


def join_rooms(
    rows: FitSet,
    fitted: FittedRoom | FittedMesh | None,
    alarms: list[str],
    reach_s: float,
    listening: GainPattern | None = None,
) -> tuple[FittedRoom | FittedMesh | None, list[str]]:
    """Return several rooms where they explain the rows better than what stands.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    fitted : FittedRoom, FittedMesh or None
        What was found as one room.
    alarms : list of str
        Its alarms.
    reach_s : float
        Longest path, seconds.
    listening : GainPattern, optional
        Known pattern of the listener.

    Returns
    -------
    FittedRoom, FittedMesh or None
        Several rooms, or `fitted` as it was.
    list of str
        Alarms of what is returned.
    """
    if rows.n_places < 2 or len(rows) < 2 * LEAST_ROWS:
        return fitted, alarms
    direct = read_direct(rows)
    if direct.clearness < LEAST_CLEARNESS:
        return fitted, alarms
    sight = read_sight(rows, direct)
    regions = sight.regions(rows)
    few = rows.spread(JUDGED_ROWS)
    if regions.count < 2:
        return fitted, alarms
    before = 1.0 if fitted is None else unexplained_energy(few, fitted)
    if before < WORTH_JOINING:
        return fitted, alarms
    joined = find_joined(rows, direct, sight, regions)
    if joined.shape is None:
        return fitted, alarms + joined.alarms
    reach_m = reach_s * rows.speed_of_sound
    try:
        found = fit_polyhedron(rows, direct, joined.shape, reach_m, listening)
    except np.linalg.LinAlgError:
        return fitted, alarms
    after = unexplained_energy(few, found)
    if after > BETTER * before and before - after < EXPLAINING * (1 - before):
        return fitted, alarms
    return found, joined.alarms


def find_joined(
    rows: FitSet, direct: DirectSound, sight: Sight, regions: Regions
) -> JoinedRooms:
    """Put rooms together from who hears whom.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    direct : DirectSound
        What their direct sounds have in common.
    sight : Sight
        Who sees whom.
    regions : Regions
        Two rooms or more.
    """
    ends = rows.emitters.positions, rows.listeners.positions
    numbers = np.stack([regions.numbers(one) for one in ends])
    own = [
        rows.rows(np.flatnonzero((numbers[0] == k) & (numbers[1] == k)))
        for k in range(regions.count)
    ]
    boxes = find_boxes(own, direct)
    arrivals = _arrivals(rows, direct, sight)
    openings: list[Opening] = []
    alarms: list[str] = []
    for first, second in combinations(range(regions.count), 2):
        one, other = boxes[first], boxes[second]
        if one is None or other is None:
            continue
        rooms = numbers == np.array([[first], [second]])
        turned = numbers == np.array([[second], [first]])
        pairs = PairsAcross.of(ends, rooms.all(axis=0), turned.all(axis=0), arrivals)
        found = find_doorway(one, other, pairs)
        if found is not None:
            boxes[first], boxes[second], opening, known = found
            openings.append(opening)
            alarms += _opening_alarms(opening, known)
    whole = [box for box in boxes if box is not None and box.found.all()]
    if len(whole) < len(boxes):
        alarms = [_unseen(ends[1][numbers[1] == k]) for k in _poor(boxes)]
        return JoinedRooms(None, whole, openings, alarms)
    if len(openings) < len(boxes) - 1:
        return JoinedRooms(None, whole, openings, [SHUT])
    return JoinedRooms(joined_shape(whole, openings), whole, openings, alarms)


SHUT = (
    "rooms hear one another, but the opening between them was not heard; no wall is "
    "put between them"
)


def _arrivals(rows: FitSet, direct: DirectSound, sight: Sight) -> FloatArray:
    """Return the shortest way of each row, metres, NaN where it is in doubt."""
    onsets = read_onsets(rows, direct).lengths
    onsets = np.where(sight.bits == 1, rows.distances, onsets)
    return np.where(np.isnan(sight.bits), np.nan, onsets)


def _poor(boxes: list[OrientedBox | None]) -> list[int]:
    return [k for k, box in enumerate(boxes) if box is None or not box.found.all()]


def _unseen(places: FloatArray) -> str:
    middle = ", ".join(f"{value:.1f}" for value in places.mean(axis=0))
    return (
        f"a room round ({middle}) m hears the rest through an opening, but not all of "
        "its own walls were heard: record more pairs within it"
    )


def _opening_alarms(opening: Opening, known: bool) -> list[str]:
    """Say which edges of a hole stand where they do for want of sound."""
    missing = [EDGES[k] for k in (0, 1, 3) if not opening.known[k]]
    thick = f"{100 * opening.slab.thick:.0f} cm"
    thin = [] if known else [f"the wall between two rooms is {thick} thick or about so"]
    if not missing:
        return thin
    return [
        *thin,
        f"of an opening between two rooms the {' and the '.join(missing)} was not "
        "heard: it is drawn open as far as the rooms go",
    ]
