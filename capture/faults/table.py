"""The table of faults and how a take is spoiled with them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from pydantic import field_validator

from capture.signal.randomness import take_rng
from rir import Registry
from rir.arrays import FloatArray
from rir.config import StrictModel

__all__ = ["FAULTS", "FaultKind", "FaultScene", "TakeFault", "spoil"]


@dataclass(frozen=True, eq=False)
class FaultScene:
    """What a fault may need to know of the take it spoils."""

    sample_rate: int
    """Rate [Hz]."""
    played: FloatArray
    """The signal as it leaves the interface, latency included. Shape (n_samples,)."""
    level: float
    """Root mean square of the sweep."""
    rng: np.random.Generator
    """Random numbers of this take and fault."""


class TakeFault(StrictModel):
    """One fault of some takes.

    Attributes
    ----------
    kind : str
        Name in `FAULTS`.
    takes : str
        Which takes, as a pattern of their names (``P03_*``).
    amount : float
        How much; the unit belongs to the kind.
    at_s : float
        When, from the beginning of the recording [s], if it has a time.
    channel : int or None
        Which recorded channel (from 0, negative from the end); all if None.
    """

    kind: str
    takes: str = "*"
    amount: float = 0.0
    at_s: float = 1.0
    channel: int | None = None

    @field_validator("kind")
    @classmethod
    def _known(cls, kind: str) -> str:
        if kind not in FAULTS and kind != "drift":
            raise ValueError(f"unknown; known: drift, {', '.join(sorted(FAULTS))}")
        return kind

    def hits(self, take: str) -> bool:
        """Tell whether a take has the fault."""
        return fnmatchcase(take, self.takes)


@dataclass(frozen=True)
class FaultKind:
    """One kind of fault."""

    about: str
    """What it is, and the unit of its amount."""
    apply: Callable[[FloatArray, TakeFault, FaultScene], FloatArray]
    """Takes the channels it hits, shape (channels, n), the fault and the scene; returns
    them spoiled, in the same shape."""


FAULTS: Registry[FaultKind] = Registry("fault")


def spoil(
    samples: FloatArray,
    faults: Iterable[TakeFault],
    *,
    take: str,
    seed: int,
    sample_rate: int,
    played: FloatArray,
    level: float,
) -> FloatArray:
    """Return a take with its faults.

    Parameters
    ----------
    samples : ndarray, shape (channels, n_samples)
        The clean take.
    faults : iterable of TakeFault
        What may go wrong.
    take : str
        Name of the take: decides which faults hit it, and with `seed` how.
    seed : int
        Seed of the session.
    sample_rate, played, level
        See `FaultScene`.
    """
    spoiled = samples.copy()
    for number, fault in enumerate(faults):
        if fault.kind == "drift" or not fault.hits(take):
            continue
        rng = take_rng(seed, f"fault {number} {take}")
        scene = FaultScene(sample_rate, played, level, rng)
        rows = slice(None) if fault.channel is None else [fault.channel]
        spoiled[rows] = FAULTS[fault.kind].apply(spoiled[rows], fault, scene)
    return spoiled
