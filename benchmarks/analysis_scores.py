"""How robust are the room-acoustic parameters? Score them on the hard cases.

Rule: a value within its tight tolerance counts 1, within the just noticeable
difference 0.5, missing 0; wrong, or a number where none can be known, or a crash -1.

Bar: 99.0 % in total and 98.5 % on fresh draws; 100 % for degenerate input, dtypes,
scales, shapes and rates; 99 % in octaves; 85 % of the warnings that are due, 1 % false.
"""

import sys
import warnings
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from analysis import acoustic_parameters, band_parameters
from hard_cases import CASES, Score, score_cases
from hard_cases.bands import OCTAVES, THIRDS, score_bands
from hard_cases.peculiar import random_mixtures
from harness import make_parser, write_results


def score_groups(seed: int, *, quick: bool) -> dict[str, Score]:
    scores = {}
    for name, make in CASES.items():
        rng = np.random.default_rng(seed)
        cases = random_mixtures(rng, 20) if quick and name == "random" else make(rng)
        scores[name] = score_cases(acoustic_parameters, cases)
    fresh = 20 if quick else 300
    for draw in (1, 2, 3):
        cases = random_mixtures(np.random.default_rng(seed + draw), fresh)
        scores[f"fresh {draw}"] = score_cases(acoustic_parameters, cases)
    for name, centers in (("octaves", OCTAVES), ("thirds", THIRDS)):
        if not quick:
            rng = np.random.default_rng(seed)
            scores[name] = score_bands(band_parameters, centers, rng)
    return scores


def total_of(scores: dict[str, Score]) -> float:
    groups = [scores[name] for name in CASES]
    return sum(s.percent * s.values for s in groups) / sum(s.values for s in groups)


def show(scores: dict[str, Score], console: Console, remarks: int) -> None:
    table = Table(
        "group",
        "score",
        "values",
        "tight",
        "jnd",
        "missing",
        "wrong",
        "false",
        "crash",
        "flags",
        "alarms",
    )
    for name, score in scores.items():
        counts = [
            str(score.verdicts[k])
            for k in ("tight", "jnd", "missing", "wrong", "false", "crash")
        ]
        table.add_row(
            name,
            f"{score.percent:.2f}",
            str(score.values),
            *counts,
            f"{score.flagged}/{score.due}",
            f"{score.alarms}/{score.calm}",
        )
    console.print(table)
    for name, score in scores.items():
        for remark in score.remarks[:remarks]:
            console.print(f"{name}: {remark}", highlight=False, markup=False)


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "analysis_scores", "few random mixtures")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--remarks", type=int, default=0, help="misses to print")
    options = parser.parse_args(argv)
    warnings.simplefilter("error")
    scores = score_groups(options.seed, quick=options.quick)
    console = Console(width=110)
    show(scores, console, options.remarks)
    groups = [scores[name] for name in CASES]
    recall = sum(s.flagged for s in groups) / max(sum(s.due for s in groups), 1)
    alarms = sum(s.alarms for s in groups) / max(sum(s.calm for s in groups), 1)
    summary = {"total": total_of(scores), "recall": recall, "false_alarms": alarms}
    console.print({key: round(value, 4) for key, value in summary.items()})
    rows = {name: {"percent": s.percent, **s.verdicts} for name, s in scores.items()}
    write_results(options.out, summary | {"groups": rows})
    return 0


if __name__ == "__main__":
    sys.exit(main())
