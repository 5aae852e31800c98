"""Takes that are unlike the other takes of the same thing."""

import numpy as np

from capture.deconvolution.takes import FEWEST_TO_JUDGE, HARMLESS_DB, MARGIN_DB
from rir.arrays import FloatArray

__all__ = ["find_outlier", "take_distances"]


def take_distances(responses: FloatArray) -> FloatArray:
    """Return how far each take is from the sample-wise median take [dB].

    Parameters
    ----------
    responses : ndarray, shape (takes, n)
        Responses between the same places.

    Examples
    --------
    >>> takes = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 0.1]])
    >>> take_distances(takes).round(1).tolist()
    [-inf, -inf, -20.0]
    """
    median = np.median(responses, axis=0)
    energy = np.sum((responses - median) ** 2, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return 10 * np.log10(energy / np.sum(median**2))


def find_outlier(responses: FloatArray) -> tuple[int, str] | None:
    """Return the take that should be made again, and why; None if they agree.

    With fewer than three takes nobody can tell which one is wrong.

    Parameters
    ----------
    responses : ndarray, shape (takes, n)
        Responses between the same places.
    """
    if len(responses) < FEWEST_TO_JUDGE:
        return None
    distances = take_distances(responses)
    worst = int(np.argmax(distances))
    usual = float(np.median(distances))
    limit = max(usual + MARGIN_DB, HARMLESS_DB)
    if not distances[worst] > limit:
        return None
    return worst, (
        f"it differs from the median take by {distances[worst]:.1f} dB, "
        f"the others by {max(usual, -200.0):.1f} dB (limit {limit:.1f} dB)"
    )
