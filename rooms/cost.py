"""What accuracy costs in a scene: error against seconds, knob by knob."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from rir import Poses
from rir.arrays import FloatArray
from rir.bands import crossover_gains
from rir.cost import CostCurve, measure_cost
from rir.onset import find_onset
from rir.physics import decibels
from rooms.effects import Tolerance
from rooms.plan import plan_effects
from rooms.scene import Scene
from rooms.simulation import simulate
from rooms.sound import Work

__all__ = ["measure_knobs"]

Setting = tuple[str, dict[str, Any]]
# Settings from far too coarse to finer than asked for, in steps that show the bend.
_RAYS = (1000, 4000, 16000)
_ORDERS = (1, 3, 6, 10, 17, 30)
_MESH_ORDERS = (0, 1, 2, 3, 4, 5)
_SHARES = (0.125, 0.25, 0.5, 0.75)
_BANDS = (1, 2, 4, 7)
_TOLERANCES = (0.1, 0.5, 1.0, 2.0, 4.0)
_ACCURACIES = (0.1, 0.25, 0.5, 1.0, 2.0)  # dB of C50
_BEST_RAYS = 64_000  # four times the finest setting: half its chance error
_LEAST = 0.001  # dB of C50: differences below are rounding, see `measure_knobs`


def clarity_per_octave(
    responses: FloatArray, sample_rate: int, centers: FloatArray
) -> FloatArray:
    """Return C50 per response and octave [dB], shape (..., bands)."""
    n = responses.shape[-1]
    weights = crossover_gains(tuple(map(float, centers)), sample_rate, 2 * n)
    spectra = np.fft.rfft(responses, 2 * n)[..., None, :] * weights
    energy = np.fft.irfft(spectra, 2 * n)[..., :n] ** 2
    split = find_onset(responses)[..., None, None] + round(0.05 * sample_rate)
    early = np.where(np.arange(n) < split, energy, 0.0).sum(axis=-1)
    late = energy.sum(axis=-1) - early
    return decibels(np.maximum(early, 1e-30) / np.maximum(late, 1e-30))


def measure_knobs(
    scene: Scene,
    emitters: Poses,
    listeners: Poses,
    *,
    sample_rate: int,
    duration: float,
    tolerance_db: float = Tolerance.clarity_db,
    repeats: int = 2,
    clock: Callable[[], float] = time.process_time,
    on_run: Callable[[str], None] | None = None,
) -> list[CostCurve]:
    """Measure error against seconds for each knob that matters in a scene.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    emitters, listeners : Poses
        The pairs to take the mean over.
    sample_rate, duration : float
        Rate [Hz] and length [s] of the reference.
    tolerance_db : float
        Of C50 [dB]: what is recommended is the cheapest setting within it.
    repeats : int
        Runs of each setting.
    clock : callable
        Answers processor seconds.
    on_run : callable, optional
        Told the knob and setting before each run.

    Returns
    -------
    list of CostCurve
        Those of `knobs_of`. Errors are of C50 [dB], the mean over octaves and
        pairs, against the best setting of all knobs; differences below 0.001 dB
        count as that. Seconds are those of one pair.
    """
    scene = plan_effects(scene, sample_rate=sample_rate, duration=duration).stage(scene)
    boxed = scene.geometry.lattice
    best = {} if boxed else {"rays": _BEST_RAYS, "max_order": _MESH_ORDERS[-1]}
    lean: dict[str, Any] = {"sample_rate": sample_rate, "duration": duration}
    fixed: dict[str, Any] = {**lean, **best}
    heard = scene.bands[scene.bands < sample_rate / 2]

    def run(setting: Setting, _: object = None) -> FloatArray:
        return make(setting, emitters, listeners)

    warmed: set[str] = set()

    def warm(setting: Setting) -> None:
        # compiled code, filters: the first run of a kind would pay for all
        kind = " ".join(sorted(setting[1]))
        if kind not in warmed:
            warmed.add(kind)
            make(setting, emitters[:1], listeners[:1])

    def told(knob: str) -> Callable[[str], None] | None:
        if on_run is None:
            return None
        tell = on_run
        return lambda setting: tell(f"{knob} {setting}")

    def make(setting: Setting, *places: Poses) -> FloatArray:
        base = lean if "tolerance" in setting[1] else fixed
        options: dict[str, Any] = {**base, **setting[1]}
        room = options.pop("scene", scene)
        plan = plan_effects(room, **options)
        if "tolerance" not in options:
            # one knob is turned, all others are at their best
            plan = replace(plan, work=Work())
        options.pop("tolerance", None)
        return simulate(room, *places, **options, plan=plan).responses

    def clarity(responses: FloatArray) -> FloatArray:
        return clarity_per_octave(responses, sample_rate, heard)

    if on_run:
        on_run("reference")
    strict = {"tolerance": scaled_tolerance(0.01), **best}
    truth = clarity(run(("reference", strict)))
    curves = [
        measure_cost(
            knob,
            settings,
            run,
            lambda made: max(float(np.mean(np.abs(clarity(made) - truth))), _LEAST),
            quantity="C50",
            unit="dB",
            rng=np.random.default_rng(0),
            repeats=repeats,
            count=len(emitters) * len(listeners),
            per="pair",
            mark="SIMULATED",
            name=lambda setting: setting[0],
            warm=warm,
            clock=clock,
            on_run=told(knob),
        )
        for knob, settings in knobs_of(scene, duration).items()
    ]
    return [replace(curve, knee=cheapest(curve, tolerance_db)) for curve in curves]


def cheapest(curve: CostCurve, tolerance: float) -> int:
    """Return the cheapest setting within a tolerance, or else the most exact one."""
    known = [
        k
        for k, point in enumerate(curve.points)
        if np.isfinite(point.error) and np.isfinite(point.seconds)
    ]
    within = [k for k in known if curve.points[k].error <= tolerance]
    if within:
        return min(within, key=lambda k: curve.points[k].seconds)
    return min(known, key=lambda k: curve.points[k].error, default=-1)


def knobs_of(scene: Scene, duration: float) -> dict[str, list[Setting]]:
    """Return the knobs of a scene, each with its named options of `simulate`.

    Reflection order; rays, unless the scene needs none; length; number of bands
    told apart; the tolerance that a plan must keep, as a multiple of the
    just-noticeable differences; and an accuracy of C50 alone.
    """
    boxed = scene.geometry.lattice
    orders = _ORDERS if boxed else _MESH_ORDERS
    knobs: dict[str, list[Setting]] = {
        "order": [(f"{n}", {"max_order": n}) for n in orders]
    }
    if not boxed:
        knobs["rays"] = [(f"{n}", {"rays": n}) for n in _RAYS]
    knobs["length"] = [
        (f"{share * duration:.2f} s", {"duration": share * duration})
        for share in _SHARES
    ]
    knobs["bands"] = [(f"{n}", {"scene": merge_bands(scene, n)}) for n in _BANDS]
    knobs["tolerance"] = [
        (f"x{factor:g}", {"tolerance": scaled_tolerance(factor)})
        for factor in _TOLERANCES
    ]
    knobs["accuracy"] = [
        (f"C50 {db:g} dB", {"tolerance": Tolerance.of({"clarity_db": db})})
        for db in _ACCURACIES
    ]
    return knobs


def scaled_tolerance(factor: float) -> Tolerance:
    """Return the just-noticeable differences times a factor."""
    return Tolerance(*(factor * limit for limit in vars(Tolerance()).values()))


def merge_bands(scene: Scene, count: int) -> Scene:
    """Return a scene that tells only so many bands apart, each a few octaves wide.

    A band lies at the geometric mean of its octaves and has their mean shares.
    """
    groups = np.array_split(np.arange(len(scene.bands)), count)
    shares = {
        name: np.stack([getattr(scene, name)[:, g].mean(axis=1) for g in groups], 1)
        for name in ("absorption", "scattering", "transmission")
    }
    centers = [float(np.exp(np.log(scene.bands[g]).mean())) for g in groups]
    return replace(scene, bands=np.array(centers), **shares)
