"""How fast are the room-acoustic parameters? Ratios against named peers in one run.

The same responses of 1 s at 48 kHz (T 0.3-1.0 s, noise -60 dB) go through each tool
in turn, several rounds, in one process and one thread; CPU seconds, best round.

Bar: 6 times pyrato's chu, 6 times pyroomacoustics' T30 alone, 20 times pyfar and pyrato
in octaves.
"""

import sys
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from analysis import acoustic_parameters, band_parameters
from harness import make_parser, write_results

RATE = 48000
OCTAVES = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
BARS = {"pyrato chu": 6.0, "pyroomacoustics T30": 6.0, "pyfar + pyrato octaves": 20.0}

Samples = NDArray[np.float64]


def make_responses(count: int, seed: int = 0) -> Samples:
    rng = np.random.default_rng(seed)
    times = rng.uniform(0.3, 1.0, (count, 1))
    decay = 10.0 ** (-3.0 * np.arange(RATE) / RATE / times)
    waves = rng.standard_normal((count, RATE)) * decay
    return waves + 1e-3 * rng.standard_normal(waves.shape)


def pyrato_chu(responses: Samples) -> None:
    import pyfar
    import pyrato

    curves = pyrato.edc.energy_decay_curve_chu(pyfar.Signal(responses, RATE))
    for name in ("T30", "EDT"):
        pyrato.parameters.reverberation_time_linear_regression(curves, T=name)
    pyrato.parameters.clarity(curves, 50)


def pyroomacoustics_t30(responses: Samples) -> None:
    from pyroomacoustics.experimental import measure_rt60

    for response in responses:
        measure_rt60(response, fs=RATE, decay_db=30)


def pyfar_pyrato_octaves(responses: Samples) -> None:
    import pyfar
    import pyrato

    for response in responses:
        bands = pyfar.dsp.filter.fractional_octave_bands(
            pyfar.Signal(response, RATE), 1, frequency_range=(125, 8000)
        )
        # It raises on some of these responses; its time counts all the same.
        with suppress(ValueError, IndexError):
            curves: Any = pyrato.edc.energy_decay_curve_chu_lundeby(bands)
            for name in ("T30", "EDT"):
                pyrato.parameters.reverberation_time_linear_regression(curves, T=name)
            pyrato.parameters.clarity(curves, 50)


def eight_parameters(responses: Samples) -> None:
    acoustic_parameters(responses, RATE)


def seven_octaves(responses: Samples) -> None:
    band_parameters(responses, RATE, OCTAVES)


def rates(
    tools: dict[str, tuple[Callable[[Samples], None], int]],
    responses: Samples,
    rounds: int,
) -> dict[str, float]:
    """Return responses per CPU second of each tool; rounds take turns."""
    best = dict.fromkeys(tools, 0.0)
    for tool, _ in tools.values():
        tool(responses[:1])
    for _ in range(rounds):
        for name, (tool, count) in tools.items():
            start = time.process_time()
            tool(responses[:count])
            spent = time.process_time() - start
            best[name] = max(best[name], count / spent)
    return best


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "analysis_throughput", "fewer responses")
    options = parser.parse_args(argv)
    warnings.simplefilter("ignore")
    many, few, rounds = (60, 8, 2) if options.quick else (1000, 100, 3)
    responses = make_responses(many)
    found = rates(
        {
            "ours, 8 parameters": (eight_parameters, many),
            "pyrato chu": (pyrato_chu, few),
            "pyroomacoustics T30": (pyroomacoustics_t30, few),
            "ours, 7 octaves": (seven_octaves, many // 4),
            "pyfar + pyrato octaves": (pyfar_pyrato_octaves, max(few // 4, 4)),
        },
        responses,
        rounds,
    )
    ratios = {
        peer: found["ours, 7 octaves" if "octaves" in peer else "ours, 8 parameters"]
        / found[peer]
        for peer in BARS
    }
    table = Table("tool", "responses per CPU second", "ours is", "bar")
    for name, value in found.items():
        ratio = f"{ratios[name]:.1f} x" if name in ratios else ""
        table.add_row(name, f"{value:.0f}", ratio, str(BARS.get(name, "")))
    Console().print(table)
    write_results(options.out, {"rates": found, "ratios": ratios})
    return 0


if __name__ == "__main__":
    sys.exit(main())
