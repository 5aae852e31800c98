"""Mirror reflections: image sources."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rir.physics import decibels
from rooms.box_images import BoxPaths, box_paths
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.effects.handover import ANY_ORDER, MESH_ORDER, fading_before, handover_time
from rooms.predict import predicted_errors
from rooms.reflection import Bounces, path_gains
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Lattice, Sound
from rooms.walls import spread_echoes

if TYPE_CHECKING:
    from rooms.mesh.images import Paths

__all__ = ["SPECULAR"]

_SILENT_DB = 300.0  # below what double precision keeps of a sum of pressures
_CLASSES = 32
"""Of the cosine of incidence of images that are not listed one by one."""
_ALIKE = 1e-3
"""Pressure factors that differ by less over all angles are one: 0.01 dB a bounce."""
_MOST_IMAGES = 2e9
"""About twenty seconds of work for each pair."""
_IMAGE_S = 1e-8  # of work on an image of a pair
_HANDED_OVER = 3e7
"""Most images where surfaces scatter: waves take over before there are more."""
_LONG_S = 1.0
"""Work on a pair of which a plan warns."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by what the direct sound alone would sound like."""
    errors = predicted_errors(scene, budget.duration, budget.sample_rate, anechoic)
    kept = 100 * float(1 - scene.absorption.min())
    why = f"walls return up to {kept:.0f} % of the energy"
    images = _images_listed(scene, budget)
    cost = _IMAGE_S * images
    if cost > _LONG_S:
        why += f", {images:.0e} images, some {cost:.0f} s of work a pair"
    return judged(tolerance, errors, why, cost)


def _images_listed(scene: Scene, budget: Budget) -> float:
    """Return about how many mirror paths of a pair there are to be listed."""
    images = _images_within(scene, budget.duration)
    if not scene.geometry.lattice or np.any(scene.scattering):
        return min(images, _HANDED_OVER)
    silent = _silent_after(scene, np.sqrt(1 - scene.absorption))
    images = _images_within(scene, min(budget.duration, silent))
    if budget.max_order is None:
        return images
    return min(images, _images_to(budget.max_order))


def _images_within(scene: Scene, until: float) -> float:
    """Return how many images of a box are heard within a time [s]."""
    reach = scene.speed_of_sound * until
    return float(4 / 3 * np.pi * reach**3 / scene.geometry.volume)


def _images_to(order: int) -> float:
    """Return how many images of a box have up to so many reflections."""
    return (2 * order + 1) * (2 * order**2 + 2 * order + 3) / 3


def anechoic(scene: Scene) -> Scene:
    """Return the scene with surfaces that return nothing."""
    none = np.zeros_like(scene.scattering)
    lost = np.ones_like(scene.absorption)
    return replace(scene, absorption=lost, scattering=none, walls={})


def apply(scene: Scene, sound: Sound) -> None:
    """Add every mirror path: all images of a box, or the valid ones of a mesh."""
    geometry, budget = scene.geometry, sound.budget
    if not np.any(sound.reflection):
        return
    if not geometry.lattice:
        sound.arrivals.extend(_mesh_paths(scene, sound))
        return
    order = ANY_ORDER if budget.max_order is None else budget.max_order
    until, fading = budget.duration, 0.0
    if budget.rays is not None:
        order = MESH_ORDER if budget.max_order is None else budget.max_order
        sound.listed_order = order
    else:
        until, fading = handover_time(scene, sound), fading_before(scene, sound)
    silent = _silent_after(scene, sound.reflection)
    if silent < until:
        until, fading = silent, 0.0
    _check_bearable(scene, min(order, ANY_ORDER), until)
    first = 1
    if sound.local or sound.arrival_changes:
        listed = min(order, MESH_ORDER)
        sound.arrivals.extend(_box_paths(scene, sound, listed))
        first = listed + 1
    limits = order, until, first, fading
    angles = _by_angle(sound)
    sound.lattice = Lattice(geometry.size, sound.reflection, *limits, by_angle=angles)


