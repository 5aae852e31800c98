"""From measured responses to a room, stage by stage."""

from collections.abc import Callable
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from inverse.acoustics import Acoustics
from inverse.banded_fit import in_half_octaves
from inverse.bands.fitted_bands import FittedBandedRoom
from inverse.blend.blend import Blend
from inverse.blend.fallback import NearestRows
from inverse.guard import guarded
from inverse.paths.air import at_one_temperature, logged_temperature
from inverse.paths.long_rows import reach_row_ends
from inverse.paths.open_air import fit_open_air
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedral import WIDE_M, FittedMesh, fit_drawn, mesh_alarms
from inverse.paths.recording import (
    RecordedRoom,
    find_listener,
    fit_air,
    move_places,
)
from inverse.paths.room import MOST_IMAGES
from inverse.paths.shoebox import FittedRoom, fit_shoebox
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet
from inverse.rows.outlier_rows import outlier_rows
from inverse.rows.pose_spread import pose_alarms
from inverse.rows.suspect_rows import suspect_alarms, suspect_rows
from inverse.rows.unexplained import BELIEVED, EXACT, POOR
from inverse.rows.units import checked_units
from inverse.search import NOTHING_KNOWN, USUAL_SETTINGS, PriorKnowledge, SearchSettings
from inverse.walls.box_search import search_box
from inverse.walls.convex import try_convex
from inverse.walls.inner_walls import find_inner_walls
from inverse.walls.joining import join_rooms
from inverse.walls.small_rooms import scan_room
from rir import GainPattern

__all__ = ["find_room", "room_in_rows", "without_outliers"]

LEAST_ROWS, LEAST_SAMPLES = 8, 64
"""Fewer rows leave six walls, a pattern and a pulse open; 64 samples hold one echo."""
LEAST_CLEARNESS = 4.0
"""Mean direct sound over what noise would leave: noise comes to 1, its peak to 2."""
LEAST_WALLS = 2  # of a box: with one wall its axes are not known
LONE = 0.02
"""One emitter place and more unexplained: a wall may be the echo of two others."""
CUT, AHEAD = 1.25, 1.1
"""Rows are fitted a quarter beyond the reach, where late sound fades in, and paths
listed a tenth beyond it, for those that a moving wall brings in."""
COMPLETED_ROWS, LEAST_COMPLETED, COMPLETED_SAMPLES = 300, 120, 1_000_000
"""Rows that late sound is learnt from: fewer of long ones, for time (decision 0066)."""
WALL_NAMES = ("low x", "high x", "low y", "high y", "low z", "high z")
APART_M = 0.02  # nearer ends are one place: their direct sound is not one of a point
TOLD = 0.05
"""Part of the low sound a box may leave that is believed without direct sounds."""
CLEAR, UNKNOWN = 0.005, 0.5
"""Part of the energy a room leaves that is understood so far, but not well."""
BETTER = 0.6  # without outliers a room must leave this part of what it left with them
NO_DIRECT = (
    "no direct sound stands where the poses say; check poses, their units and the "
    "latency: no walls are looked for"
)
NO_PLANE = "no walls were found: nothing reflects as a plane would"


def find_room(
    rows: FitSet,
    settings: SearchSettings = USUAL_SETTINGS,
    prior: PriorKnowledge = NOTHING_KNOWN,
) -> Acoustics:
    """Find the room that rows were measured in, or the best answer without one.

    Units are checked first; rows that do not belong to the room are left out; and
    where the nearest measured response proves a better answer, that is given.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    settings : SearchSettings
        How the room is looked for.
    prior : PriorKnowledge
        What is known of it.
    """
    rows, doubts = checked_units(rows)
    if doubts:
        words = [*doubts, "the nearest response is answered"]
        return Acoustics(None, NearestRows.of(rows), None, 1.0, words)
    find = partial(room_in_rows, settings=settings, prior=prior)
    found = without_outliers(rows, find)
    return guarded(found, rows) if settings.late else found


def without_outliers(rows: FitSet, find: Callable[[FitSet], Acoustics]) -> Acoustics:
    """Return the room found in rows, in those that belong together if that is clearer.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    find : callable
        Finds a room in rows.
    """
    first = find(rows)
    if first.fitted is None or not CLEAR < first.unexplained < UNKNOWN:
        return first
    predicted = first.fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    outliers = outlier_rows(rows, predicted)
    if not outliers.any():
        return first
    again = find(rows.rows(np.flatnonzero(~outliers)))
    if again.fitted is None or again.unexplained > BETTER * first.unexplained:
        return first
    again.alarms.extend(suspect_alarms(rows, outliers))
    return again


