"""How fast is deconvolution, checks included, against pyfar? Both in one run.

Bar: 3 times pyfar at 32 channels of 12 s; memory at most 1.5 times input and output;
checks of four channels in a tenth of the take's length.
"""

import importlib
import importlib.util
import subprocess
import sys
import time
import tracemalloc
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.fft import next_fast_len

from capture import deconvolve, synchronized_sweep
from harness import make_parser, write_results

RATE = 48000


Work = Callable[[], Any]


def fastest(works: dict[str, Work], rounds: int) -> dict[str, float]:
    """Return the least CPU seconds of each work; rounds go through all in turn."""
    best = dict.fromkeys(works, float("inf"))
    for _ in range(rounds):
        for name, work in works.items():
            begin = time.process_time()
            work()
            best[name] = min(best[name], time.process_time() - begin)
    return best


def peak_rss_mb(code: str) -> float:
    """Return the largest resident set of a fresh interpreter that runs code, MB."""
    # Not getrusage: a child begins with its parent's figure there.
    told = "print([a.split()[1] for a in open('/proc/self/status') if 'VmHWM' in a][0])"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{told}"],
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout.split()[-1]) / 1000


MEMORY = """
import numpy as np
from capture import deconvolve, synchronized_sweep
sweep = synchronized_sweep(10, 22000, {seconds}, {rate}, band=(20, 20000))
def go(rows):
    return deconvolve(rows, sweep, {rate}, band=(20, 20000), length={length}, pre=2400)
rng = np.random.default_rng(0)
go(rng.standard_normal((1, {n})))
if {all}:
    go(rng.standard_normal(({channels}, {n})))
"""


def main(argv: list[str] | None = None) -> int:
    """Print CPU seconds, ratios and memory."""
    parser = make_parser(__doc__, "deconvolution_speed")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--samples", type=int, help="length of the recording")
    chosen = parser.parse_args(argv)
    seconds, channels = (3, 4) if chosen.quick else (10, 32)
    rounds = 1 if chosen.quick else chosen.rounds
    sweep = synchronized_sweep(10, 22000, seconds, RATE, band=(20, 20000))
    n = chosen.samples or (seconds + 2) * RATE
    rng = np.random.default_rng(0)
    played = np.pad(np.asarray(sweep), (0, n - sweep.size))
    delays = rng.integers(0, RATE // 4, channels)
    recording = np.stack([np.roll(played, d) for d in delays])
    recording += 1e-4 * rng.standard_normal(recording.shape)

    length = RATE + RATE // 2

    def ours(rows: np.ndarray, *, checks: bool = True) -> object:
        return deconvolve(
            rows,
            sweep,
            RATE,
            band=(20, 20000),
            length=length,
            pre=2400,
            checks=checks,
        )

    works: dict[str, Work] = {
        "checked": lambda: ours(recording),
        "unchecked": lambda: ours(recording, checks=False),
        "four_channels": lambda: ours(recording[:4]),
    }
    if importlib.util.find_spec("pyfar"):
        works |= _pyfar(recording, played)
    spent = fastest(works, rounds)
    found: dict[str, float] = {"channels": channels, "samples": n}
    found |= {f"{name}_cpu_s": value for name, value in spent.items()}
    found["four_channels_share_of_take"] = spent["four_channels"] / (n / RATE)
    for peer in ("pyfar_circular", "pyfar_linear"):
        for mine in ("checked", "unchecked"):
            if peer in spent:
                found[f"{peer}_over_{mine}"] = spent[peer] / spent[mine]
    found |= _memory(recording, ours, seconds, length)
    for key, value in found.items():
        print(f"{key:32s} {value:8.3f}")
    write_results(chosen.out, found)
    return 0


def _memory(
    recording: np.ndarray, ours: Callable[..., object], seconds: int, length: int
) -> dict[str, float]:
    """Return memory over that of input and output: what Python sees, and all."""
    channels, n = recording.shape
    both = recording.nbytes + channels * (length + 2400) * 8
    tracemalloc.start()
    ours(recording)
    traced = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    given = {"seconds": seconds, "rate": RATE, "n": n, "channels": channels}
    one, whole = (
        peak_rss_mb(MEMORY.format(**given, length=length, all=together))
        for together in (False, True)
    )
    # What one channel needs is taken off: interpreter, libraries, its transforms.
    return {
        "traced_over_input_and_output": (traced + recording.nbytes) / both,
        "resident_over_input_and_output": (whole - one) * 1e6 / both,
    }


def _pyfar(recording: np.ndarray, played: np.ndarray) -> dict[str, Work]:
    """Return pyfar's work, in time in, in time out, with and without wrapping."""
    pyfar: Any = importlib.import_module("pyfar")

    def work(n_fft: int | None) -> Any:
        heard, reference = pyfar.Signal(recording, RATE), pyfar.Signal(played, RATE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = pyfar.dsp.deconvolve(
                heard, reference, n_fft, frequency_range=(20, 20000)
            )
            return found.time

    linear = next_fast_len(2 * played.size - 1, real=True)
    return {"pyfar_circular": lambda: work(None), "pyfar_linear": lambda: work(linear)}


if __name__ == "__main__":
    sys.exit(main())
