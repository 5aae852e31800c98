"""One hard case: a response, what is true about it, and how near one must come."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rir.registry import Registry

__all__ = ["CASES", "PARAMETERS", "REFUSED", "CaseMaker", "HardCase"]

PARAMETERS = ("EDT", "T20", "T30", "C50", "C80", "DRR", "D50", "TS")

REFUSED = float("nan")
"""The truth of a value that cannot be known: a number there is nonsense."""


@dataclass(frozen=True, eq=False)
class HardCase:
    """A response with its closed-form truth.

    Parameters
    ----------
    name : str
        What is hard about it.
    samples : array_like
        The response, of any type and shape a user may pass.
    sample_rate : float
        Samples per second [Hz].
    truth : dict of str to float or array
        True values; NaN where a number would be nonsense; a parameter left out is
        not judged.
    noisy : bool
        Whether the wider tolerances of noisy responses hold.
    optional : set of str
        Parameters that may be refused without loss: their range is only just there.
    refuses : bool
        Whether the call itself must be refused with a ValueError.
    warns : bool or None
        Whether a flag must be raised (True), must not (False), or may be (None).
    """

    name: str
    samples: Any
    sample_rate: float
    truth: dict[str, Any] = field(default_factory=dict)
    noisy: bool = False
    optional: frozenset[str] = frozenset()
    refuses: bool = False
    warns: bool | None = None


CaseMaker = Callable[[np.random.Generator], Iterator[HardCase]]

CASES: Registry[CaseMaker] = Registry("group of hard cases")
"""Groups of hard cases by name."""
