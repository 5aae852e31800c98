"""Measure how short a plan of pairs is, and how long planning takes.

Bar: travel at most 1.05 times the best of 100,000 random starts; 200 poses among 20
boxes planned in 2 s.
"""

import sys
import time
from collections.abc import Sequence

import numpy as np

from harness import make_parser, write_results
from rigs.planning.envelope import Envelope, KeepOut
from rigs.planning.order import visiting_order
from rigs.planning.paths import Roadmap


def random_restarts(a: np.ndarray, b: np.ndarray, count: int, seed: int) -> float:
    """Return the best travel of random orders, each improved by 2-opt descent."""
    rng = np.random.default_rng(seed)
    ends = np.concatenate([a, b])
    lengths = np.linalg.norm(ends[:, None] - ends[None], axis=-1)
    n = len(a)
    node = np.arange(2 * n)
    begin = np.where(node % 2, node // 2 + n, node // 2)
    finish = np.where(node % 2, node // 2, node // 2 + n)
    between = lengths[np.ix_(finish, begin)] + lengths[np.ix_(begin, finish)]
    swaps = 2.0 * float(np.linalg.norm(a - b, axis=1).sum())
    return _best_of(between, n, count, int(rng.integers(2**31))) + swaps


def _best_of(between: np.ndarray, n: int, count: int, seed: int) -> float:
    from numba import njit

    @njit(cache=False)
    def search(between, n, count, seed):
        np.random.seed(seed)  # noqa: NPY002
        best = 1e300
        for _ in range(count):
            tour = np.random.permutation(n) * 2 + np.random.randint(0, 2, n)  # noqa: NPY002
            better = True
            while better:
                better = False
                for i in range(n):
                    for j in range(i, n):
                        old = 0.0
                        new = 0.0
                        if i > 0:
                            old += between[tour[i - 1], tour[i]]
                            new += between[tour[i - 1], tour[j] ^ 1]
                        if j < n - 1:
                            old += between[tour[j], tour[j + 1]]
                            new += between[tour[i] ^ 1, tour[j + 1]]
                        if new < old - 1e-12:
                            tour[i : j + 1] = tour[i : j + 1][::-1].copy() ^ 1
                            better = True
            total = 0.0
            for k in range(n - 1):
                total += between[tour[k], tour[k + 1]]
            best = min(best, total)
        return best

    return float(search(between, n, count, seed))


def plan_room(seed: int) -> tuple[float, int]:
    """Plan 200 poses among 20 boxes; return CPU seconds and unreachable ways."""
    rng = np.random.default_rng(seed)
    lows = rng.uniform([0, 0, 0], [9, 7, 1], (20, 3))
    boxes = [KeepOut(str(k), p, p + rng.uniform(0.2, 1, 3)) for k, p in enumerate(lows)]
    envelope = Envelope([0, 0, 0], [10, 8, 3], boxes, 0.15)
    points = rng.uniform(envelope.low, envelope.high, (2000, 3))
    points = points[envelope.contains(points)][:200]
    began = time.process_time()
    lengths = Roadmap(envelope).distances
    visits = visiting_order(
        points[:100], points[100:], rng=rng, emitter=lengths, listener=lengths
    )
    seconds = time.process_time() - began
    return seconds, int(not np.isfinite(visits.travel))


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "rig_planning")
    options = parser.parse_args(argv)
    restarts, layouts = (300, 1) if options.quick else (100_000, 3)
    ratios = []
    for seed in range(layouts):
        a, b = np.random.default_rng(seed).uniform(0, [4.2, 3.4, 2], (2, 20, 3))
        ours = visiting_order(a, b, rng=np.random.default_rng(seed)).travel
        best = random_restarts(a, b, restarts, seed)
        ratios.append(ours / best)
        print(f"20 pairs: {ours:.3f} m, best of {restarts} restarts {best:.3f} m")
    plan_room(99)
    times = [plan_room(seed) for seed in range(1 if options.quick else 5)]
    slowest = max(seconds for seconds, _ in times)
    print(f"travel / best: {max(ratios):.4f} at most; bar 1.05")
    print(f"200 poses, 20 boxes: {slowest:.2f} CPU s at most; bar 2")
    report = {"ratios": ratios, "restarts": restarts, "plans": times}
    write_results(options.out, report)
    return 0


if __name__ == "__main__":
    sys.exit(main())
