"""What a metric is: a description of each response and a way to compare two."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = ["AVR", "ISO_3382", "RAF", "RAF_NONE", "Features", "Flavour", "Metric"]

# Sources of several metrics, as reports name them.
AVR = "as evaluated with AVR (Lan et al., NeurIPS 2024)"
RAF = "Real Acoustic Fields, Chen et al., CVPR 2024; authors' answers"
RAF_NONE = "RAF defines none: as paper-1"
ISO_3382 = "ISO 3382-1:2009, noise handled, from the direct sound"

Features = tuple[FloatArray, ...]
"""What a flavour keeps of responses of shape (..., n): arrays starting with (...)."""


@dataclass(frozen=True)
class Flavour:
    """One exactly versioned definition of a metric.

    A comparison of many responses describes each of them once and compares the
    descriptions; the result is the same as comparing the responses.
    """

    version: str
    """Name written into every report, for instance ``"paper-1"``."""
    describe: Callable[[FloatArray, int], Features]
    """``describe(samples (..., n), sample_rate) -> Features``."""
    compare: Callable[[Features, Features], FloatArray]
    """``compare(truth, prediction) -> (...)``, in the unit of the metric; leading axes
    broadcast. NaN where the difference is not defined."""
    source: str
    """Where the definition comes from."""
    matrix: Callable[[Features], FloatArray] | None = None
    """``matrix(described) -> (n, n)``, all ordered comparisons [truth, prediction] of n
    responses at once, where that is much faster than one by one."""


@dataclass(frozen=True)
class Metric:
    """A distance between two impulse responses, in one or several flavours.

    Parameters
    ----------
    symbol, title : str
        Short name of tables ("C50") and a name for people ("clarity").
    unit : str
        Unit of the values.
    formula : str
        The formula in one line, for the methods section of a report.
    flavours : Mapping of str to Flavour
    table_unit : str
        Unit the paper's tables print.
    table_factor : float
        Table value = value * table_factor.
    decimals : int
        Digits after the point in tables.
    symmetric : bool
        Whether swapping truth and prediction never changes the value.
    """

    symbol: str
    title: str
    unit: str
    formula: str
    flavours: Mapping[str, Flavour]
    table_unit: str = ""
    table_factor: float = 1.0
    decimals: int = 2
    symmetric: bool = False

    def flavour(self, name: str) -> Flavour:
        """Return a flavour by name; an unknown one lists those there are."""
        if name not in self.flavours:
            known = ", ".join(sorted(self.flavours))
            raise SignalError(f"{self.symbol} has no flavour {name!r}; known: {known}")
        return self.flavours[name]

    def difference(
        self,
        truth: FloatArray,
        prediction: FloatArray,
        sample_rate: int,
        flavour: str = "paper",
    ) -> FloatArray:
        """Return the difference of responses of shape (..., n), shape (...)."""
        chosen = self.flavour(flavour)
        return chosen.compare(
            chosen.describe(truth, sample_rate),
            chosen.describe(prediction, sample_rate),
        )
