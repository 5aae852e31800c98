"""Measure how often injected faults of pairs are named rightly, and false alarms.

Sessions of ten pairs in boxes of random size and in the simulated rooms: one pair with
a gain step of 0.5 dB, one displaced by 5 mm, one in air 0.3 K warmer, two whose reverse
takes are exchanged, one with 25 dB more noise, four without fault (0.02 dB, 0.2 mm,
0.02 K scatter).

Bar: 95 % of the faults named rightly, at most 1 % of the pairs without fault accused.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from analysis.likeness import fit_room
from hard_cases.trials import TrialBox, trial_session
from harness import make_parser, write_results
from rir import Dataset, Pose, RoomSpec
from rooms import World
from rooms.presets import load_room

FAULTS = {0: "gain", 2: "position", 4: "temperature", 6: "swapped", 9: "noise"}
PAIRS = 10


@lru_cache
def preset(name: str) -> RoomSpec:
    return load_room(name)


@dataclass(frozen=True)
class PresetBox(TrialBox):
    """A preset room of the simulator in place of the plain box."""

    name: str = "kitchen"

    def response(
        self,
        emitter: np.ndarray,
        listener: np.ndarray,
        temperature_c: float = 20.0,
        facing: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return a response of the simulated room."""
        if facing is not None:
            raise ValueError("this benchmark has no directional devices")
        world = World(
            preset(self.name),
            sample_rate=self.sample_rate,
            duration=self.duration,
            temperature_c=temperature_c,
        )
        return world.response(Pose.at(*emitter), Pose.at(*listener))


def random_box(rng: np.random.Generator, rate: int) -> TrialBox:
    """Return a box of random size and damping."""
    x, y, z = (float(v) for v in rng.uniform([4, 3, 2.4], [8, 6, 3.5]))
    return TrialBox(
        size=(x, y, z),
        reflection=float(rng.uniform(0.7, 0.85)),
        sample_rate=rate,
        duration=0.25,
        oversampling=max(8, 768000 // rate),
    )


def named_faults(session: Dataset) -> Counter:
    """Return counts of (injected, named) kinds; an empty word is no fault."""
    samples = np.asarray(session.responses[:])
    names = [str(k) for k in range(PAIRS)]
    room = fit_room(
        list(samples[:PAIRS]), list(samples[PAIRS:]), names, session.sample_rate
    )
    truth = FAULTS | {7: "swapped"}
    return Counter(
        (truth.get(k, ""), found[0].kind if found else "")
        for k, found in enumerate(room.faults)
    )


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "faults")
    options = parser.parse_args(argv)
    counts: Counter = Counter()
    settings = [(16000, -60.0), (32000, -60.0), (48000, -60.0), (48000, -50.0)]
    for rate, noise in settings[: 1 if options.quick else None]:
        rng = np.random.default_rng(rate)
        for _ in range(1 if options.quick else 15):
            box = random_box(rng, rate)
            session = trial_session(PAIRS, FAULTS, rng, noise_db=noise, box=box)
            counts += named_faults(session)
    for name in () if options.quick else ("kitchen", "conference", "office"):
        rng = np.random.default_rng(len(name))
        for _ in range(5):
            size = preset(name).size_m
            box = PresetBox(size=size, sample_rate=48000, duration=0.5, name=name)
            counts += named_faults(trial_session(PAIRS, FAULTS, rng, box=box))
    results = {}
    for kind in ("gain", "position", "temperature", "swapped", "noise", ""):
        own = {named: n for (truth, named), n in counts.items() if truth == kind}
        total = sum(own.values())
        right = own.get(kind, 0)
        others = {named or "nothing": n for named, n in own.items() if named != kind}
        results[kind or "healthy"] = {"pairs": total, "right": right, **others}
        label = kind or "no fault"
        print(f"{label:12} {right:4d} of {total:4d} = {right / total:6.1%}  {others}")
    write_results(options.out, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
