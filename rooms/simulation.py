"""Responses between any emitters and listeners of a scene."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rir import Poses
from rir.arrays import FloatArray
from rooms.batches import Batch, batches, in_threads
from rooms.effects import Tolerance
from rooms.effort import Target, parse_accuracy, sampling_errors
from rooms.plan import EffectPlan, plan_effects
from rooms.request import check_effort, check_kind, make_budget, make_seed
from rooms.scene import Scene
from rooms.sound import Budget, Company, Sound
from rooms.stated_errors import stated_errors, together, waves_error

__all__ = ["Simulation", "simulate"]


@dataclass(frozen=True, eq=False)
class Simulation:
    """Responses with the plan that made them.

    Parameters
    ----------
    responses : ndarray, shape (emitters, listeners, n_samples)
        Amplitude 1/d at distance d; sample 0 is the instant of emission.
    sample_rate : int
        Samples per second [Hz].
    plan : EffectPlan
        Which effects were on, and why.
    sampling : dict
        Standard errors by chance alone, by kind: mean over pairs, worst octave.
    rays : int or None
        Rays traced per pair; None for none, or the default number.
    scene : Scene, optional
        What was simulated.
    budget : Budget, optional
        Length, order, rays.
    places : tuple of Poses, optional
        Emitters and listeners.
    """

    responses: FloatArray
    sample_rate: int
    plan: EffectPlan
    sampling: dict[str, float] = field(default_factory=dict)
    rays: int | None = None
    scene: Scene | None = None
    budget: Budget | None = None
    places: tuple[Poses, Poses] | None = None

    @cached_property
    def error_parts(self) -> dict[str, dict[str, float]]:
        """Standard errors by cause and kind; see `rooms.stated_errors`.

        Causes are independent; `errors` takes them together. They are predicted when
        they are first asked for.
        """
        if self.scene is None or self.budget is None:
            return {"sampling": together([self.sampling])}
        return stated_errors(self.scene, self.plan, self.budget, self.sampling)

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of the parameters by kind, all causes together.

        "level_db", "clarity_db", "reverberation_percent", "early_decay_percent", in
        the octave where each is worst.
        """
        return together(self.error_parts.values())

    @cached_property
    def mean_errors(self) -> dict[str, float]:
        """Standard errors of the mean over all pairs, all causes together.

        Late sound is drawn once for a room: pairs that are close to each other, for
        the wavelength, stray alike, and others on their own.
        """
        if self.scene is None or self.budget is None or self.places is None:
            return self.errors
        ends = self.places[0].positions, self.places[1].positions
        staged = self.plan.stage(self.scene)
        waves = waves_error(staged, self.plan, self.budget, ends)
        return together({**self.error_parts, "waves": waves}.values())

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatArray:
        return np.array(self.responses, dtype=dtype, copy=copy)


def simulate(
    scene: Scene,
    emitters: Any,
    listeners: Any,
    *,
    sample_rate: int,
    duration: float,
    max_order: int | None = None,
    rays: int | None = None,
    effects: Sequence[str] | None = None,
    accuracy: str | Mapping[str, float] | None = None,
    seconds: float | None = None,
    rng: np.random.Generator | None = None,
    seed: int = 0,
    threads: int = 1,
    plan: EffectPlan | None = None,
    dtype: type = np.float64,
    tell: Callable[[int, int], None] | None = None,
) -> Simulation:
    """Simulate the responses between all pairs of emitters and listeners.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    emitters, listeners : Poses, Pose, or array_like
        Anything `rir.Poses.of` takes.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Length of the responses [s].
    max_order : int, optional
        Highest order of listed reflections; all inside the response by default.
    rays : int, optional
        Rays per trace, for scenes that need tracing.
    effects : sequence of str, optional
        Exactly these effects; the planner chooses when left out.
    accuracy : str or mapping, optional
        How exact it must be, as in ``"C50 0.1 dB, T60 1 %"``: the tolerance of the
        plan, and rays are traced until their chance errors are below.
    seconds : float, optional
        Processor time to spend on rays [s]; the most accurate result that fits.
    rng : numpy.random.Generator, optional
        Draws the seed; use it or `seed`.
    seed : int
        Key of everything random.
    threads : int
        Threads that share the pairs.
    plan : EffectPlan, optional
        A plan made before; `effects` is then not looked at.
    dtype : type
        float64, or float32 for large batches; computed in float64 either way.
    tell : callable, optional
        Told (pairs done, pairs in all) now and then.

    Returns
    -------
    Simulation

    Raises
    ------
    SceneError
        If a pose lies outside the room.
    SignalError
        If rate, duration, order, rays, accuracy or any other option is not what it
        should be; nothing is computed before all are checked.

    Examples
    --------
    >>> scene = Scene.shoebox((6, 5, 3), absorption=1.0)
    >>> result = simulate(
    ...     scene, [1, 2, 1.5], [3, 2, 1.5], sample_rate=8000, duration=0.02
    ... )
    >>> result.responses.shape
    (1, 1, 160)
    """
    check_kind(scene, Scene, "a scene", "build one by Scene.shoebox or Scene.from_mesh")
    check_kind(plan, (EffectPlan, type(None)), "a plan", "make one by plan_effects")
    check_effort(accuracy, seconds, threads, dtype)
    seed = make_seed(seed, rng)
    budget = make_budget(sample_rate, duration, max_order, rays, seed)
    places = Poses.of(emitters), Poses.of(listeners)
    scene.check_inside("emitter", places[0].positions)
    scene.check_inside("listener", places[1].positions)
    limits = parse_accuracy(accuracy)
    if plan is None:
        settings = sample_rate, duration, max_order, rays
        tolerance = Tolerance.of(limits) if limits else None
        # what is named may be anything, and names need no judgement to be kept
        planned = _planned if effects is None else _planned.__wrapped__
        plan = planned(scene, settings, tolerance, effects)
    budget = replace(budget, work=plan.work)
    target = Target(limits, seconds)
    run = _Run(plan.stage(scene), plan, places, (threads, dtype), tell)
    if target.open_ended or not run.traces(budget):
        run(budget)
    else:
        budget = target.pursue(budget, run)
    rays = budget.rays or plan.work.rays
    made = run.responses, sample_rate, plan, run.errors
    return Simulation(*made, rays, scene, budget, places)


