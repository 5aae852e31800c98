"""Count how often the report's 95 % intervals hold the truth.

A large population of pairs is made once; sessions of 10 to 40 pairs are drawn from it,
and the intervals of the mean paired distance, the mean un-paired distance and their
ratio are compared with those of the whole population.

Bar: each interval holds the value of its population in 93 to 97 % of 1,000 sessions.
"""

import time
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from analysis.reciprocity import distance_matrix
from analysis.statistics import estimate_mean, ratio_of_means
from hard_cases.trials import TrialBox, trial_session
from harness import make_parser, write_results

FloatArray = NDArray[np.float64]
SYMBOLS = ("C50", "EDT", "Env")


def box_population(n_pairs: int, symbol: str, rng: np.random.Generator) -> FloatArray:
    """Return all distances of simulated pairs, (2 n_pairs, 2 n_pairs)."""
    box = TrialBox(sample_rate=16000, duration=0.2, oversampling=16)
    session = trial_session(n_pairs, {}, rng, noise_db=-50.0, box=box)
    return distance_matrix(symbol, np.asarray(session.responses[:]), 16000, "paper")


def drawn_population(n_pairs: int, spread: float, rng: np.random.Generator):
    """Return distances of made-up places and a log-normal paired distance."""
    places = rng.standard_normal((n_pairs, 3))
    matrix = np.linalg.norm(places[:, None] - places, axis=-1)
    matrix = np.kron(matrix, np.ones((2, 2)))
    own = np.exp(spread * rng.standard_normal(n_pairs)) / 10
    index = np.arange(n_pairs)
    matrix[index * 2, index * 2 + 1] = matrix[index * 2 + 1, index * 2] = own
    order = np.r_[index * 2, index * 2 + 1]
    return matrix[np.ix_(order, order)]


def split(matrix: FloatArray, chosen: NDArray[np.intp]):
    """Return paired, own, un-paired and strangers of the chosen pairs."""
    count = len(matrix) // 2
    rows = np.r_[chosen, chosen + count]
    owner = np.tile(np.arange(len(chosen)), 2)
    part = matrix[np.ix_(rows, rows)]
    k = len(chosen)
    paired = (np.diag(part[:k, k:]) + np.diag(part[k:, :k])) / 2
    stranger = owner[:, None] != owner
    both = np.stack(np.broadcast_arrays(owner[:, None], owner), -1)
    return paired, np.arange(k)[:, None], part[stranger], both[stranger]


def coverage(matrix: FloatArray, sessions: int, size: int, rng: np.random.Generator):
    """Return the share of sessions whose interval holds the population's value."""
    count = len(matrix) // 2
    paired, _, unpaired, _ = split(matrix, np.arange(count))
    truth = paired.mean(), unpaired.mean(), unpaired.mean() / paired.mean()
    hits = np.zeros(3)
    for _ in range(sessions):
        p, own, u, strangers = split(matrix, rng.choice(count, size, replace=False))
        intervals = [estimate_mean(p, own, rng), estimate_mean(u, strangers, rng)]
        ends = [(e.low, e.high) for e in intervals]
        ends.append(ratio_of_means(p, own, u, strangers, rng))
        hits += [low <= t <= high for (low, high), t in zip(ends, truth, strict=True)]
    return hits / sessions


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "coverage")
    options = parser.parse_args(argv)
    pool, sessions = (60, 10) if options.quick else (800, 1000)
    rng = np.random.default_rng(0)
    begin, results = time.process_time(), {}
    populations = {
        f"box {s}": box_population(pool, s, np.random.default_rng(1)) for s in SYMBOLS
    }
    for spread in (0.4, 0.8, 1.0, 1.5):
        populations[f"log-normal {spread}"] = drawn_population(pool, spread, rng)
    print(f"{'population':26} {'paired':>8} {'un-paired':>10} {'ratio':>8}")
    for name, size in product(populations, (10, 20, 40)):
        if size != 20 and name.startswith("box"):
            continue
        shares = coverage(populations[name], sessions, size, rng)
        label = f"{name}, {size} pairs"
        results[label] = dict(
            zip(("paired", "unpaired", "ratio"), map(float, shares), strict=True)
        )
        print(f"{label:26} {shares[0]:8.3f} {shares[1]:10.3f} {shares[2]:8.3f}")
    print(f"{time.process_time() - begin:.0f} CPU-seconds")
    write_results(options.out, {"sessions": sessions, "share": results})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
