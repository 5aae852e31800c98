"""Time complete responses of an L-shaped room against pyroomacoustics' hybrid.

Mirror paths to order 3, 100,000 rays, 7 octaves, scattering 0.1, 0.5 s at 16 kHz,
one pair, the tail included: CPU seconds, interleaved in one process, best of several.
"""

import argparse
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rooms import Scene, simulate

OUTLINE = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
BANDED = [0.10, 0.12, 0.15, 0.20, 0.22, 0.25, 0.30]
RATE, DURATION, ORDER, SCATTERING = 16000, 0.5, 3, 0.1
EMITTER, LISTENER = [1.7, 3.1, 1.4], [5.1, 1.3, 1.9]
EFFECTS = ["scattering", "air", "direct", "specular", "late"]


def our_run(rays: int) -> np.ndarray:
    surfaces = {"absorption": BANDED, "scattering": SCATTERING}
    scene = Scene.extruded(OUTLINE, 3.0, {"all": surfaces})
    return simulate(
        scene,
        EMITTER,
        LISTENER,
        sample_rate=RATE,
        duration=DURATION,
        max_order=ORDER,
        rays=rays,
        effects=EFFECTS,
    ).responses


def peer_run(rays: int) -> Any:
    import pyroomacoustics as pra

    pra.constants.set("num_threads", 1)
    bands = [125, 250, 500, 1000, 2000, 4000, 8000]
    material = pra.Material({"coeffs": BANDED, "center_freqs": bands}, SCATTERING)
    room = pra.Room.from_corners(
        np.array(OUTLINE, dtype=float).T,
        fs=RATE,
        materials=material,
        max_order=ORDER,
        ray_tracing=True,
        air_absorption=True,
    )
    room.extrude(3.0, materials=material)
    room.set_ray_tracing(n_rays=rays, time_thres=DURATION, receiver_radius=0.5)
    room.add_source(EMITTER)
    room.add_microphone(LISTENER)
    room.compute_rir()
    return room.rir


def cpu_s(run: Callable[[], Any]) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="2,000 rays, one run")
    parser.add_argument("--out", default="results/hybrid_room.json")
    options = parser.parse_args(argv)
    rays, rounds = (2000, 1) if options.quick else (100_000, 3)
    our_run(500)
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(cpu_s(lambda: our_run(rays)))
        theirs.append(cpu_s(lambda: peer_run(rays)))
    ratio = min(theirs) / min(ours)
    print(
        f"{rays} rays: ours {min(ours):.3f} s, peer {min(theirs):.3f} s, x{ratio:.1f}"
    )
    path = Path(options.out)
    path.parent.mkdir(parents=True, exist_ok=True)
    report = {"rays": rays, "ours_s": min(ours), "peer_s": min(theirs), "ratio": ratio}
    path.write_text(json.dumps(report, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