# kernels multiply small matrices: BLAS threads cost more than they compute
@threadpool_limits.wrap(limits=1, user_api="blas")
def room_in_rows(
    rows: FitSet,
    settings: SearchSettings = USUAL_SETTINGS,
    prior: PriorKnowledge = NOTHING_KNOWN,
) -> Acoustics:
    """Find the room in the rows, fit it and complete it; see :func:`find_room`."""
    reach_s = settings.reach_s
    rows = at_one_temperature(rows)
    short = rows.cut(round(CUT * reach_s * rows.sample_rate))
    # sound of paths that are not listed must not be taken for the source's
    known = rows.cut(round(reach_s * rows.sample_rate))
    recorded, alarms = _fitted(known, settings, prior)
    rows, short, known = (recorded.even(one) for one in (rows, short, known))
    fitted = recorded.fitted
    if prior.shape is None:
        fitted, alarms = join_rooms(known, fitted, alarms, reach_s, prior.listening)
    if fitted is not None:
        recorded = recorded.onto(fitted)
        recorded = move_places(_sounding(known), recorded, settings.pose_sd_m)
        fitted = recorded.fitted
    if fitted is None:
        return _without_room(rows, alarms, settings, prior)
    sounding = _sounding(rows)
    fitted = reach_row_ends(sounding, fitted)
    judged = sounding.spread(_judged_rows(rows.n_samples))
    judged = recorded.placed(judged, fitted, settings.pose_sd_m)
    early = fitted.predict(judged.emitters, judged.listeners, rows.n_samples)
    suspect = suspect_rows(judged, early)
    alarms += suspect_alarms(judged, suspect)
    judged, early = judged.rows(np.flatnonzero(~suspect)), early[~suspect]
    loud = max(float((judged.responses**2).sum()), 1e-300)
    unexplained = float(((judged.responses - early) ** 2).sum()) / loud
    # where geometry says nothing it must not be believed
    if unexplained > 1.0 - 0.1 * (1 - POOR):
        alarms.append(
            f"the {fitted.n_walls} planes found explain nothing of "
            "the waveforms: none is believed"
        )
        return _without_room(rows, alarms, settings, prior)
    if isinstance(fitted, FittedRoom) and unexplained > EXACT:
        early_part = judged.cut(short.n_samples)
        banded = in_half_octaves(short, fitted, early_part, settings.pose_sd_m)
        if banded is not None:
            fitted = banded
            early = fitted.predict(judged.emitters, judged.listeners, rows.n_samples)
            unexplained = float(((judged.responses - early) ** 2).sum()) / loud
    alarms += _room_alarms(fitted, unexplained) + pose_alarms(rows)
    if rows.n_places == 1 and unexplained > LONE:
        alarms.append(
            "heard from one emitter place only, and "
            f"{100 * unexplained:.0f} % of the energy "
            "is unexplained: a wall found may be the echo of two others; record a "
            "second emitter place"
        )
    recording = logged_temperature(rows) | recorded.found
    blend = None
    # half octaves hold their own energies; what they leave is no late sound
    whole = isinstance(fitted, FittedBandedRoom) and rows.n_samples <= short.n_samples
    if settings.late and unexplained > (BELIEVED if whole else EXACT):
        known_of = {"aimed": prior.aimed, "latency_s": float(fitted.room.latency_s)}
        blend = Blend.fit(sounding, judged, early, fitted, **known_of)
        alarms += blend.alarms
    return Acoustics(fitted, None, blend, unexplained, alarms, recording)


def _judged_rows(n_samples: int) -> int:
    """Return how many rows are completed: fewer of long ones."""
    few = COMPLETED_SAMPLES // max(n_samples, 1)
    return int(np.clip(few, LEAST_COMPLETED, COMPLETED_ROWS))


def _fitted(
    rows: FitSet, settings: SearchSettings, prior: PriorKnowledge
) -> tuple[RecordedRoom, list[str]]:
    listening, reach_s = prior.listening, settings.reach_s
    if len(rows) < LEAST_ROWS or rows.n_samples < LEAST_SAMPLES:
        return RecordedRoom(None), [
            f"{len(rows)} responses of {rows.n_samples} samples are too few to look "
            f"for walls in; at least {LEAST_ROWS} of {LEAST_SAMPLES} are needed"
        ]
    rows = _sounding(rows)
    if len(rows) < LEAST_ROWS:
        return RecordedRoom(None), [
            "too few responses hold sound and stand apart from their emitter"
        ]
    direct = read_direct(rows)
    clear = direct.clearness >= LEAST_CLEARNESS
    if not clear and (prior.shape is not None or rows.n_places > 1):
        return RecordedRoom(None), [NO_DIRECT]
    alarms = []
    if prior.shape is not None:
        drawn, alarms = fit_drawn(rows, direct, prior.shape, reach_s, listening)
        if drawn is not None:
            return _with_recording(rows, drawn, listening), alarms
    scan = scan_room(rows, direct, settings.scan_rows)
    direct = scan.direct
    reach_m = reach_s * rows.speed_of_sound
    convex = try_convex(rows, direct, scan.planes, reach_m, listening)
    if convex is not None and convex.is_clean:
        return _with_recording(rows, convex.fitted, listening), alarms
    boxes = [box for box in scan.boxes if box.found.sum() >= LEAST_WALLS]
    if not boxes:
        alarms.append(NO_PLANE if clear else NO_DIRECT)
        return RecordedRoom(None), alarms
    try:
        found = search_box(rows, direct, boxes, scan.signals)
        # of one loudspeaker turned away few direct sounds tell; a whole box may
        if not clear and found.unexplained > TOLD:
            return RecordedRoom(None), [NO_DIRECT]
        reach_m = _longest(rows, found.box, reach_s)
        listed_s = reach_m / (AHEAD * rows.speed_of_sound) + direct.latency_s
        rows = rows.cut(round(listed_s * rows.sample_rate))
        fitted = fit_shoebox(rows, direct, found.box, reach_m, listening, found.room)
    except np.linalg.LinAlgError:
        alarms.append("the fit of the walls found did not come to an end")
        return RecordedRoom(None), alarms
    recorded = _with_recording(rows, fitted, listening)
    rows = recorded.even(rows)
    if isinstance(recorded.fitted, FittedRoom):
        fitted = recorded.fitted
    listening = recorded.heard_by or listening
    if convex is not None and convex.beats(rows, fitted):
        return recorded.onto(convex.fitted), alarms
    opened = find_inner_walls(rows, direct, fitted, reach_s, listening)
    if opened.fitted is None and found.unsure:
        names = ", ".join(WALL_NAMES[wall] for wall in found.unsure)
        alarms.append(
            f"walls {names} explain little: each may be the echo of others, or stand "
            "elsewhere"
        )
    return recorded.onto(opened.fitted or fitted), alarms + opened.alarms


