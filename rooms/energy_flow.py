"""Mean energy in a shoebox as a function of time.

Energies are per second and in the unit of a response whose direct sound is 1/d:
without any loss the energy arriving per second is 4 pi c / V at all times.
"""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.scene import Scene
from rooms.transport import COARSE, transport_of

__all__ = ["EnergyFlow", "energy_flow"]

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


def _logs(shares: FloatArray) -> FloatArray:
    return -np.log(np.maximum(1.0 - shares, 1e-12))


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
    geometry, c = scene.geometry, scene.speed_of_sound
    nodes, weights = _directions()
    rates = np.repeat(c * nodes / geometry.size / 2, 2, axis=1)
    spread = np.zeros_like(scene.absorption) if scattering is None else scattering
    total = rates @ (_logs(scene.absorption) + _logs(spread))
    bounces = rates.sum(axis=1)
    flow = np.zeros((3, len(times), scene.absorption.shape[1]))
    for step, t in enumerate(times):
        mirrored = np.exp(-total * t) * weights[:, None]
        above = bounces * t > (np.inf if max_order is None else max_order + 0.5)
        flow[0, step] = mirrored[~above].sum(axis=0)
        flow[1, step] = mirrored[above].sum(axis=0)
    flow *= 4 * np.pi * c / geometry.volume
    if np.any(spread > 0) and len(times):
        flow[2] = _scattered(scene, spread, times)
    return EnergyFlow(times, *flow)


def _scattered(scene: Scene, spread: FloatArray, times: FloatArray) -> FloatArray:
    """Return the mean energy per second of what is scattered, (steps, bands)."""
    # spans are powers of two, so that few transports serve many requests
    span = 2.0 ** np.ceil(np.log2(max(float(np.max(times)), 1e-3)))
    box = transport_of(
        np.asarray(scene.geometry.size), scene.absorption, spread,
        scene.speed_of_sound, span, COARSE,
    )  # fmt: skip
    energy = np.maximum(box.mean_energy(), 0.0)
    return np.stack([np.interp(times, box.times, e, right=0) for e in energy.T], axis=1)
