"""Compare a staged room below 300 Hz with the wave equation: another kind of model.

A hall of 14 x 8 x 5 m with a proscenium, reflectors that hang before it and a balcony,
all boxes in a box: the engine of paths, panels, edges and rays as it is planned, and
the same with nothing but paths and rays, against a grid on which the walls are all
there is. Places are in the stalls, under the balcony and on it. Walls react locally on
the grid and scatter nothing; so the room scatters little here. Means over pairs, with
the standard error of what pairs differ by: single modes are in the grid alone.

Bar: level 1 dB and C80 1 dB in the mean of each octave, beyond two standard errors.
"""

import time
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from furnished_kitchen import LOW, RATE, low_truth, split
from harness import make_parser, write_results
from rir.physics import decibels
from rir.room import RoomSpec
from rooms import Scene, plan_effects, simulate

DURATION = 0.5  # s, as the grid's truth is long
ROOM: dict[str, Any] = {
    "name": "staged room",
    "size_m": [14.0, 8.0, 5.0],
    "surfaces": {
        "all": {"absorption": 0.12, "scattering": 0.05},
        "floor": {"absorption": 0.25, "scattering": 0.1},
        "x1": {"absorption": 0.3, "scattering": 0.1},
    },
    "furniture": [
        {"name": name, "low": low, "high": high, "absorption": share, "scattering": 0.1}
        for name, low, high, share in (
            ("pier", [4.0, 0.0, 0.0], [4.5, 1.5, 5.0], 0.12),
            ("other pier", [4.0, 6.5, 0.0], [4.5, 8.0, 5.0], 0.12),
            ("beam", [4.0, 1.5, 4.0], [4.5, 6.5, 5.0], 0.12),
            ("reflector", [5.0, 1.2, 3.7], [7.0, 3.7, 3.9], 0.08),
            ("other reflector", [5.0, 4.3, 3.7], [7.0, 6.8, 3.9], 0.08),
            ("balcony", [11.5, 0.0, 2.3], [14.0, 8.0, 2.6], 0.2),
        )
    ],
}
EMITTERS = [[2.2, 3.4, 1.5], [3.1, 5.1, 1.6]]
LISTENERS = {
    "stalls": [[7.1, 2.2, 1.3], [8.3, 4.6, 1.2], [9.2, 6.3, 1.2], [10.1, 3.1, 1.3]],
    "under the balcony": [[12.1, 2.0, 1.3], [12.6, 4.3, 1.2], [12.9, 6.6, 1.4]],
    "on the balcony": [[12.0, 2.7, 3.8], [12.7, 4.9, 3.7], [12.3, 6.7, 3.8]],
}


def measured(responses: np.ndarray, arrival: np.ndarray) -> np.ndarray:
    """Return level and C80 [dB], shape (2, E, L, bands)."""
    energy = responses**2
    late = np.arange(energy.shape[-1]) / RATE >= arrival[..., None, None] + 0.08
    after = np.where(late, energy, 0.0).sum(axis=-1)
    total = energy.sum(axis=-1)
    return np.stack([decibels(total), decibels((total - after) / after)])


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "staged_room", "one pair on a coarse grid")
    options = parser.parse_args(argv)
    quick, start = options.quick, time.process_time()
    scene = Scene.from_room(RoomSpec(**ROOM))
    places = np.array([p for some in LISTENERS.values() for p in some])
    kinds = np.array([k for k, some in LISTENERS.items() for _ in some])
    emitters = np.array(EMITTERS)
    if quick:
        emitters, places, kinds = emitters[:1], places[:1], kinds[:1]
    fixed: dict[str, Any] = {"sample_rate": RATE, "duration": DURATION}
    gap = np.linalg.norm(places[None] - emitters[:, None], axis=-1)
    arrival = gap / scene.speed_of_sound
    ends = SimpleNamespace(positions=emitters), SimpleNamespace(positions=places)
    truth = measured(low_truth(scene, ends, 6.0 if quick else 12.0), arrival)
    print(f"grid {time.process_time() - start:.1f} CPU s", flush=True)
    plan = plan_effects(scene, without=["modes"], **fixed)
    print("on:", ", ".join(plan.on))
    bare = ["direct", "specular", "scattering", "late", "furniture"]
    rows = []
    for name, chosen in (("as planned", plan.on), ("paths and rays", bare)):
        runs = [
            simulate(scene, emitters, places, effects=chosen, seed=seed, **fixed)
            for seed in range(1 if quick else 4)
        ]
        got = [measured(split(run.responses, LOW), arrival) for run in runs]
        off = np.mean(got, axis=0) - truth
        for kind in ("all places", *dict.fromkeys(kinds)):
            some = off[:, :, (kinds == kind) | (kind == "all places")]
            mean = some.mean(axis=(1, 2))
            spread = some.std(axis=(1, 2)) / np.sqrt(some[0, ..., 0].size)
            for row, *values in zip(("level", "C80"), mean, spread, strict=True):
                print(
                    f"{name:15s} {kind:18s} {row:5s} [dB]:"
                    + "".join(
                        f"  {low:g}-{high:g} Hz {m:+.2f} ± {s:.2f}"
                        for (low, high), m, s in zip(LOW, *values, strict=True)
                    ),
                    flush=True,
                )
                rows.append(
                    {"model": name, "places": kind, "kind": row}
                    | {"mean_db": values[0].tolist(), "se_db": values[1].tolist()}
                )
    print(f"{time.process_time() - start:.1f} CPU s")
    write_results(options.out, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
