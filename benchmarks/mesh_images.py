"""Measure the image search in an L-shaped room against pyroomacoustics.

One emitter and 100 listeners; CPU milliseconds per pair for finding the paths, no
responses built, best of interleaved runs in one process. Then the paths of random
pairs in random non-convex rooms are compared with an exhaustive search.

Bar: 20 times pyroomacoustics at order 7, 30 times at order 8; all 1,000 lists of paths
equal.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from exhaustive_paths import (
    list_exhaustively,
    random_places,
    random_room,
)
from harness import make_parser, write_results
from rooms.mesh import MeshGeometry, find_paths

FLOOR = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.5), (3.0, 2.5), (3.0, 5.0), (0.0, 5.0)]
HEIGHT = 3.0
EMITTER = np.array([1.7, 3.1, 1.4])


def peer_room(listeners: np.ndarray, order: int) -> Any:
    import pyroomacoustics as pra

    pra.constants.set("num_threads", 1)
    material = pra.Material(0.2)
    room = pra.Room.from_corners(
        np.array(FLOOR).T, fs=16000, materials=material, max_order=order
    )
    room.extrude(HEIGHT, materials=material)
    room.add_source(EMITTER.tolist())
    room.add_microphone_array(listeners.T)
    return room


def cpu_ms(run: Callable[[], Any]) -> float:
    start = time.process_time()
    run()
    return 1000 * (time.process_time() - start)


def compare(listeners: np.ndarray, order: int, rounds: int) -> dict[str, Any]:
    geometry = MeshGeometry.extruded(FLOOR, HEIGHT)
    ours, theirs, count, peers = [], [], 0, 0
    find_paths(geometry, EMITTER, listeners[:1], max_order=1)
    for _ in range(rounds):
        room = peer_room(listeners, order)
        theirs.append(cpu_ms(room.image_source_model))
        peers = int(room.visibility[0].sum())
        ours.append(
            cpu_ms(lambda: find_paths(geometry, EMITTER, listeners, max_order=order))
        )
        count = len(find_paths(geometry, EMITTER, listeners, max_order=order))
    n = len(listeners)
    return {
        "order": order,
        "ours_ms": min(ours) / n,
        "peer_ms": min(theirs) / n,
        "ratio": min(theirs) / min(ours),
        "paths": count / n,
        "peer_paths": peers / n,
    }


def agree(rooms: int, pairs: int, max_order: int, seed: int) -> dict[str, Any]:
    """Compare path lists with the exhaustive search in random rooms."""
    rng = np.random.default_rng(seed)
    tried = same = total = 0
    for _ in range(rooms):
        geometry = random_room(rng)
        places = random_places(geometry, pairs + 5, rng)
        emitters, listeners = places[:5], places[5:].reshape(5, -1, 3)
        for emitter, group in zip(emitters, listeners, strict=True):
            wanted = list_exhaustively(geometry, emitter, group, max_order)
            found = find_paths(
                geometry, emitter, group, max_order=max_order, direct=False
            )
            for k in range(len(group)):
                a = wanted[wanted[:, 0] == k, 1]
                b = found.length[found.listener == k]
                tried += 1
                total += len(a)
                same += len(a) == len(b) and np.allclose(a, b, rtol=0, atol=1e-8)
    return {"pairs": tried, "equal": int(same), "paths": total, "max_order": max_order}


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "mesh_images", "fewer pairs and orders")
    options = parser.parse_args(argv)
    geometry = MeshGeometry.extruded(FLOOR, HEIGHT)
    count, rounds = (10, 1) if options.quick else (100, 3)
    listeners = random_places(geometry, count, np.random.default_rng(0))
    orders = (3, 5) if options.quick else (3, 5, 7, 8)
    rows = [compare(listeners, order, rounds) for order in orders]
    for row in rows:
        print(
            f"order {row['order']:2d}  ours {row['ours_ms']:8.3f} ms"
            f"  peer {row['peer_ms']:8.3f} ms  x{row['ratio']:.1f}"
            f"  paths {row['paths']:.2f} / {row['peer_paths']:.2f}"
        )
    check = agree(2, 10, 3, 1) if options.quick else agree(20, 50, 5, 1)
    print(
        f"equal to the exhaustive search up to order {check['max_order']}:"
        f" {check['equal']} of {check['pairs']} pairs ({check['paths']} paths)"
    )
    write_results(options.out, {"rows": rows, "exhaustive": check})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
