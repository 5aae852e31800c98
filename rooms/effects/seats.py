"""Grazing sound over rows of seats: the seat dip.

What the dip takes away is not given back: it goes into the seats or steeply up from
them, and the late sound has both in the absorption and scattering that are stated.
"""

import numpy as np

from rir.arrays import FloatArray
from rir.physics import decibels
from rir.seats import SeatRows
from rir.walls import octave_frequencies
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.seating import (
    LEAST_ROWS,
    OffTheTops,
    OverSeats,
    Troughs,
    acting_depth,
    over_rows,
    seat_floors,
    seat_panels,
    troughs_of,
)
from rooms.sound import Budget, Sound

__all__ = ["SEATS"]

_EAR, _MOUTH = np.array([0.4]), np.array([1.5])
"""Heights above the tops of seated ears (1.2 m over the floor, ISO 3382-1) and of an
emitter on a stage [m], for the planner's typical pair."""


_RIGID = Troughs(0.0, (1.0,), (1.0,))
"""Troughs without depth: a hard floor."""

_COST_S = 1e-2
"""Spherical waves and echoes of some twenty paths that meet the floor."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Answer no exactly without seats; else judge by a stage and an ear among them."""
    if not any(scene.seats):
        return Need(False, "no surface is marked as seats")
    if not np.any(seat_panels(scene)):
        why = f"no surface marked as seats is level and {LEAST_ROWS} rows long"
        return Need(False, why)
    heard = scene.bands < budget.sample_rate / 2
    heard[0] = True
    worst, told, area = {"level_db": 0.0, "clarity_db": 0.0}, "", 0.0
    for surface, rows in enumerate(scene.seats):
        if rows is None:
            continue
        change, level = (part[heard] for part in _typical(scene, surface, rows))
        area += float(scene.geometry.areas[surface])
        if not told or np.max(level) > worst["level_db"]:
            band = int(np.argmin(change))
            told = f"{change[band]:.0f} dB at {scene.bands[heard][band]:.0f} Hz"
        worst["level_db"] = max(worst["level_db"], float(np.max(level)))
        # the early sound of a pair is a few paths, and many of them meet the floor
        largest = float(np.max(np.abs(change)))
        worst["clarity_db"] = max(worst["clarity_db"], largest)
    why = f"{area:.0f} m² of seats change what grazes them by {told}"
    return judged(tolerance, worst, why, _COST_S)


def _typical(
    scene: Scene, surface: int, rows: SeatRows
) -> tuple[FloatArray, FloatArray]:
    """Return what seats do to grazing sound, and so to the level [dB], per band."""
    run = np.sqrt(scene.geometry.areas[surface])
    depth, c = acting_depth(rows.back_m, rows.under_m), scene.speed_of_sound
    shares = tuple(map(float, scene.absorption[surface]))
    bands = tuple(map(float, scene.bands))
    f = octave_frequencies(scene.bands)
    over, rigid = (
        over_rows(troughs, f.ravel(), (_MOUTH, _EAR), np.array([run])).reshape(f.shape)
        for troughs in (
            troughs_of(depth, shares, bands, c),
            Troughs(0.0, (1.0,), (1.0,)),
        )
    )
    plain = np.sqrt((1 - scene.absorption) * (1 - scene.scattering))[surface]
    rows_on, rows_off = (
        np.mean(np.abs(1 + image) ** 2, axis=1)
        for image in (over, plain[:, None] * rigid)
    )
    lost = np.maximum(scene.geometry.areas.sum() * scene.mean_absorption, 1e-9)
    field = 16 * np.pi * (1 - scene.mean_absorption) / lost * run**2
    change = decibels(rows_on / rows_off)
    return change, np.abs(decibels((rows_on + field) / (rows_off + field)))


def apply(scene: Scene, sound: Sound) -> None:
    """Let listed reflections off seats be those of spherical waves off their tops."""
    panels = seat_panels(scene)
    if not np.any(panels):
        return
    sound.bounce_changes.append(OverSeats(scene, panels))
    floors, lifts = seat_floors(scene)
    if len(floors):
        ends = sound.emitter.position, sound.listeners.positions
        change = OffTheTops(*ends, floors, lifts, scene.speed_of_sound)
        sound.arrival_changes.append(change)


SEATS = Effect("seats", "grazing sound over rows of seats (seat dip)", needed, apply)
