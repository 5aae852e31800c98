"""Measure how well the predicted floor meets sessions whose places are unsure.

Simulated rooms, both ends of each direction put up with an error of 1, 3 and 10 mm per
axis, noise 60 dB under the direct sound at 2.5 m: predicted mean distance over the one
measured, for each metric of the paper.
"""

import itertools
from collections.abc import Callable, Sequence
from time import process_time

import numpy as np

from analysis.likeness.floor import predicted_floor
from analysis.metrics import METRICS
from hard_cases.trials import TrialBox
from harness import make_parser, write_results
from rir import Pose
from rooms import World
from rooms.presets import load_room

SYMBOLS = ("Amp", "Env", "T60", "C50", "EDT", "STFT")
NOISE = 4e-4
Response = Callable[[np.ndarray, np.ndarray], np.ndarray]
Outside = Callable[[np.ndarray], np.ndarray]
MARGIN = 0.06
"""Six standard deviations of the largest error stay out of furniture [m]."""


def room(name: str, rate: int) -> tuple[np.ndarray, Response, Outside]:
    """Return size, responses and what is outside, of a preset or of a bare box."""
    if name == "box":
        box = TrialBox(
            sample_rate=rate, duration=0.4, oversampling=max(8, 768000 // rate)
        )
        return np.array(box.size), box.response, lambda ends: np.zeros(len(ends), bool)
    spec = load_room(name)
    world = World(spec, sample_rate=rate, duration=0.6)

    def response(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return world.response(Pose.at(*a), Pose.at(*b))

    return np.array(spec.size_m), response, world.scene.outside


def places(size: np.ndarray, outside: Outside, rng: np.random.Generator) -> np.ndarray:
    """Return two places apart from each other and from furniture, shape (2, 3)."""
    around = MARGIN * np.array(list(itertools.product((-1, 0, 1), repeat=3)))
    while True:
        ends = rng.uniform(0.5, size - 0.5, (2, 3))
        near = (ends[:, None] + around).reshape(-1, 3)
        if np.linalg.norm(ends[0] - ends[1]) > 0.8 and not outside(near).any():
            return ends


def session(
    name: str, rate: int, sigma: float, pairs: int, rng: np.random.Generator
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return forward and reverse responses of pairs met with an error."""
    size, response, outside = room(name, rate)
    sides: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for _ in range(pairs):
        ends = places(size, outside, rng)
        for side, (k, m) in zip(sides, ((0, 1), (1, 0)), strict=True):
            visited = ends + rng.normal(0.0, sigma, (2, 3))
            h = response(visited[k], visited[m])
            side.append(h + NOISE * rng.standard_normal(len(h)))
    return sides


def measured(
    forward: list[np.ndarray], reverse: list[np.ndarray], rate: int
) -> dict[str, float]:
    means = {}
    for symbol in SYMBOLS:
        chosen = METRICS[symbol].flavour("paper")
        values = []
        for pair in zip(forward, reverse, strict=True):
            a, b = (chosen.describe(h, rate) for h in pair)
            values += [chosen.compare(a, b), chosen.compare(b, a)]
        means[symbol] = float(np.nanmean(values))
    return means


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "floor")
    parser.add_argument("--pairs", type=int, default=40)
    options = parser.parse_args(argv)
    rates = (16000,) if options.quick else (16000, 48000)
    names = ("kitchen", "conference", "office", "box")[: 1 if options.quick else None]
    pairs = 8 if options.quick else options.pairs
    rng = np.random.default_rng(5)
    lines = []
    print(f"{'predicted over measured':24}", *(f"{s:>6}" for s in SYMBOLS))
    for rate in rates:
        for name in names:
            for sigma_mm in (1, 3, 10):
                sides = session(name, rate, sigma_mm / 1000, pairs, rng)
                truth, start = measured(*sides, rate), process_time()
                floor = predicted_floor(
                    *sides,
                    rate,
                    rng,
                    flavour="paper",
                    symbols=SYMBOLS,
                    temperature_changes=[0.0] * pairs,
                    position_m=sigma_mm / 1000,
                )
                seconds = process_time() - start
                ratio = {s: floor[s] / truth[s] for s in SYMBOLS}
                label = f"{name} {rate} Hz {sigma_mm} mm"
                print(f"{label:24}", *(f"{ratio[s]:6.2f}" for s in SYMBOLS))
                lines.append(
                    {"case": label, "measured": truth, "predicted": floor}
                    | {"ratio": ratio, "cpu_seconds": seconds}
                )
    write_results(options.out, lines)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
