"""Find channels that fell silent: a pulled cable gives exact zeros and no flag."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["longest_zeros", "silent_channels"]

LONGEST_S = 0.02  # a sweep passes zero thousands of times in it
ARRIVAL_S = 0.1  # sound from 34 m has come by then


def silent_channels(
    samples: NDArray[np.float64], sample_rate: int, start: int, stop: int
) -> list[str]:
    """Return one sentence for each channel that is exactly zero during the sweep.

    Parameters
    ----------
    samples : ndarray, shape (channels, n)
        The take; its last channel may be the loopback.
    sample_rate : int
        Rate [Hz].
    start, stop : int
        The sweep; the first 0.1 s of it are left out, since sound needs time.
    """
    begin = start + round(ARRIVAL_S * sample_rate)
    told = []
    for channel, row in enumerate(samples[:, begin:stop]):
        at, length = longest_zeros(row)
        if length >= LONGEST_S * sample_rate:
            told.append(
                f"channel {channel} is exactly zero for {length / sample_rate:.2f} s "
                f"from {(begin + at) / sample_rate:.2f} s on: a cable is out or the "
                "device has stopped"
            )
    return told


def longest_zeros(row: NDArray[np.float64]) -> tuple[int, int]:
    """Return where the longest run of exact zeros begins, and its length.

    Examples
    --------
    >>> longest_zeros(np.array([1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0]))
    (3, 3)
    """
    edges = np.flatnonzero(np.concatenate(([1.0], row, [1.0])))
    gaps = np.diff(edges) - 1
    index = int(np.argmax(gaps))
    return int(edges[index]), int(gaps[index])
