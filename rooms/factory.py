"""Make simulated data sets: block by block, resumable, the same on any workers."""

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import DatasetWriter, Poses
from rir.errors import ConfigError, DatasetError
from rir.optional import require
from rooms.batches import Batch
from rooms.builtin import load_scene
from rooms.layout import Layout, paper_layout, with_gains
from rooms.plan import EffectPlan, plan_effects
from rooms.request import make_budget
from rooms.scene import Scene
from rooms.simulation import simulate
from rooms.stated_errors import stated_errors
from rooms.transport import LATE_MODEL

__all__ = ["Recipe", "make_dataset"]

_Tell = Callable[[int, int], None]


@dataclass(frozen=True)
class Recipe:
    """Everything that decides a data set; plain values, so that workers agree.

    Parameters
    ----------
    scene : str
        Name or path; see `rooms.builtin.load_scene`.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Length of the responses [s].
    emitters, unseen, listeners, gains, fewer
        See `rooms.layout.paper_layout`.
    max_order, rays : int or None
        See `rooms.simulation`.
    seed : int
        Key of the places and of everything random.
    """

    scene: str
    sample_rate: int = 16000
    duration: float = 0.1
    emitters: int = 5
    unseen: int = 10
    listeners: int = 5000
    gains: str = "same"
    fewer: int = 1
    max_order: int | None = None
    rays: int | None = None
    seed: int = 0

    def layout(self, scene: Scene) -> Layout:
        """Return the places and patterns."""
        return paper_layout(
            scene,
            emitters=self.emitters,
            unseen=self.unseen,
            listeners=self.listeners,
            gains=self.gains,
            fewer=self.fewer,
            seed=self.seed,
        )

    def open(self) -> "PreparedRecipe":
        """Return scene, layout and plan, ready to compute blocks."""
        scene = load_scene(self.scene)
        layout = self.layout(scene)
        scene = with_gains(scene, layout)
        plan = plan_effects(
            scene,
            sample_rate=self.sample_rate,
            duration=self.duration,
            max_order=self.max_order,
            rays=self.rays,
        )
        return PreparedRecipe(self, scene, layout, plan)

    @property
    def key(self) -> str:
        """Short digest that tells two recipes apart, and two models of late sound."""
        text = json.dumps({**vars(self), "late_model": LATE_MODEL}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class PreparedRecipe:
    """A recipe with all that is computed from it once per worker."""

    recipe: Recipe
    scene: Scene
    layout: Layout
    plan: EffectPlan

    @property
    def errors(self) -> dict[str, dict[str, float]]:
        """Standard errors by cause and kind, but for the chance of rays."""
        recipe = self.recipe
        budget = make_budget(
            recipe.sample_rate, recipe.duration, recipe.max_order, recipe.rays
        )
        parts = stated_errors(self.scene, self.plan, budget, {})
        return {cause: part for cause, part in parts.items() if cause != "sampling"}

    def responses(self, block: Batch) -> NDArray[np.float32]:
        """Return the responses of one block, (emitters, listeners, n_samples)."""
        recipe, layout = self.recipe, self.layout
        result = simulate(
            self.scene,
            _some(layout.emitters, block.emitters),
            _some(layout.listeners, block.listeners),
            sample_rate=recipe.sample_rate,
            duration=recipe.duration,
            max_order=recipe.max_order,
            rays=recipe.rays,
            seed=recipe.seed,
            plan=self.plan,
            dtype=np.float32,
        )
        return np.asarray(result.responses, dtype=np.float32)


def _some(places: Poses, rows: range) -> Poses:
    return places[rows.start : rows.stop]


_BENCHES: dict[Recipe, PreparedRecipe] = {}
"""Benches of this process: a worker opens each recipe once."""


def compute_block(recipe: Recipe, folder: str, index: int) -> int:
    """Compute one block into the folder, unless it is there; return its index."""
    path = _part(Path(folder), index)
    if not path.exists():
        bench = _BENCHES.get(recipe)
        if bench is None:
            bench = _BENCHES[recipe] = recipe.open()
        block = bench.layout.blocks()[index]
        partial_path = path.with_suffix(f".{os.getpid()}.partial")
        with partial_path.open("wb") as stream:
            np.save(stream, bench.responses(block))
            stream.flush()
            os.fsync(stream.fileno())
        partial_path.replace(path)
    return index


def _part(folder: Path, index: int) -> Path:
    return folder / f"block-{index:06d}.npy"


def make_dataset(
    recipe: Recipe,
    path: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    tell: _Tell | None = None,
) -> Path:
    """Make a data set, or go on with one that was interrupted.

    Finished blocks lie beside the file until all are there; then they are joined.
    A block depends on the recipe alone, so the bytes of the file do not depend on
    the number of workers, their order, or how often the work was interrupted.

    Parameters
    ----------
    recipe : Recipe
        What to make.
    path : path
        The file; ends in .h5.
    workers : int
        Processes on this machine.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work instead; they must
        see the same file system.
    tell : callable, optional
        Told (blocks done, blocks in all) now and then.

    Raises
    ------
    ConfigError
        If there is no worker.
    DatasetError
        If the file exists already.
    """
    if workers < 1:
        raise ConfigError(f"the number of workers must be 1 or more, not {workers}")
    target = Path(path)
    if target.exists():
        raise DatasetError(f"{target} exists; remove it or choose another name")
    bench = recipe.open()
    blocks = bench.layout.blocks()
    folder = target.with_name(f".{target.stem}-{recipe.key}.parts").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    missing = [k for k in range(len(blocks)) if not _part(folder, k).exists()]
    work = partial(compute_block, recipe, str(folder))
    done = len(blocks) - len(missing)
    for _ in _carry_out(work, missing, workers, scheduler):
        done += 1
        if tell is not None:
            tell(done, len(blocks))
    _join(bench, blocks, folder, target)
    return target


def _carry_out(
    work: Callable[[int], int],
    missing: list[int],
    workers: int,
    scheduler: str | None,
) -> Iterable[int]:
    if scheduler is not None:
        return _on_cluster(work, missing, scheduler)
    if workers == 1:
        return map(work, missing)
    return _on_processes(work, missing, workers)


def _on_processes(
    work: Callable[[int], int], missing: list[int], workers: int
) -> Iterator[int]:
    from multiprocessing import get_context

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(work, missing)


def _on_cluster(
    work: Callable[[int], int], missing: list[int], scheduler: str
) -> Iterator[int]:
    """Yield blocks as a Dask cluster finishes them; lost workers are made up for."""
    distributed = require("distributed", why="--scheduler")
    with distributed.Client(scheduler) as client:
        futures = client.map(work, missing, retries=5, pure=False)
        for future in distributed.as_completed(futures):
            yield future.result()


def _join(
    bench: PreparedRecipe, blocks: list[Batch], folder: Path, target: Path
) -> None:
    """Write all blocks into the final file, emitter by emitter, and remove them.

    The file appears when it is whole: who is killed meanwhile joins again.
    """
    recipe, layout = bench.recipe, bench.layout
    plan = {name: verdict.on for name, verdict in bench.plan.verdicts.items()}
    parts = [np.load(_part(folder, k), mmap_mode="r") for k in range(len(blocks))]
    with DatasetWriter(
        target,
        sample_rate=recipe.sample_rate,
        n_samples=parts[0].shape[-1],
        simulated=True,
        session=f"{bench.scene.name}-{recipe.key}",
        room_name=bench.scene.name,
        metadata={
            "recipe": vars(recipe),
            "effects": plan,
            "error_parts": bench.errors,
            "late_model": LATE_MODEL,
        },
        emitter_gain=layout.emitter_gain,
        listener_gain=layout.listener_gain,
    ) as out:
        for emitter in range(len(layout.emitters)):
            for block, part in zip(blocks, parts, strict=True):
                if emitter in block.emitters:
                    rows = part[block.emitters.index(emitter)]
                    out.append(rows, *_columns(layout, emitter, block.listeners))
    shutil.rmtree(folder)


def _columns(
    layout: Layout, emitter: int, listeners: range
) -> tuple[Poses, Poses, dict[str, Any]]:
    """Return the places of an emitter's rows, and what else is told of them."""
    count = len(listeners)
    columns = {
        "split": np.full(count, "train" if emitter < layout.training else "test"),
        "emitter_no": np.full(count, emitter),
        "listener_no": np.arange(listeners.start, listeners.stop),
    }
    here = layout.emitters[np.full(count, emitter)]
    return here, _some(layout.listeners, listeners), columns
