"""Measure what thousands of responses cost: time and memory, threads and processes.

Five emitters and 5000 listeners, responses of 0.5 s at 16 kHz, in a kitchen, an
L-shaped and two coupled rooms, as planned by default. A stated share of the pairs is
computed (5 x 200 by default) and stated in proportion: each listener is traced and
rendered on its own, and what an emitter shares with all of its listeners is counted
with the few, so that the whole is rather overstated. Peak memory is that of the
process. Threads share the listeners of an emitter; processes share blocks of pairs,
as `make-dataset --workers` and Dask do.

Bar: 25,000 responses of the kitchen in 5 minutes, of the others in 60, on one core.
"""

import resource
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rooms import plan_effects, simulate
from rooms.builtin import load_scene
from rooms.places import random_places

SCENES = ("kitchen", "l-shaped", "coupled")
RATE, DURATION = 16000, 0.5
EMITTERS, LISTENERS = 5, 5000


def compute(scene_name: str, emitters: int, listeners: int, threads: int) -> float:
    """Return wall seconds of all responses between some places."""
    scene = load_scene(scene_name)
    places = random_places(scene, emitters + listeners, np.random.default_rng(0))
    plan = plan_effects(scene, sample_rate=RATE, duration=DURATION)
    run: dict[str, Any] = {"sample_rate": RATE, "duration": DURATION, "plan": plan}
    simulate(scene, places[:1], places[1:3], **run)
    start = time.perf_counter()
    simulate(
        scene,
        places[:emitters],
        places[emitters:],
        threads=threads,
        dtype=np.float32,
        **run,
    )
    return time.perf_counter() - start


def measure(scene_name: str, emitters: int, listeners: int) -> dict[str, float]:
    """Return milliseconds of a response, hours of all, and the peak of memory."""
    cpu = time.process_time()
    walls = [compute(scene_name, emitters, listeners, n) for n in (1, 2)]
    spent = (time.process_time() - cpu) / 2
    pairs = emitters * listeners
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {
        "cpu_ms": 1000 * spent / pairs,
        "wall_ms_1_thread": 1000 * walls[0] / pairs,
        "wall_ms_2_threads": 1000 * walls[1] / pairs,
        "all_s": spent / pairs * EMITTERS * LISTENERS,
        "peak_mb": peak,
    }


def by_processes(scene_name: str, listeners: int, scheduler: bool) -> float:
    """Return wall milliseconds of a response on two processes."""
    import tempfile
    from pathlib import Path

    from rooms.factory import Recipe, make_dataset

    recipe = Recipe(
        scene_name, RATE, DURATION, emitters=2, unseen=0, listeners=listeners
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
        return 1000 * (time.perf_counter() - start) / (2 * listeners)


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "simulation_scale", "2 x 20 pairs, one process")
    parser.add_argument("--emitters", type=int, default=EMITTERS)
    parser.add_argument("--listeners", type=int, default=200)
    parser.add_argument(
        "--processes", action="store_true", help="two workers, and Dask"
    )
    options = parser.parse_args(argv)
    ends = (1, 6) if options.quick else (options.emitters, options.listeners)
    found: dict[str, Any] = {}
    for name in SCENES[:1] if options.quick else SCENES:
        part = measure(name, *ends)
        if options.processes:
            part["wall_ms_2_processes"] = by_processes(name, ends[1], False)
            part["wall_ms_2_dask_workers"] = by_processes(name, ends[1], True)
        found[name] = part
        told = ", ".join(f"{key} {value:.3g}" for key, value in part.items())
        print(f"{name}: {told} ({ends[0]} x {ends[1]} of {EMITTERS} x {LISTENERS})")
    write_results(options.out, found)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
