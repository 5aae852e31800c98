"""Measure what thousands of responses cost: time and memory, threads and processes.

Five emitters and 5000 listeners, responses of 0.5 s at 16 kHz, in a kitchen, an
L-shaped and two coupled rooms, as planned by default. Planning and what a scene needs
once are timed apart; the time of a response is that of whole batches of pairs (5 x 128
by default, what `simulate` works on at a time), of which there are as many as the
pairs ask for. Peak memory is that of the process: the answer of all pairs comes to it.
Threads share batches, so two threads are given two. Processes are those of
`make-dataset --workers 2` and of a Dask cluster of two workers on this machine, their
start and the file included.

Bar: 25,000 responses of the kitchen in 5 minutes, of the others in 60, on one core.
"""

import resource
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir import Poses
from rooms import EffectPlan, Scene, plan_effects, simulate
from rooms.builtin import load_scene
from rooms.places import random_places

SCENES = ("kitchen", "l-shaped", "coupled")
RATE, DURATION = 16000, 0.5
EMITTERS, LISTENERS = 5, 5000


def compute(
    scene: Scene, plan: EffectPlan, places: Poses, emitters: int, threads: int
) -> tuple[float, float]:
    """Return processor and wall seconds of all responses between some places."""
    cpu, wall = time.process_time(), time.perf_counter()
    simulate(
        scene,
        places[:emitters],
        places[emitters:],
        sample_rate=RATE,
        duration=DURATION,
        plan=plan,
        threads=threads,
        dtype=np.float32,
    )
    return time.process_time() - cpu, time.perf_counter() - wall


def measure(name: str, emitters: int, listeners: int) -> dict[str, float]:
    """Return milliseconds of a response, seconds of all, and the peak of memory."""
    start = time.process_time()
    scene = load_scene(name)
    plan = plan_effects(scene, sample_rate=RATE, duration=DURATION)
    places = random_places(scene, emitters + 2 * listeners, np.random.default_rng(0))
    compute(scene, plan, places[:3], 1, 1)
    once = time.process_time() - start
    pairs = emitters * listeners
    cpu, alone = compute(scene, plan, places[: emitters + listeners], emitters, 1)
    both, shared = compute(scene, plan, places, emitters, 2)
    return {
        "once_s": once,
        "cpu_ms": 1000 * cpu / pairs,
        "all_s": once + cpu / pairs * EMITTERS * LISTENERS,
        "wall_ms": 1000 * alone / pairs,
        "cpu_ms_2_threads": 1000 * both / (2 * pairs),
        "wall_ms_2_threads": 1000 * shared / (2 * pairs),
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def by_processes(name: str, emitters: int, listeners: int, scheduler: bool) -> float:
    """Return wall milliseconds of a response on two processes, start included."""
    import tempfile
    from pathlib import Path

    from rooms.factory import Recipe, make_dataset

    recipe = Recipe(
        name, RATE, DURATION, emitters=emitters, unseen=0, listeners=2 * listeners
    )
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "made.h5"
        start = time.perf_counter()
        if scheduler:
            from distributed import LocalCluster

            cluster: Any = LocalCluster(n_workers=2, threads_per_worker=1)
            with cluster:
                make_dataset(recipe, target, scheduler=cluster.scheduler_address)
        else:
            make_dataset(recipe, target, workers=2)
        return 1000 * (time.perf_counter() - start) / (2 * emitters * listeners)


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "simulation_scale", "2 x 4 pairs, one process")
    parser.add_argument("--emitters", type=int, default=EMITTERS)
    parser.add_argument("--listeners", type=int, default=128)
    parser.add_argument(
        "--processes", action="store_true", help="two workers, and Dask"
    )
    options = parser.parse_args(argv)
    ends = (2, 4) if options.quick else (options.emitters, options.listeners)
    found: dict[str, Any] = {}
    for name in SCENES[:1] if options.quick else SCENES:
        part = measure(name, *ends)
        if options.processes:
            part["wall_ms_2_processes"] = by_processes(name, *ends, False)
            part["wall_ms_2_dask_workers"] = by_processes(name, *ends, True)
        found[name] = part
        told = ", ".join(f"{key} {value:.3g}" for key, value in part.items())
        print(f"{name}: {told} ({ends[0]} x {ends[1]} of {EMITTERS} x {LISTENERS})")
    write_results(options.out, found)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
