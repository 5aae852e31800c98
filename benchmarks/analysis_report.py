"""Measure how long a reciprocity report takes and how large it is.

Bar: three rooms of 20 pairs in 20 s and 5 MB; 500 pairs in 2 minutes and 20 MB.
"""

import tempfile
import time
from collections.abc import Sequence

import numpy as np

from analysis.report import write_report
from harness import make_parser, write_results
from rir import Dataset

RATE = 48000


def session(n_pairs: int, seconds: float, room: str, seed: int) -> Dataset:
    """Return made-up pairs: decaying noise, alike in both directions."""
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE)
    time_axis = np.arange(count) / RATE
    rows = np.empty((2 * n_pairs, count), dtype=np.float32)
    for k in range(n_pairs):
        start = rng.integers(150, 600)
        decay = rng.standard_normal(count) * 10 ** (-3 * time_axis / 0.5)
        h = np.r_[np.zeros(start), decay[:-start]]
        for way in (0, 1):
            rows[2 * k + way] = h + 3e-4 * rng.standard_normal(count)
    places = rng.uniform(0.5, 4.5, (n_pairs, 2, 3))
    return Dataset.from_arrays(
        rows,
        places.reshape(-1, 3),
        places[:, ::-1].reshape(-1, 3),
        sample_rate=RATE,
        room_name=room,
        session=room,
        columns={
            "pair_id": np.repeat(np.arange(n_pairs), 2),
            "direction": np.tile(["AB", "BA"], n_pairs),
        },
    )


def measure(rooms: int, n_pairs: int, seconds: float) -> dict[str, float]:
    """Return CPU and wall seconds and the size of the page [MB]."""
    sessions = [session(n_pairs, seconds, f"room {k}", k) for k in range(rooms)]
    with tempfile.TemporaryDirectory() as folder:
        cpu, wall = time.process_time(), time.perf_counter()
        paths = write_report(sessions, folder)
        return {
            "cpu_s": time.process_time() - cpu,
            "wall_s": time.perf_counter() - wall,
            "page_mb": paths["html"].stat().st_size / 1e6,
        }


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "report")
    options = parser.parse_args(argv)
    cases = {"3 rooms x 20 pairs": (3, 20, 1.0), "1 room x 500 pairs": (1, 500, 1.0)}
    if options.quick:
        cases = {"1 room x 4 pairs": (1, 4, 0.3)}
    results = {}
    print(f"{'case':20} {'CPU s':>8} {'wall s':>8} {'page MB':>8}")
    for name, case in cases.items():
        results[name] = found = measure(*case)
        print(
            f"{name:20} {found['cpu_s']:8.1f} {found['wall_s']:8.1f}"
            f" {found['page_mb']:8.2f}"
        )
    write_results(options.out, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
