"""Score any analyser on the hard cases, as a referee would."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hard_cases.case import PARAMETERS, HardCase

__all__ = ["Score", "judge_value", "score_cases"]

TIMES = ("EDT", "T20", "T30")
TIGHT = {"C50": 0.1, "C80": 0.1, "DRR": 0.1, "D50": 0.005, "TS": 0.0005}
TIGHT_NOISY = {"C50": 0.25, "C80": 0.25, "DRR": 0.25, "D50": 0.01, "TS": 0.002}
JUST_NOTICEABLE = {"C50": 1.0, "C80": 1.0, "DRR": 1.0, "D50": 0.05, "TS": 0.01}

Analyser = Callable[[Any, float], Any]


@dataclass
class Score:
    """Counts of verdicts: tight, jnd, missing, wrong, false, crash.

    `points` weighs them 1, 0.5, 0, -1, -1, -1; `flagged` counts warnings given where
    they were due, `alarms` where they were not.
    """

    verdicts: Counter[str] = field(default_factory=Counter)
    due: int = 0
    flagged: int = 0
    calm: int = 0
    alarms: int = 0
    remarks: list[str] = field(default_factory=list)

    @property
    def values(self) -> int:
        """Number of values judged."""
        return sum(self.verdicts.values())

    @property
    def percent(self) -> float:
        """Points in percent of the most possible."""
        count = self.verdicts
        bad = count["wrong"] + count["false"] + count["crash"]
        points = count["tight"] + 0.5 * count["jnd"] - bad
        return 100.0 * points / max(self.values, 1)


def judge_value(
    name: str, truth: float, value: float, *, noisy: bool, optional: bool
) -> str:
    """Return the verdict on one value.

    Examples
    --------
    >>> judge_value("T30", 1.0, 1.01, noisy=True, optional=False)
    'tight'
    >>> judge_value("T30", float("nan"), 1.02, noisy=True, optional=False)
    'false'
    """
    if np.isnan(truth):
        return "tight" if np.isnan(value) else ("jnd" if optional else "false")
    if np.isnan(value):
        return "tight" if optional else "missing"
    error = abs(value - truth)
    if name in TIMES:
        tight, noticeable = (0.02 if noisy else 0.01) * truth, 0.05 * truth
    else:
        tight = (TIGHT_NOISY if noisy else TIGHT)[name]
        noticeable = JUST_NOTICEABLE[name]
        if name == "TS":
            tight = max(tight, 0.01 * truth)
    return "tight" if error <= tight else ("jnd" if error <= noticeable else "wrong")


def score_cases(analyse: Analyser, cases: Iterable[HardCase]) -> Score:
    """Return the score of `analyse(samples, sample_rate)` over cases."""
    score = Score()
    for case in cases:
        _score_case(analyse, case, score)
    return score


def _score_case(analyse: Analyser, case: HardCase, score: Score) -> None:
    judged = max(sum(np.size(v) for v in case.truth.values()), 1)
    try:
        answer = analyse(case.samples, case.sample_rate)
    except ValueError as error:
        verdict = "tight" if case.refuses else "crash"
        score.verdicts[verdict] += judged
        if not case.refuses:
            score.remarks.append(f"{case.name}: {error!r}")
        return
    except Exception as error:  # any other error is what is being looked for
        score.verdicts["crash"] += judged
        score.remarks.append(f"{case.name}: {error!r}")
        return
    if case.refuses:
        score.verdicts["false"] += 1
        score.remarks.append(f"{case.name}: not refused")
        return
    _judge_answer(case, answer, score)


def _judge_answer(case: HardCase, answer: Any, score: Score) -> None:
    for name in PARAMETERS:
        if name not in case.truth:
            continue
        pairs = zip(np.ravel(case.truth[name]), np.ravel(answer[name]), strict=True)
        for truth, value in pairs:
            verdict = judge_value(
                name, truth, value, noisy=case.noisy, optional=name in case.optional
            )
            score.verdicts[verdict] += 1
            if verdict != "tight":
                score.remarks.append(
                    f"{case.name}: {name} {value:.5g} for {truth:.5g}: {verdict} "
                    f"{answer.get('flags')}"
                )
    if np.ndim(case.samples) == 1 and case.warns is not None:
        said = bool(answer.get("flags"))
        score.due += case.warns
        score.flagged += case.warns and said
        score.calm += not case.warns
        score.alarms += said and not case.warns
        if said != case.warns:
            score.remarks.append(f"{case.name}: flags {answer.get('flags')}")
