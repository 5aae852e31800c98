"""What is found out about one response: values, facts, reasons, flags."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray

__all__ = ["FACTS", "VALUES", "Answers"]

VALUES = ("EDT", "T20", "T30", "C50", "C80", "DRR", "D50", "TS")
"""Places of the values in a row."""
EDT, T20, T30, C50, C80, DRR, D50, TS = range(8)

FACTS = ("range", "noise", "curvature", "xi20", "xi30", "onset", "crossing", "late")
"""Places of the facts in a row."""
RANGE, NOISE, CURVATURE, XI20, XI30, ONSET, CROSSING, LATE = range(8)


@dataclass(frozen=True)
class Answers:
    """Rows of values, facts, codes of reasons and bits of flags, one per response."""

    values: FloatArray
    facts: FloatArray
    reasons: NDArray[np.int64]
    flags: NDArray[np.int64]

    @classmethod
    def empty(cls, rows: int) -> "Answers":
        """Return rows to be filled: nothing known yet."""
        return cls(
            np.full((rows, len(VALUES)), np.nan),
            np.full((rows, len(FACTS)), np.nan),
            np.zeros((rows, len(VALUES)), dtype=np.int64),
            np.zeros(rows, dtype=np.int64),
        )

    def part(self, first: int, last: int) -> "Answers":
        """Return a view of rows first to last - 1."""
        kept = slice(first, last)
        return Answers(
            self.values[kept], self.facts[kept], self.reasons[kept], self.flags[kept]
        )

    def row(self, index: int) -> "Answer":
        """Return a view of one row."""
        return Answer(
            self.values[index],
            self.facts[index],
            self.reasons[index],
            self.flags[index : index + 1],
        )


@dataclass(frozen=True)
class Answer:
    """One row of `Answers`, written in place."""

    values: FloatArray
    facts: FloatArray
    reasons: NDArray[np.int64]
    flags: NDArray[np.int64]

    def flag(self, bits: int) -> None:
        """Raise flags."""
        self.flags[0] |= bits

    def refuse(self, reason: int, *flags: int) -> None:
        """Give no value at all, for one reason."""
        self.reasons[:] = reason
        for bits in flags:
            self.flag(bits)
