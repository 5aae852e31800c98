"""Acoustic survey: places refined from the travel times of the direct sound."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rir.errors import SignalError

ONSET_DB = -20.0
"""First sound: the first local maximum not further than this below the largest."""

REACH, FINENESS = 64, 500
"""Samples used and steps per sample in finding the top between samples."""


def direct_time(response: ArrayLike, sample_rate: int) -> float:
    """Return the arrival time of the direct sound in seconds, between samples.

    Parameters
    ----------
    response
        Impulse response, shape (n,), sample 0 = emission.
    sample_rate
        Samples per second, Hz.

    Raises
    ------
    SignalError
        If the response is silent.

    Examples
    --------
    >>> n = np.arange(256)
    >>> response = np.sinc(n - 100.25)
    >>> round(1000 * direct_time(response, 1000), 2)
    100.25
    """
    size = np.abs(np.asarray(response, dtype=float))
    peak = float(size.max(initial=0.0))
    if not peak > 0.0:
        raise SignalError("the response is silent, so it has no direct sound")
    loud = size[1:-1] >= peak * 10 ** (ONSET_DB / 20)
    summit = (size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])
    found = np.flatnonzero(loud & summit)
    k = int(found[0]) + 1 if len(found) else int(np.argmax(size))
    # ripples before a band-limited pulse: the pulse itself is the largest nearby
    k += int(np.argmax(size[k : k + 12]))
    return _between_samples(np.asarray(response, dtype=float), k) / sample_rate


def _between_samples(response: np.ndarray, k: int) -> float:
    """Return where the band-limited response is largest near a sample."""
    low, high = max(0, k - REACH), min(len(response), k + REACH)
    fine = k + np.linspace(-1.0, 1.0, 2 * FINENESS + 1)
    kernel = np.sinc(fine[:, None] - np.arange(low, high))
    return float(fine[int(np.argmax(np.abs(kernel @ response[low:high])))])


@dataclass(frozen=True, eq=False)
class Survey:
    """Refined places."""

    places: np.ndarray
    """Shape (N, 3), m."""
    offset: float
    """Length common to all links (a wrong latency), m."""
    residuals: np.ndarray
    """Measured minus refined length of each link, shape (M,), m."""
    sigma: np.ndarray
    """Standard deviation of each coordinate, shape (N, 3), m."""


def refine_places(
    places: ArrayLike,
    links: ArrayLike,
    lengths: ArrayLike,
    *,
    place_sigma: float | np.ndarray = 5e-3,
    length_sigma: float = 1e-3,
    fit_offset: bool = True,
) -> Survey:
    """Refine places so that distances agree with measured direct-sound lengths.

    The rig's own places enter with their uncertainty, so the frame stays the rig's,
    and a place seen by too few links stays where it was.

    Parameters
    ----------
    places
        Places the rig reported, shape (N, 3), m.
    links
        Index pairs of emitter and listener place, shape (M, 2).
    lengths
        Direct-sound time times speed of sound of each link, shape (M,), m.
    place_sigma
        Uncertainty of the places, m; a number, or one for each coordinate (N, 3).
    length_sigma
        Uncertainty of the lengths, m.
    fit_offset
        Whether to find a length common to all links.

    References
    ----------
    Gauss-Markov estimate with prior: A. Tarantola, Inverse Problem Theory (2005),
    eq. 3.56, iterated.

    Examples
    --------
    >>> true = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [3, 4, 1.0]])
    >>> links = [(i, j) for i in range(4) for j in range(i)]
    >>> lengths = [np.linalg.norm(true[i] - true[j]) for i, j in links]
    >>> guess = true + [[0.01, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    >>> survey = refine_places(guess, links, lengths, length_sigma=1e-4)
    >>> error = np.linalg.norm(survey.places - true, axis=1)
    >>> bool(error.max() < 0.008)
    True
    """
    start = np.asarray(places, dtype=float)
    i, j = np.asarray(links, dtype=int).T
    measured = np.asarray(lengths, dtype=float)
    prior = np.broadcast_to(np.asarray(place_sigma, dtype=float), start.shape)
    unknown = np.append(start.ravel(), 0.0)
    trust = np.append(1.0 / prior.ravel() ** 2, 1e-6 if fit_offset else 1e18)
    base = unknown.copy()
    normal = np.diag(trust)
    for _ in range(20):
        jacobian, model = _model(unknown, i, j, len(start))
        weighted = jacobian.T / length_sigma**2
        normal = weighted @ jacobian + np.diag(trust)
        pull = weighted @ (measured - model) + trust * (base - unknown)
        step = np.linalg.solve(normal, pull)
        unknown = unknown + step
        if np.max(np.abs(step)) < 1e-10:
            break
    _, model = _model(unknown, i, j, len(start))
    spread = np.sqrt(np.diag(np.linalg.inv(normal)))
    return Survey(
        unknown[:-1].reshape(-1, 3),
        float(unknown[-1]),
        measured - model,
        spread[:-1].reshape(-1, 3),
    )


def _model(
    unknown: np.ndarray, i: np.ndarray, j: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return derivatives and lengths of all links."""
    places = unknown[:-1].reshape(-1, 3)
    between = places[i] - places[j]
    distance = np.linalg.norm(between, axis=1)
    unit = between / np.maximum(distance, 1e-12)[:, None]
    jacobian = np.zeros((len(i), 3 * count + 1))
    rows = np.arange(len(i))
    for k in range(3):
        jacobian[rows, 3 * i + k] += unit[:, k]
        jacobian[rows, 3 * j + k] -= unit[:, k]
    jacobian[:, -1] = 1.0
    return jacobian, distance + unknown[-1]
