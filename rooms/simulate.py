"""Responses between any emitters and listeners of a scene."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import Poses
from rir.errors import SignalError
from rooms.plan import Plan, plan_effects
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["Simulation", "simulate"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Simulation:
    """Responses with the plan that made them.

    Parameters
    ----------
    responses : ndarray, shape (emitters, listeners, n_samples)
        Amplitude 1/d at distance d; sample 0 is the instant of emission.
    sample_rate : int
        Samples per second [Hz].
    plan : Plan
        Which effects were on, and why.
    errors : dict
        Estimated errors of the result, by metric; empty when not estimated.
    """

    responses: FloatArray
    sample_rate: int
    plan: Plan
    errors: dict[str, float] = field(default_factory=dict)

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
    rng: np.random.Generator | None = None,
    seed: int = 0,
    threads: int = 1,
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
    rng : numpy.random.Generator, optional
        Draws the seed; use it or `seed`.
    seed : int
        Key of everything random.
    threads : int
        Threads that share the listeners.

    Returns
    -------
    Simulation

    Raises
    ------
    SceneError
        If a pose lies outside the room.
    SignalError
        If rate or duration are not positive.

    Examples
    --------
    >>> scene = Scene.shoebox((6, 5, 3), absorption=1.0)
    >>> result = simulate(
    ...     scene, [1, 2, 1.5], [3, 2, 1.5], sample_rate=8000, duration=0.02
    ... )
    >>> result.responses.shape
    (1, 1, 160)
    """
    seed = seed if rng is None else int(rng.integers(2**63))
    budget = make_budget(sample_rate, duration, max_order, rays, seed)
    places = Poses.of(emitters), Poses.of(listeners)
    scene.check_inside("emitter", places[0].positions)
    scene.check_inside("listener", places[1].positions)
    plan = plan_effects(
        scene,
        sample_rate=sample_rate,
        duration=duration,
        max_order=max_order,
        only=effects,
    )
    shape = (len(places[0]), len(places[1]), budget.n_samples)
    responses = np.empty(shape)
    for index, emitter in enumerate(places[0]):
        sound = Sound(scene, emitter, places[1], budget)
        run_plan(scene, plan, sound, threads, responses[index])
    return Simulation(responses, sample_rate, plan)


def make_budget(
    sample_rate: int,
    duration: float,
    max_order: int | None,
    rays: int | None,
    seed: int,
) -> Budget:
    """Return a checked budget."""
    if not (sample_rate > 0 and np.isfinite(sample_rate)):
        raise SignalError(f"sample rate must be positive, not {sample_rate} Hz")
    count = round(duration * sample_rate) if np.isfinite(duration) else 0
    if count < 1:
        raise SignalError(
            f"a duration of {duration} s at {sample_rate} Hz holds no sample"
        )
    return Budget(int(sample_rate), count, max_order, rays, seed)


def run_plan(
    scene: Scene,
    plan: Plan,
    sound: Sound,
    threads: int = 1,
    out: FloatArray | None = None,
) -> FloatArray:
    """Apply the effects that are on, and render: shape (listeners, n_samples)."""
    from rooms.effects import EFFECTS
    from rooms.synthesis import render

    for name in plan.on:
        EFFECTS[name].apply(scene, sound)
    return render(sound, threads, out)
