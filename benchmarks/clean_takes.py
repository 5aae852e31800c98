"""How often is a clean take flagged? Random rooms, levels, rates and sweeps.

Bar: none of 1,000 flagged.
"""

import sys
from collections import Counter

import numpy as np

from capture import deconvolve, synchronized_sweep
from harness import make_parser, write_results
from sweep_cases import convolve, decaying_room, delayed

RATES = (16000, 22050, 32000, 44100, 48000, 96000)


def clean_take(rng: np.random.Generator) -> dict:
    """Make one random clean take, with or without loopback, mono or several."""
    rate = int(rng.choice(RATES))
    low = float(rng.uniform(20, 100))
    high = float(min(rng.uniform(0.6, 0.9) * rate / 2, 20000))
    seconds = float(rng.uniform(0.5, 4.0))
    wide = rng.random() < 0.5
    sweep = (
        synchronized_sweep(
            low / 2, min(high * 1.08, rate / 2), seconds, rate, band=(low, high)
        )
        if wide
        else synchronized_sweep(low, high, seconds, rate)
    )
    t60 = float(rng.uniform(0.15, 1.2))
    tail = round((1.3 * t60 + 0.1) * rate)
    pre_roll = round(rng.uniform(0, 0.3) * rate) if rng.random() < 0.7 else 0
    n = pre_roll + sweep.size + tail
    played = np.concatenate((np.zeros(pre_roll), sweep, np.zeros(tail)))
    level = 10 ** (rng.uniform(-50, 0) / 20)
    channels = []
    for _ in range(int(rng.integers(1, 3))):
        room = decaying_room(rng, rate, t60)
        room[room.argmax()] *= rng.uniform(0.1, 1.0)
        heard = convolve(played, room, n)
        noise = np.std(heard) * 10 ** (-rng.uniform(20, 80) / 20)
        channels.append(level * (heard + noise * rng.standard_normal(n)))
    recording = np.stack(channels)
    loopback = None
    if rng.random() < 0.6:
        latency = rng.uniform(0, 600)
        recording = np.stack([delayed(row, latency) for row in recording])
        loopback = delayed(played, latency) * 10 ** (rng.uniform(-20, 0) / 20)
        loopback = loopback + np.std(loopback) * 10 ** (
            -rng.uniform(50, 100) / 20
        ) * rng.standard_normal(n)
    if rng.random() < 0.3:
        top = 0.9 / np.abs(recording).max()
        scaled = recording * min(top, 1.0)
        recording = np.round(scaled * 32767).astype(np.int16)
    return {
        "recording": recording,
        "excitation": np.asarray(sweep),
        "sample_rate": rate,
        "loopback": loopback,
        "band": (low, high),
        "length": tail,
        "pre": int(rng.integers(0, round(0.1 * rate))),
    }


def main(argv: list[str] | None = None) -> int:
    """Count flags over random clean takes."""
    parser = make_parser(__doc__, "clean_takes")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(argv)
    count = 12 if chosen.quick else chosen.count
    words: Counter[str] = Counter()
    flagged = 0
    for number in range(count):
        rng = np.random.default_rng((chosen.seed, number))
        result = deconvolve(**clean_take(rng))
        words.update(result.flags)
        words.update(f"({mark})" for mark in result.marks)
        if result.flags:
            flagged += 1
            print(number, result.flags, [v.text for v in result.findings if v.hard])
    print(f"{flagged} of {count} clean takes flagged; all words: {dict(words)}")
    write_results(chosen.out, {"count": count, "flagged": flagged, "words": words})
    return 0


if __name__ == "__main__":
    sys.exit(main())
