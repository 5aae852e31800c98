"""Hard cases: responses with known truth that stump decay analysers.

Examples
--------
>>> import numpy as np
>>> case = next(CASES["pure"](np.random.default_rng(0)))
>>> case.name, case.truth["T30"] < 0.051
('sign 0.05 s 8000 Hz', True)
"""

from hard_cases import groups, peculiar
from hard_cases.case import CASES, PARAMETERS, REFUSED, HardCase
from hard_cases.score import Score, judge_value, score_cases

__all__ = [
    "CASES",
    "PARAMETERS",
    "REFUSED",
    "HardCase",
    "Score",
    "groups",
    "judge_value",
    "peculiar",
    "score_cases",
]
