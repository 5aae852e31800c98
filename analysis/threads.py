"""Share rows of a batch among threads; each row's answer is the same as alone."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from rir.errors import SignalError

__all__ = ["share_rows"]


def share_rows(
    work: Callable[[int, int], None], rows: int, threads: int, chunk: int = 1
) -> None:
    """Call `work(first, last)` on stretches of rows that together cover all.

    Parameters
    ----------
    work : callable
        Works on rows first to last - 1.
    rows : int
        How many rows there are.
    threads : int
        How many threads work at once.
    chunk : int
        Stretches begin at multiples of so many rows.

    Raises
    ------
    SignalError
        If there is not at least one thread.

    Examples
    --------
    >>> share_rows(print, 10, 1)
    0 10
    """
    if threads < 1:
        raise SignalError(f"threads must be at least 1, not {threads}")
    if threads == 1 or rows <= chunk:
        work(0, rows)
        return
    # More stretches than threads: some rows take longer than others.
    size = max(rows // (8 * threads) // chunk, 1) * chunk
    with ThreadPoolExecutor(threads) as pool:
        starts = range(0, rows, size)
        list(pool.map(lambda first: work(first, min(first + size, rows)), starts))