@lru_cache(maxsize=16)
def _planned(
    scene: Scene,
    settings: tuple[int, float, int | None, int | None],
    tolerance: Tolerance | None,
    effects: Sequence[str] | None,
) -> EffectPlan:
    """Return the plan of a scene, made once for all calls."""
    sample_rate, duration, max_order, rays = settings
    return plan_effects(
        scene,
        sample_rate=sample_rate,
        duration=duration,
        max_order=max_order,
        rays=rays,
        only=effects,
        judge=False,
        tolerance=tolerance,
    )


class _Run:
    """One simulation of all pairs, which may be repeated with more work."""

    def __init__(
        self,
        scene: Scene,
        plan: EffectPlan,
        places: tuple[Poses, Poses],
        means: tuple[int, type],
        tell: Callable[[int, int], None] | None,
    ) -> None:
        self.scene, self.plan, self.places = scene, plan, places
        self.tell = tell
        self.threads, self.dtype = means
        self.responses: Any = np.empty(0)
        self.errors: dict[str, float] = {}

    def traces(self, budget: Budget) -> bool:
        """Tell whether rays will be traced: only then work buys accuracy."""
        boxed = self.scene.geometry.lattice and budget.rays is None
        return "late" in self.plan.on and not boxed

    def __call__(self, budget: Budget) -> dict[str, float]:
        shape = (*map(len, self.places), budget.n_samples)
        self.responses = np.empty(shape, dtype=self.dtype)
        scene, (emitters, listeners), out = self.scene, self.places, self.responses
        # much is made once for an emitter: of two lists, let the shorter one sound
        if 0 < shape[1] < shape[0] and "hardware" not in self.plan.on:
            scene, emitters, listeners = exchanged(scene), listeners, emitters
            out = out.swapaxes(0, 1)

        def work(batch: Batch) -> list[dict[str, float]]:
            where = slice(batch.listeners.start, batch.listeners.stop)
            heard = listeners[where]
            some = emitters[batch.emitters.start : batch.emitters.stop]
            company = Company(some.positions)
            errors = []
            for k, emitter in enumerate(some):
                sound = Sound(scene, emitter, heard, budget, company=company, number=k)
                made = run_plan(scene, self.plan, sound)
                out[batch.emitters[k], where] = made
                errors.append(sampling_errors(sound))
            return errors

        parts = batches(len(emitters), len(listeners), self.threads)
        done, found, weights = 0, list[dict[str, float]](), list[int]()
        made = in_threads(work, parts, self.threads)
        for batch, errors in zip(parts, made, strict=True):
            found += errors
            weights += [len(batch.listeners)] * len(errors)
            done += len(batch)
            if self.tell is not None:
                self.tell(done, shape[0] * shape[1])
        kinds = found[0] if found else {}
        self.errors = {
            kind: float(np.average([one[kind] for one in found], weights=weights))
            for kind in kinds
        }
        return self.errors


@lru_cache(maxsize=8)
def exchanged(scene: Scene) -> Scene:
    """Return the scene with the patterns exchanged, the same object if equal."""
    if scene.emitter_gain == scene.listener_gain:
        return scene
    return replace(
        scene, emitter_gain=scene.listener_gain, listener_gain=scene.emitter_gain
    )


def run_plan(scene: Scene, plan: EffectPlan, sound: Sound) -> FloatArray:
    """Apply the effects that are on, and render: shape (listeners, n_samples)."""
    from rooms.effects import EFFECTS
    from rooms.synthesis import render

    for name in plan.on:
        EFFECTS[name].apply(scene, sound)
    for change in sound.arrival_changes:
        sound.arrivals = [change(arrivals) for arrivals in sound.arrivals]
    return render(sound)
