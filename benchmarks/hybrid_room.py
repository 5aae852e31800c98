"""Time complete responses of an L-shaped room against pyroomacoustics' hybrid.

Mirror paths to order 3, 100,000 rays, 7 octaves, 0.5 s at 16 kHz, one pair, the tail
included, for several shares of scattering: CPU seconds, interleaved in one process,
best of several.

Bar: 5 times pyroomacoustics' hybrid.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rooms import Scene, simulate

OUTLINE = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
BANDED = [0.10, 0.12, 0.15, 0.20, 0.22, 0.25, 0.30]
RATE, DURATION, ORDER = 16000, 0.5, 3
SCATTERING = (0.0, 0.05, 0.1, 0.3, 0.9)
EMITTER, LISTENER = [1.7, 3.1, 1.4], [5.1, 1.3, 1.9]
EFFECTS = ["scattering", "air", "direct", "specular", "late"]


def our_run(rays: int, scattering: float) -> np.ndarray:
    surfaces = {"absorption": BANDED, "scattering": scattering}
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


def peer_run(rays: int, scattering: float) -> Any:
    import pyroomacoustics as pra

    pra.constants.set("num_threads", 1)
    bands = [125, 250, 500, 1000, 2000, 4000, 8000]
    material = pra.Material({"coeffs": BANDED, "center_freqs": bands}, scattering)
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
    parser = make_parser(__doc__, "hybrid_room", "2,000 rays, one run")
    options = parser.parse_args(argv)
    rays, rounds = (2000, 1) if options.quick else (100_000, 3)
    rows = []
    for scattering in (0.1,) if options.quick else SCATTERING:
        our_run(500, scattering)
        ours, theirs = [], []
        for _ in range(rounds):
            ours.append(cpu_s(lambda s=scattering: our_run(rays, s)))
            theirs.append(cpu_s(lambda s=scattering: peer_run(rays, s)))
        ratio = min(theirs) / min(ours)
        print(
            f"{rays} rays, scattering {scattering}: ours {min(ours):.3f} s,"
            f" peer {min(theirs):.3f} s, x{ratio:.1f}"
        )
        times = {"ours_s": min(ours), "peer_s": min(theirs), "ratio": ratio}
        rows.append({"rays": rays, "scattering": scattering, **times})
    write_results(options.out, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
