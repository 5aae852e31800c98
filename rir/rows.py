"""Rows of a data set: reading them by index, and the pairs among them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PairRows", "Responses", "Rows"]

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class PairRows:
    """Rows of one reciprocity pair: A to B, and B to A."""

    session: str
    pair_id: int
    forward: Rows
    reverse: Rows

    @property
    def complete(self) -> bool:
        """Whether both directions are there."""
        return len(self.forward) > 0 and len(self.reverse) > 0


class Responses:
    """All responses as an array that reads its rows when asked.

    Index with a number, a slice, a list or an integer array; the answer has
    shape (n,) or (k, n) and starts at the emission.

    Parameters
    ----------
    read : callable
        Returns the responses of some rows, shape (k, n).
    shape : tuple of int
        Rows and samples per row.
    """

    def __init__(
        self, read: Callable[[Rows], NDArray[Any]], shape: tuple[int, int]
    ) -> None:
        self._read = read
        self.shape = shape

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the samples."""
        return self[0].dtype if len(self) else np.dtype(np.float64)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, index: Any) -> NDArray[Any]:
        rows = np.arange(len(self))[index]
        block = self._read(np.atleast_1d(rows))
        return block[0] if np.ndim(rows) == 0 else block

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return (self[i] for i in range(len(self)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype=dtype)
