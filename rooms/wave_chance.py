"""What parameters stray by because late sound is drawn: the chance of random waves.

A sum of many waves has Gaussian pressure, as late sound in a room has: its energy in a
band of width B over a time T strays by one over the root of BT, place by place. No
measurement at another place, and no other draw, brings the same.

M. R. Schroeder, Statistical parameters of the frequency response curves of large rooms,
J. Audio Eng. Soc. 35, 299 (1987).
"""

import numpy as np

from rir import Pose, Poses
from rir.arrays import FloatArray
from rooms.effects import EFFECTS
from rooms.effects.handover import MESH_ORDER, flow_of, waves_share
from rooms.effects.modes import crossover_of
from rooms.effort import decay_parameters
from rooms.energy_flow import energy_flow
from rooms.plan import EffectPlan
from rooms.predict import equivalent_box
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["independent_pairs", "waves_errors"]

_STEP = 0.001
"""Time resolution [s]: that of the flow of energy."""

_DRAWS = 100
"""Draws that tell a standard error: to a fourteenth of itself."""

_DISTANCE = 0.4
"""Typical distance of two places, as a share of the cube root of the volume."""

_MOST_PLACES = 500
"""Places of a list that are looked at: more would hardly be independent."""


def waves_errors(scene: Scene, plan: EffectPlan, budget: Budget) -> FloatArray:
    """Return standard errors of a single pair, by chance of the waves.

    Parameters
    ----------
    scene : Scene
        What was simulated.
    plan : EffectPlan
        Effects that were on.
    budget : Budget
        Length, order and rays.

    Returns
    -------
    ndarray, shape (4, bands)
        Level [dB], clarity [dB], reverberation [%] and early decay [%]; NaN where a
        decay cannot be told, zero where no waves are heard.
    """
    found = np.zeros((4, len(scene.bands)))
    if "late" not in plan.on:
        return found
    waves, single = _energies(scene, plan, budget)
    if not np.any(waves):
        return found
    arrival = _DISTANCE * float(np.cbrt(scene.geometry.volume)) / scene.speed_of_sound
    times = _STEP * (np.arange(len(waves)) + 0.5)
    fade = np.exp(-np.outer(times, scene.air_loss) * scene.speed_of_sound) * _STEP
    fade[times < arrival] = 0.0
    waves, single = waves * fade, single * fade
    first = min(int(arrival / _STEP), len(waves) - 1)
    single[first] += 1 / (arrival * scene.speed_of_sound) ** 2
    # an octave is as wide as its centre over the root of two
    drawn = _draw(waves, single, scene.bands / np.sqrt(2) * _STEP)
    values = decay_parameters(np.moveaxis(drawn, 1, 2), _STEP, arrival)
    # what ends before a decay can be told has an infinite clarity in some draws
    with np.errstate(invalid="ignore"):
        found = values.std(axis=1)
        found[2:] *= 100 / np.maximum(values[2:].mean(axis=1), 1e-9)
    solved = crossover_of(scene, budget) if "modes" in plan.on else 0.0
    return np.where(scene.bands * np.sqrt(2) < solved, 0.0, found)


def _draw(waves: FloatArray, single: FloatArray, cells: FloatArray) -> FloatArray:
    """Return energies that chance may bring, shape (draws, steps, bands).

    Parameters
    ----------
    waves, single : ndarray, shape (steps, bands)
        Expected energy of waves, and that of paths, with which they interfere.
    cells : ndarray, shape (bands,)
        Bandwidth times the time of a step.
    """
    rng = np.random.default_rng(0)
    # sums of gamma variates of one scale are gamma variates: the step does not matter
    spread = (waves + 2 * single) / cells
    shape = waves / np.maximum(spread, 1e-300)
    drawn = rng.standard_gamma(shape, (_DRAWS, *waves.shape)) * spread
    return drawn + single


def _energies(
    scene: Scene, plan: EffectPlan, budget: Budget
) -> tuple[FloatArray, FloatArray]:
    """Return energy per second of waves and of single reflections, (steps, bands)."""
    scattered = "scattering" in plan.on
    if scene.geometry.lattice and budget.rays is None:
        center = scene.geometry.center
        sound = Sound(scene, Pose(center), Poses(center[None]), budget)
        if scattered:
            EFFECTS["scattering"].apply(scene, sound)
        flow = flow_of(scene, sound)
        share = np.zeros(len(flow.times))
        if "specular" in plan.on:
            share = waves_share(scene, sound, flow.times)
    else:
        box = equivalent_box(scene)
        times = np.arange(0.5 * _STEP, budget.duration, _STEP)
        order = MESH_ORDER if budget.max_order is None else budget.max_order
        spread = box.scattering if scattered else None
        flow = energy_flow(box, times, scattering=spread, max_order=order)
        share = np.zeros(len(times))
    inside = flow.times < budget.duration
    part = share[:, None] * flow.images
    single = flow.images - part if "specular" in plan.on else 0.0 * part
    return (flow.scattered + flow.beyond + part)[inside], single[inside]


def independent_pairs(
    emitters: FloatArray, listeners: FloatArray, wavelengths: FloatArray
) -> FloatArray:
    """Return by how many pairs the chance of the waves is averaged, per wavelength.

    Energies of diffuse sound at places d apart correlate as (sin(kd) / kd) squared
    (F. Jacobsen and T. Roisin, JASA 107, 203, 2000), at both ends of a pair.

    Parameters
    ----------
    emitters, listeners : ndarray, shape (n, 3)
        Positions [m].
    wavelengths : ndarray, shape (bands,)
        Wavelengths [m].

    Examples
    --------
    >>> far = np.array([[0.0, 0, 0], [50.0, 0, 0]])
    >>> independent_pairs(far[:1], far, np.array([1.1])).round(2)
    array([2.])
    >>> independent_pairs(far[:1], far / 1e4, np.array([1.1])).round(2)
    array([1.])
    """
    return _independent(emitters, wavelengths) * _independent(listeners, wavelengths)


def _independent(places: FloatArray, wavelengths: FloatArray) -> FloatArray:
    """Return how many of some places count as independent, at least one."""
    if not len(places):
        return np.ones(len(wavelengths))
    some = places[:: max(1, len(places) // _MOST_PLACES)]
    apart = np.linalg.norm(some[:, None] - some, axis=-1)
    alike = [np.mean(np.sinc(2 * apart / length) ** 2) for length in wavelengths]
    return 1 / np.array(alike)
