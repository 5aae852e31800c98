"""Pairs of places in batches: what is worked on, held and stored in one go."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

__all__ = ["Batch", "batches", "in_threads"]

_Part = TypeVar("_Part")
_Made = TypeVar("_Made")

_EMITTERS = 8
"""Rays of a listener serve so many emitters: all but an eighth of them is spared."""

_LISTENERS = 128
"""A grid is marched once for so many: under a tenth of the work of a kitchen."""


@dataclass(frozen=True)
class Batch:
    """Some emitters, each heard by the same listeners."""

    emitters: range
    """Rows of the emitters."""
    listeners: range
    """Rows of the listeners."""

    def __len__(self) -> int:
        return len(self.emitters) * len(self.listeners)


def batches(emitters: int, listeners: int, at_least: int = 1) -> list[Batch]:
    """Return all pairs in batches of like size, emitters first.

    Parameters
    ----------
    emitters, listeners : int
        How many there are.
    at_least : int
        So many batches, if there are as many listeners: one a thread.

    Examples
    --------
    >>> [len(batch) for batch in batches(2, 300)]
    [200, 200, 200]
    """
    groups = _parts(emitters, -(-emitters // _EMITTERS))
    wanted = -(-at_least // max(1, len(groups)))
    count = max(-(-listeners // _LISTENERS), min(wanted, listeners))
    return [Batch(group, part) for group in groups for part in _parts(listeners, count)]


def _parts(count: int, parts: int) -> list[range]:
    """Return ranges of like length that cover a count."""
    return [range(count * k // parts, count * (k + 1) // parts) for k in range(parts)]


def in_threads(
    work: Callable[[_Part], _Made], parts: Sequence[_Part], threads: int
) -> Iterator[_Made]:
    """Yield what work makes of each part, in their order; what fails ends all."""
    if threads == 1 or len(parts) < 2:
        yield from map(work, parts)
        return
    with ThreadPoolExecutor(threads) as pool:
        made = [pool.submit(work, part) for part in parts]
        try:
            for one in made:
                yield one.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
