"""How finely to compute what a plan needs: no finer than its tolerance asks for."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from rir import Poses
from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.effects import EFFECTS, Tolerance
from rooms.effects.traced import POOL_RAYS, pool_of, with_tail
from rooms.effort import (
    decay_parameters,
    listed_energy,
    sampling_errors,
    spread_errors,
)
from rooms.mean_decay import grid_until, images_until
from rooms.places import random_places
from rooms.predict import scattered_share
from rooms.scene import Scene
from rooms.sound import Budget, Sound, Work

__all__ = ["choose_work", "mixed_error"]

_RAYS_SHARE = 0.2
"""What part of the tolerance the rays' chance may take, as a standard error: the worst
octave of a few pairs strays by five of them (benchmarks/planner_honesty)."""

_PILOT_RAYS, _PILOT_PLACES = 1000, 4
"""Rays and places of a trial trace: its own standard error is known to a third."""

_FEWEST_RAYS, _MOST_RAYS = 500, 20_000
"""Fewer than this and decays are biased where energies are clipped at zero; the most
are those of `rooms.effects.traced`."""

_CHANCE = 0.5
"""What part of the tolerance the chance of the most rays may take, as a standard error,
before two plans agree only if they trace the same rays."""

_DECAY_TOLD = 1 / 3
"""Share of the decay time after 20 dB: sound that is mixed before has told half of the
30 dB that T30 looks at."""

_COARSE_CELLS, _COARSE_MOMENTS = 6.0, 4
"""What is coarse: waves 2 % slower along axes than across them at the end of the grid,
and pulses exact to -40 dB. Neither moves the mean level of an octave by 0.1 dB."""

_STEPPED_DB, _STEPPED_PERCENT = 2.0, 20.0
"""Coarse cells are taken from these tolerances of C50 [dB] and EDT [%] on: walls that
do not run along the cells turn into steps, which move them by 0.6 dB and 5 to 12 % in
the lowest octave."""

_CELLS = 32
"""Directions along the edge of a cube: 2° from the nearest, so that gains of third
order are exact to -28 dB for a single image."""

_COARSE_DB = 0.4
"""Coarse steps are taken from this tolerance of level and clarity on [dB]: four times
what they move."""

_MIXED_SHARE = 0.2
"""What part of the tolerance a common tail may take, as a standard error of places."""

_MIXED = (0.032, 0.048, 0.064, 0.1, 0.152, 0.2, 0.3, 0.4)
"""Times from which sound may count as mixed [s]: whole steps of a trace."""


def choose_work(
    scene: Scene, budget: Budget, tolerance: Tolerance, on: Sequence[str]
) -> Work:
    """Return the coarsest work that keeps the tolerance.

    Parameters
    ----------
    scene : Scene
        What is to be simulated.
    budget : Budget
        Length and rate; orders and rays that it states are taken as they are.
    tolerance : Tolerance
        Largest errors allowed.
    on : sequence of str
        Effects that are on.
    """
    coarse = min(tolerance.level_db, tolerance.clarity_db) >= _COARSE_DB
    boxed = scene.geometry.lattice and budget.rays is None
    stepped = (
        tolerance.clarity_db >= _STEPPED_DB
        and tolerance.early_decay_percent >= _STEPPED_PERCENT
    )
    until = np.inf
    if boxed and "specular" in on:
        until = images_until(scene, budget, tolerance)
    mixed, rays = np.inf, None
    if not boxed and "late" in on and budget.rays is None:
        mixed, rays = _traced(scene, budget, tolerance, tuple(on))
    return Work(
        rays=rays,
        images_until=until,
        traced_until=mixed,
        grid_until=(grid_until(scene, budget, tolerance) if "modes" in on else np.inf),
        cells_per_wave=_COARSE_CELLS if stepped else Work.cells_per_wave,
        moments=_COARSE_MOMENTS if coarse else Work.moments,
        directions=_CELLS if coarse else Work.directions,
    )


def _traced(
    scene: Scene, budget: Budget, tolerance: Tolerance, on: tuple[str, ...]
) -> tuple[float, int]:
    """Return until when pairs are traced [s], and with how many rays.

    Where even the most rays leave much to chance, nothing is saved: a plan would differ
    from the finest by chance alone.
    """
    mixed = _traced_until(scene, budget, tolerance, on)
    wanted = _wanted(scene, budget, tolerance, on, mixed)
    if wanted > _MOST_RAYS * (_CHANCE / _RAYS_SHARE) ** 2:
        mixed = np.inf
    return mixed, int(np.clip(wanted, _FEWEST_RAYS, _MOST_RAYS))


def _wanted(
    scene: Scene,
    budget: Budget,
    tolerance: Tolerance,
    on: tuple[str, ...],
    mixed: float,
) -> float:
    """Return the rays a trial says are needed: errors fall with their root."""
    size = budget.sample_rate, budget.n_samples, budget.max_order
    errors = _trial(scene, *size, on, mixed)
    if mixed >= min(budget.duration, _DECAY_TOLD * float(scene.eyring_t60().max())):
        # the end of a decay that mirrors carry comes by few rays, which a trial misses
        share = scattered_share(scene, budget.duration) if "scattering" in on else 0.0
        few = max(share, _FEWEST_RAYS / _MOST_RAYS) ** -0.5
        pool = _pool_errors(scene, *size, on)
        for kind in ("reverberation_percent", "early_decay_percent"):
            error = max(errors.get(kind, 0.0), pool.get(kind, 0.0))
            errors = errors | {kind: few * error}
    return _PILOT_RAYS * tolerance.excess(errors, _RAYS_SHARE) ** 2


@lru_cache(maxsize=32)
def _trial(
    scene: Scene,
    sample_rate: int,
    n_samples: int,
    max_order: int | None,
    on: tuple[str, ...],
    mixed: float,
) -> dict[str, float]:
    """Return the errors of a trace with few rays between a few random places."""
    try:
        places = random_places(scene, _PILOT_PLACES, np.random.default_rng(0))
    except SceneError:
        return {"level_db": np.inf}
    work = Work(traced_until=mixed)
    budget = Budget(sample_rate, n_samples, max_order, _PILOT_RAYS, work=work)
    sound = Sound(scene, places[0], places[1:], budget)
    for name in on:
        EFFECTS[name].apply(scene, sound)
    return sampling_errors(sound)


@lru_cache(maxsize=32)
def _pool_errors(
    scene: Scene,
    sample_rate: int,
    n_samples: int,
    max_order: int | None,
    on: tuple[str, ...],
) -> dict[str, float]:
    """Return what a trial between many pairs would say; empty if none are free."""
    try:
        pairs = _pool_pairs(scene, sample_rate, n_samples, max_order, on)
    except SceneError:
        return {}
    energy, error, paths, step, arrival = pairs
    heard = scene.bands < sample_rate / 2
    heard[0] = True
    energy, error, paths = (part[:, heard] for part in (energy, error, paths))
    scale = (POOL_RAYS / _PILOT_RAYS) ** 0.5
    found = spread_errors(energy, error, paths, step, arrival)
    return {kind: scale * value for kind, value in found.items()}


def _traced_until(
    scene: Scene, budget: Budget, tolerance: Tolerance, on: tuple[str, ...]
) -> float:
    """Return from when on the places of a room may share one tail [s]."""
    size = budget.sample_rate, budget.n_samples, budget.max_order
    for until in (t for t in _MIXED if t < budget.duration):
        errors = mixed_error(scene, *size, on, until)
        if not np.isfinite(errors["level_db"]):
            return np.inf  # no free places to tell by
        if tolerance.excess(errors, _MIXED_SHARE) <= 1:
            return until
    return np.inf


@lru_cache(maxsize=64)
def mixed_error(
    scene: Scene,
    sample_rate: int,
    n_samples: int,
    max_order: int | None,
    on: tuple[str, ...],
    until: float,
) -> dict[str, float]:
    """Return how far places stray that share their late sound, as a standard error.

    Parameters
    ----------
    scene : Scene
        A mesh.
    sample_rate, n_samples, max_order : int
        Of the budget.
    on : tuple of str
        Effects that are on.
    until : float
        From when the sound is shared [s].
    """
    try:
        pairs = _pool_pairs(scene, sample_rate, n_samples, max_order, on)
    except SceneError:
        return {"level_db": np.inf}
    energy, error, paths, step, arrival = pairs
    count = round(until / step)
    shared = with_tail(energy[..., :count], energy.mean(axis=0))
    heard = scene.bands < sample_rate / 2
    heard[0] = True
    own, common = (
        decay_parameters(part + paths, step, arrival)[:, :, heard]
        for part in (energy, shared)
    )
    # what rays stray by is no difference between places
    late = np.where(np.arange(energy.shape[-1]) < count, 0.0, error)
    chance = spread_errors(shared, late, paths, step, arrival)
    stray = common - own
    with np.errstate(invalid="ignore", divide="ignore"):
        stray[2:] *= 100 / own[2:]
        worst = np.sqrt(np.nanmax(np.nanmean(stray**2, axis=1), axis=1))
    found = dict(zip(chance, worst.tolist(), strict=True))
    return {
        kind: float(np.sqrt(max(np.nan_to_num(value) ** 2 - chance[kind] ** 2, 0.0)))
        for kind, value in found.items()
    }


_Pairs = tuple[FloatArray, FloatArray, FloatArray, float, FloatArray]


@lru_cache(maxsize=8)
def _pool_pairs(
    scene: Scene,
    sample_rate: int,
    n_samples: int,
    max_order: int | None,
    on: tuple[str, ...],
) -> _Pairs:
    """Return energies, errors and paths of a pool's pairs, the step, and arrivals."""
    budget = Budget(sample_rate, n_samples, max_order, _PILOT_RAYS)
    first = _with_paths(scene, budget, on, random_places(scene, 2, _rng()))
    pool = pool_of(scene, first)
    step, bins = pool.histogram.time_step, pool.histogram.energy.shape[-1]
    paths, arrivals = [], []
    for emitter in pool.emitters:
        ends = Poses.of([emitter, *pool.listeners])
        listed, arrival = listed_energy(
            _with_paths(scene, budget, on, ends), step, bins
        )
        paths.append(listed)
        arrivals.append(arrival)
    times = step * (np.arange(bins) + 0.5)
    fade = np.exp(-np.outer(scene.air_loss, times) * scene.speed_of_sound)
    energy, error = (
        part.reshape(-1, *part.shape[2:]) * fade
        for part in (pool.histogram.energy, pool.histogram.error)
    )
    return energy, error, np.concatenate(paths) * fade, step, np.concatenate(arrivals)


def _rng() -> np.random.Generator:
    return np.random.default_rng(0)


def _with_paths(
    scene: Scene, budget: Budget, on: tuple[str, ...], ends: Poses
) -> Sound:
    """Return all that is listed from the first place to the others."""
    sound = Sound(scene, ends[0], ends[1:], budget)
    for name in on:
        if name != "late":
            EFFECTS[name].apply(scene, sound)
    return sound
