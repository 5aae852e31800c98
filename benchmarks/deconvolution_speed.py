"""How fast is deconvolution, checks included, against pyfar? Both in one run."""

import argparse
import importlib.util
import json
import sys
import time
import tracemalloc
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from capture import deconvolve, synchronized_sweep

RATE = 48000


def cpu(work: Callable[[], Any], rounds: int) -> float:
    """Return the least CPU seconds of several runs."""
    times = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def main(argv: list[str] | None = None) -> int:
    """Print CPU seconds, ratios and memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--out", type=Path, default=Path("results/deconvolution_speed.json")
    )
    chosen = parser.parse_args(argv)
    seconds, channels = (3, 4) if chosen.quick else (10, 32)
    rounds = 1 if chosen.quick else chosen.rounds
    sweep = synchronized_sweep(10, 22000, seconds, RATE, band=(20, 20000))
    n = sweep.size + 2 * RATE
    rng = np.random.default_rng(0)
    played = np.pad(np.asarray(sweep), (0, n - sweep.size))
    delays = rng.integers(0, RATE // 4, channels)
    recording = np.stack([np.roll(played, d) for d in delays])
    recording += 1e-4 * rng.standard_normal(recording.shape)

    def ours(rows: np.ndarray) -> object:
        return deconvolve(
            rows, sweep, RATE, band=(20, 20000), length=RATE + RATE // 2, pre=2400
        )

    ours(recording[:1])
    found = {"channels": channels, "seconds": n / RATE}
    found["ours_cpu_s"] = cpu(lambda: ours(recording), rounds)
    four = cpu(lambda: ours(recording[:4]), rounds)
    found["four_channels_share_of_take"] = four / (n / RATE)
    tracemalloc.start()
    ours(recording)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    output = channels * (RATE + RATE // 2 + 2400) * 8
    found["extra_memory_over_input"] = (peak - output) / recording.nbytes
    if importlib.util.find_spec("pyfar"):
        found.update(_pyfar(recording, played, rounds))
        for key in ("circular", "linear"):
            ratio = found[f"pyfar_{key}_cpu_s"] / found["ours_cpu_s"]
            found[f"ratio_{key}"] = ratio
    for key, value in found.items():
        print(f"{key:28s} {value:8.3f}")
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(json.dumps(found, indent=1))
    return 0


def _pyfar(recording: np.ndarray, played: np.ndarray, rounds: int) -> dict[str, float]:
    import pyfar

    heard, reference = pyfar.Signal(recording, RATE), pyfar.Signal(played, RATE)
    linear = 1 << int(np.ceil(np.log2(2 * played.size)))
    linear = min(linear, 1105920) if linear > 1105920 >= 1.9 * played.size else linear
    found = {}
    for name, length in (("circular", None), ("linear", linear)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found[f"pyfar_{name}_cpu_s"] = cpu(
                lambda length=length: pyfar.dsp.deconvolve(
                    heard, reference, length, frequency_range=(20, 20000)
                ),
                rounds,
            )
    return found


if __name__ == "__main__":
    sys.exit(main())
