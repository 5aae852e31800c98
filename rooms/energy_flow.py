"""Mean energy in a shoebox as a function of time.

Energies are per second and in the unit of a response whose direct sound is 1/d:
without any loss the energy arriving per second is 4 pi c / V at all times.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.scene import Scene
from rooms.transport import COARSE, BoxTransport, transport_of

__all__ = ["EnergyFlow", "energy_flow"]

_ROUNDED = 4  # last steps of a transport, which its end has touched
_NODES = 16  # 8 move no predicted level or time by 0.001 dB or s


@dataclass(frozen=True, eq=False)
class EnergyFlow:
    """Mean energy per second at a set of times."""

    times: FloatArray
    """Times since emission [s]. Shape (steps,)."""
    images: FloatArray
    """Reflected by mirrors only, within the order limit. Shape (steps, bands)."""
    beyond: FloatArray
    """Reflected by mirrors only, above the order limit. Shape (steps, bands)."""
    scattered: FloatArray
    """Scattered at least once. Shape (steps, bands)."""


def _directions() -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of a product rule over one octant of directions."""
    x, w = np.polynomial.legendre.leggauss(_NODES)
    x, w = (x + 1) / 2, w / 2
    z, phi = (grid.ravel() for grid in np.meshgrid(x, x * np.pi / 2, indexing="ij"))
    flat = np.sqrt(1 - z**2)
    nodes = np.stack([flat * np.cos(phi), flat * np.sin(phi), z], axis=1)
    return nodes, np.outer(w, w).ravel()


def _mirrored(
    size: FloatArray, kept: FloatArray, ways: FloatArray, most: float
) -> FloatArray:
    """Return what mirrors leave after some ways [m], (2, ways, bands).

    Within an order, and above it. Between the walls of an axis a way meets one number
    of walls or one more, with a chance that is linear in its length.
    """
    nodes, weights = _directions()
    steps = nodes / size
    out = np.zeros((2, len(ways), kept.shape[1]))
    count = int(np.max(ways, initial=0.0) / size.min()) + 3
    tables = [_after_walls(kept[2 * k : 2 * k + 2], count) for k in range(3)]
    for index, way in enumerate(ways):
        met = steps * way
        whole = met.astype(int)
        part = (met - whole)[:, :, None]
        left = weights[:, None]
        for k, table in enumerate(tables):
            n, f = whole[:, k], part[:, k]
            left = left * (table[n] + f * (table[n + 1] - table[n]))
        above = met.sum(axis=1) > most
        out[0, index] = left[~above].sum(axis=0)
        out[1, index] = left[above].sum(axis=0)
    return out


def _after_walls(kept: FloatArray, count: int) -> FloatArray:
    """Return what 0, 1, 2, … walls of an axis leave, either met first: (count, n)."""
    number = np.arange(count)[:, None]
    odd = np.where(number % 2 == 1, kept.mean(axis=0), 1.0)
    return odd * np.prod(kept, axis=0) ** (number // 2)


def energy_flow(
    scene: Scene,
    times: FloatArray,
    *,
    scattering: FloatArray | None = None,
    max_order: int | None = None,
) -> EnergyFlow:
    """Follow the mean energy of mirrors and scatterers through a shoebox.

    Sound in direction u meets a wall pair L metres apart |u_i| c / L times a second;
    each wall takes its absorption and its scattered share. What is scattered follows
    transport (`rooms.transport`), on average over all pairs of places.

    Parameters
    ----------
    scene : Scene
        Its geometry must be a shoebox.
    times : ndarray, shape (steps,)
        Times since emission [s].
    scattering : ndarray, shape (6, bands), optional
        Scattering in force; none when left out.
    max_order : int, optional
        Highest order that is followed image by image.
    """
    if not scene.geometry.lattice:
        raise SceneError("the mean flow of energy needs a shoebox")
    volume, c = scene.geometry.volume, scene.speed_of_sound
    spread = np.zeros_like(scene.absorption) if scattering is None else scattering
    kept = (1.0 - scene.absorption) * (1.0 - spread)
    unlike, lane_of = np.unique(kept, axis=1, return_inverse=True)
    most = np.inf if max_order is None else max_order + 0.5
    times = np.asarray(times, dtype=float)
    mirrored = _mirrored(np.asarray(scene.geometry.size), unlike, c * times, most)
    flow = np.zeros((3, len(times), scene.absorption.shape[1]))
    flow[:2] = 4 * np.pi * c / volume * mirrored[:, :, lane_of.ravel()]
    if np.any(spread > 0) and len(times):
        flow[2] = _scattered(scene, spread, times)
    return EnergyFlow(times, *flow)


def _transport(scene: Scene, spread: FloatArray, span: float) -> BoxTransport:
    return transport_of(
        np.asarray(scene.geometry.size), scene.absorption, spread,
        scene.speed_of_sound, span, COARSE,
    )  # fmt: skip


def _scattered(scene: Scene, spread: FloatArray, times: FloatArray) -> FloatArray:
    """Return the mean energy per second of what is scattered, (steps, bands)."""
    # spans are powers of two, so that few transports serve many requests
    latest = float(np.max(times))
    span = 2.0 ** np.ceil(np.log2(max(latest, 1e-3)))
    box = _transport(scene, spread, span)
    if latest > box.times[-_ROUNDED]:
        box = _transport(scene, spread, 2 * span)
    from scipy.interpolate import CubicSpline

    geometry, c = scene.geometry, scene.speed_of_sound
    energy = box.mean_energy()
    energy[0] = 0.0
    # how much the walls scatter at first of what fills the room evenly
    share = geometry.areas @ ((1.0 - scene.absorption) * spread)
    slope = np.pi * c**2 / geometry.volume**2 * share
    ends: Any = (1, slope), (2, np.zeros_like(slope))
    # steps that the end has touched would ring through those before
    known, energy = box.times[: 1 - _ROUNDED], energy[: 1 - _ROUNDED]
    curve = CubicSpline(known, energy, bc_type=ends)
    inside = (times > 0) & (times <= known[-1])
    return np.where(inside[:, None], np.maximum(curve(times), 0.0), 0.0)