def _with_recording(
    rows: FitSet, fitted: FittedRoom | FittedMesh, listening: GainPattern | None
) -> RecordedRoom:
    """Fit the air of each recording block, and the listener's pattern if unstated."""
    recorded = fit_air(rows, fitted)
    if listening is not None:
        return recorded
    return find_listener(recorded.even(rows), recorded)


def _longest(rows: FitSet, box: OrientedBox, reach_s: float) -> float:
    """Return the longest path worth listing, metres."""
    volume = float(np.prod(np.minimum(box.high - box.low, 60.0)))
    dense = (MOST_IMAGES * 3 * volume / (4 * np.pi)) ** (1 / 3)
    return float(min(AHEAD * reach_s * rows.speed_of_sound, dense))


def _without_room(
    rows: FitSet, alarms: list[str], settings: SearchSettings, prior: PriorKnowledge
) -> Acoustics:
    """Return direct sounds and interpolated rows, or rows alone where none is sure."""
    sounding = _sounding(rows)
    direct = read_direct(sounding) if len(sounding) >= LEAST_ROWS else None
    if direct is None or direct.clearness < LEAST_CLEARNESS or not settings.late:
        alarms.append("the nearest response is answered")
        return Acoustics(None, NearestRows.of(rows), None, 1.0, alarms)
    try:
        air = fit_open_air(sounding, direct, prior.listening, prior.emitting)
    except np.linalg.LinAlgError:
        alarms.append("no direct sound lies within the rows: the nearest is answered")
        return Acoustics(None, NearestRows.of(rows), None, 1.0, alarms)
    judged = sounding.spread(_judged_rows(rows.n_samples))
    early = air.predict(judged.emitters, judged.listeners, rows.n_samples)
    known_of = {"aimed": prior.aimed, "latency_s": direct.latency_s}
    blend = Blend.fit(sounding, judged, early, air, **known_of)
    alarms += ["direct sounds, interpolated rows and late sound answer", *blend.alarms]
    return Acoustics(air, None, blend, 1.0, alarms)


def _sounding(rows: FitSet) -> FitSet:
    """Return the rows that hold sound and whose ends stand apart."""
    if rows.n_samples < LEAST_SAMPLES:
        return rows.rows(np.arange(0))
    power = (rows.responses**2).sum(axis=1)
    loud = power > 1e-12 * max(float(power.max(initial=0.0)), 1e-300)
    return rows.rows(np.flatnonzero(loud & (rows.distances > APART_M)))


def _room_alarms(fitted: FittedRoom | FittedMesh, unexplained: float) -> list[str]:
    if isinstance(fitted, FittedMesh):
        return mesh_alarms(fitted, unexplained)
    alarms = []
    found = fitted.room.box.found
    if not found.all():
        names = [WALL_NAMES[k] for k in np.flatnonzero(~found)]
        alarms.append(f"walls unseen by the data: {', '.join(names)}; none is invented")
    # half octaves hold energies of sound whose waveforms nothing tells
    if unexplained > (POOR if isinstance(fitted, FittedBandedRoom) else BELIEVED):
        alarms.append(
            f"paths explain only {100 * (1 - unexplained):.0f} % of the energy: this "
            "room is not a box, or the poses are off"
        )
    spread = fitted.wall_sd()
    for wall in np.flatnonzero(found & (spread > WIDE_M)):
        alarms.append(
            f"wall {WALL_NAMES[wall]} is known to {1000 * spread[wall]:.0f} mm only"
        )
    return alarms
