"""Transmission: what passes straight through thin surfaces.

Every surface crossed takes its own share, so a slab modelled by two faces has the
square root of its transmission on each.
"""

import numpy as np
from numpy.typing import NDArray

from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict, judged
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.sound import Arrivals, Budget, Sound

__all__ = ["TRANSMISSION", "crossings"]

FloatArray = NDArray[np.float64]
_BENT_DB = 14.0
"""Sound bent around one edge arrives about so much below free sound [dB]."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the most transparent surface against sound bent around an edge."""
    del budget
    if isinstance(scene.geometry, Shoebox):
        return Verdict(False, "nothing stands inside a box")
    most = float(scene.transmission.max(initial=0.0))
    if most == 0:
        return Verdict(False, "no surface lets sound through")
    level = float(decibels(1 + most * 10 ** (_BENT_DB / 10)))
    why = f"surfaces pass up to {decibels(most):.0f} dB"
    return judged(tolerance, {"level_db": level}, why, 1e-4)


def apply(scene: Scene, sound: Sound) -> None:
    """Add the straight way through every surface between the ends."""
    if isinstance(scene.geometry, Shoebox) or not np.any(scene.transmission):
        return
    way = sound.listeners.positions - sound.emitter.position
    distance = np.linalg.norm(way, axis=1)
    hit = crossings(scene.geometry, sound.emitter.position, sound.listeners.positions)
    through = hit.any(axis=1) & (distance > 0)
    surface = scene.geometry.face_surface  # pyright: ignore[reportAttributeAccessIssue]
    with np.errstate(divide="ignore"):
        loss = np.log(scene.transmission[surface]) / 2
    gain = np.exp(np.where(hit[through][..., None], loss, 0.0).sum(axis=1))
    facing = way[through] / distance[through, None]
    sound.arrivals.append(
        Arrivals(
            listener=np.nonzero(through)[0],
            delay=distance[through] / scene.speed_of_sound,
            gain=gain / distance[through, None],
            departure=facing,
            arrival=-facing,
            order=np.zeros(int(through.sum()), dtype=np.int64),
        )
    )


def crossings(geometry: object, start: FloatArray, ends: FloatArray) -> NDArray:
    """Tell which triangles each straight way crosses, shape (ends, triangles).

    References
    ----------
    T. Möller, B. Trumbore, J. Graphics Tools 2(1), 21 (1997).
    """
    corners = geometry.corners + geometry.origin  # pyright: ignore[reportAttributeAccessIssue]
    a, b, c = np.moveaxis(corners, 1, 0)
    way = (ends - start)[:, None]
    across = np.cross(way, c - a)
    volume = np.einsum("nti,ti->nt", across, b - a)
    safe = np.where(np.abs(volume) > 1e-12, volume, np.inf)
    u = np.einsum("nti,ti->nt", across, start - a) / safe
    other = np.cross(start - a, b - a)
    v = np.einsum("nti,ti->nt", np.broadcast_to(way, across.shape), other) / safe
    t = np.einsum("ti,ti->t", c - a, other) / safe
    # one of two triangles that share the side a way passes through
    inside = (u >= 0) & (v >= 0) & (u + v < 1)
    return inside & (t > 1e-9) & (t < 1 - 1e-9) & np.isfinite(safe)


TRANSMISSION = Effect("transmission", "through thin surfaces", needed, apply)
