"""Where the direct sound of a response begins."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["find_onset"]


def find_onset(samples: ArrayLike, share: float = 0.1) -> NDArray[np.intp]:
    """Return the first sample that reaches a share of the largest, shape (...).

    Parameters
    ----------
    samples : array_like, shape (..., n)
        Responses. For silent ones the answer is 0.
    share : float
        Of the largest amplitude; 0.1 is the 20 dB of the standard.

    References
    ----------
    ISO 3382-1:2009, A.3.4.

    Examples
    --------
    >>> int(find_onset([0.0, 0.05, 0.2, -1.0]))
    2
    """
    size = np.abs(np.asarray(samples))
    return np.argmax(size >= share * size.max(axis=-1, keepdims=True), axis=-1)