def _by_angle(sound: Sound) -> FloatArray | None:
    """Return the walls' factors by angle, (6, classes, bands); None if all are one."""
    if not sound.local:
        return None
    factors = sound.by_class(_CLASSES).specular
    return factors if np.ptp(factors, axis=1).max() > _ALIKE else None


def _silent_after(scene: Scene, reflection: FloatArray) -> float:
    """Return when every image is 300 dB below its distance's level [s].

    Sound along an axis meets its two walls every 2 L / c seconds, and nothing else:
    no image loses less.
    """
    kept = np.max(reflection[0::2] * reflection[1::2], axis=1)
    loss = np.maximum(-decibels(kept**2), 0.0)
    with np.errstate(divide="ignore"):
        # one trip more: the last wall may be hard where the other is not
        trips = 1 + _SILENT_DB / loss
    return float(np.max(trips * 2 * scene.geometry.size)) / scene.speed_of_sound


def _check_bearable(scene: Scene, order: int, until: float) -> None:
    """Raise `SceneError` if a box has more images than anyone waits for."""
    inside, listed = _images_within(scene, until), _images_to(order)
    if min(inside, listed) > _MOST_IMAGES:
        raise SceneError(
            f"{scene.name} has {min(inside, listed):.1e} images in {until:g} s, more"
            f" than {_MOST_IMAGES:.0e}; state a highest order or a shorter response"
        )


def _box_paths(scene: Scene, sound: Sound, order: int) -> list[Arrivals]:
    """List the images of low order, whose reflections effects look at one by one."""
    paths = box_paths(
        scene.geometry.size,
        sound.emitter.position,
        sound.listeners.positions,
        order,
        scene.speed_of_sound * sound.budget.duration,
    )
    return _arrivals(scene, sound, paths, (paths.rows, paths.bounces))


def _mesh_paths(scene: Scene, sound: Sound) -> list[Arrivals]:
    from rooms.mesh import find_paths

    order = MESH_ORDER if sound.budget.max_order is None else sound.budget.max_order
    sound.listed_order = order
    geometry = scene.geometry.mesh
    paths = find_paths(
        geometry,
        sound.emitter.position,
        sound.listeners.positions,
        max_order=order,
        max_length=scene.speed_of_sound * sound.budget.duration,
        direct=False,
    )
    if sound.local or sound.arrival_changes:
        met = paths.bounces(geometry, sound.emitter.position)
        return _arrivals(scene, sound, paths, met)
    return _arrivals(scene, sound, paths, None, paths.gains(sound.reflection))


def _arrivals(
    scene: Scene,
    sound: Sound,
    paths: "Paths | BoxPaths",
    met: tuple[IntArray, Bounces] | None,
    gain: FloatArray | None = None,
) -> list[Arrivals]:
    """Return paths as arrivals: with gains, or with the reflections they met."""
    corners, spectra = None, None
    if met is not None:
        rows, bounces = met
        gain, spectra = path_gains(paths.length, rows, bounces, sound.reflect)
        corners = _corners(paths.order, rows, bounces.point)
    arrivals = Arrivals(
        listener=paths.listener,
        delay=paths.length / scene.speed_of_sound,
        gain=np.zeros((len(paths), len(scene.bands))) if gain is None else gain,
        departure=paths.departure,
        arrival=paths.arrival,
        order=paths.order,
        corners=corners,
    )
    if spectra is None:
        return [arrivals]
    return spread_echoes(arrivals, spectra, scene.bands)


def _corners(order: IntArray, rows: IntArray, point: FloatArray) -> FloatArray:
    """Return the points of reflection path by path, (paths, most, 3), then NaN."""
    corners = np.full((len(order), int(order.max(initial=0)), 3), np.nan)
    first = np.cumsum(order) - order
    corners[rows, np.arange(len(rows)) - first[rows]] = point
    return corners


SPECULAR = Effect(
    "specular",
    "mirror reflections (image sources)",
    needed,
    apply,
    without=anechoic,
)
