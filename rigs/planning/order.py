"""The order in which pairs are visited: short travel, each pair measured both ways."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Lengths = Callable[[np.ndarray, np.ndarray], np.ndarray]
RESTARTS = 40
"""Within 0.3 % of the best of 100 000 descents (docs/decisions/0033)."""


def straight_lengths(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return straight distances between points (N, 3) and (M, 3), m."""
    return np.linalg.norm(a[:, None] - b[None], axis=-1)


@dataclass(frozen=True, eq=False)
class Visits:
    """An order of pairs."""

    order: np.ndarray
    """Index of the pair visited k-th."""
    swapped: np.ndarray
    """Whether that pair begins with the emitter at its second place."""
    travel: float
    """Way of both carriers together, swaps included, m."""


@dataclass(frozen=True, eq=False)
class _Costs:
    """Ways between pair ends: node 2 k + s is pair k begun with swap state s."""

    between: np.ndarray
    first: np.ndarray
    swaps: float

    def total(self, tour: np.ndarray) -> float:
        inner = self.between[tour[:-1], tour[1:]].sum()
        return float(self.first[tour[0]] + inner + self.swaps)


def _costs(
    a: np.ndarray,
    b: np.ndarray,
    start: tuple[np.ndarray, np.ndarray] | None,
    emitter: Lengths,
    listener: Lengths,
) -> _Costs:
    count = len(a)
    ends = np.concatenate([a, b])
    by_emitter = emitter(ends, ends)
    by_listener = by_emitter if listener == emitter else listener(ends, ends)
    node = np.arange(2 * count)
    pair, swapped = node // 2, node % 2
    begins = np.where(swapped, pair + count, pair)
    finishes = np.where(swapped, pair, pair + count)
    between = (
        by_emitter[np.ix_(finishes, begins)] + by_listener[np.ix_(begins, finishes)]
    )
    between[pair[:, None] == pair[None]] = np.inf
    swap = by_emitter[np.arange(count), np.arange(count) + count]
    swap = swap + by_listener[np.arange(count) + count, np.arange(count)]
    first = np.zeros(2 * count)
    if start is not None:
        first = emitter(start[0][None], ends)[0][begins]
        first = first + listener(start[1][None], ends)[0][finishes]
    return _Costs(between, first, float(swap.sum()))


def visiting_order(
    a: np.ndarray,
    b: np.ndarray,
    *,
    rng: np.random.Generator,
    start: tuple[np.ndarray, np.ndarray] | None = None,
    emitter: Lengths = straight_lengths,
    listener: Lengths = straight_lengths,
    restarts: int = RESTARTS,
) -> Visits:
    """Find a short order of pairs.

    At each pair the emitter begins at one place and the listener at the other, then
    they change places; which begins where is free.

    Parameters
    ----------
    a, b
        The two places of each pair, shape (N, 3), m.
    rng
        Draws the perturbations of the search.
    start
        Where emitter and listener are now; free when left out.
    emitter, listener
        Way lengths of each carrier between points.
    restarts
        Perturbations tried after the first descent; fewer where pairs are many.

    Examples
    --------
    >>> a = np.array([[0.0, 0, 0], [3, 0, 0], [1, 0, 0]])
    >>> visits = visiting_order(a, a + [0, 1, 0], rng=np.random.default_rng(0))
    >>> visits.order.tolist() in ([0, 2, 1], [1, 2, 0])
    True
    >>> round(visits.travel, 6)  # three swaps, then three metres for both
    12.0
    """
    a, b = np.atleast_2d(a).astype(float), np.atleast_2d(b).astype(float)
    costs = _costs(a, b, start, emitter, listener)
    best = _descend(_greedy(costs), costs)
    for _ in range(min(restarts, 1500 // len(a)) if len(a) > 3 else 0):
        trial = _descend(_kicked(best, rng), costs)
        if costs.total(trial) < costs.total(best) - 1e-12:
            best = trial
    return Visits(best // 2, (best % 2).astype(bool), costs.total(best))


def _greedy(costs: _Costs) -> np.ndarray:
    count = len(costs.first) // 2
    tour = [int(np.argmin(costs.first))]
    open_nodes = np.ones(2 * count, bool)
    for _ in range(count - 1):
        open_nodes[[tour[-1] & ~1, tour[-1] | 1]] = False
        ways = np.where(open_nodes, costs.between[tour[-1]], np.inf)
        tour.append(int(np.argmin(ways)))
    return np.array(tour)


def _kicked(tour: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the tour with two neighbouring stretches exchanged."""
    cuts = np.sort(rng.choice(np.arange(1, len(tour) + 1), 3, replace=False))
    i, j, k = (int(cut) for cut in cuts)
    return np.concatenate([tour[:i], tour[j:k], tour[i:j], tour[k:]])


def _descend(tour: np.ndarray, costs: _Costs) -> np.ndarray:
    """Improve a tour by reversals, flips and relocations until nothing helps."""
    while True:
        for step in (_reversal, _relocation):
            better = step(tour, costs)
            if better is not None:
                tour = better
                break
        else:
            return tour


def _reversal(tour: np.ndarray, costs: _Costs) -> np.ndarray | None:
    """Return the tour with its best stretch i..j run backwards (a flip if i = j)."""
    n = len(tour)
    back = tour ^ 1
    into = np.concatenate([[0.0], costs.between[tour[:-1], tour[1:]]])
    into[0] = costs.first[tour[0]]
    out = np.concatenate([into[1:], [0.0]])
    enter = np.vstack([costs.first[back][None], costs.between[np.ix_(tour[:-1], back)]])
    leave = np.hstack([costs.between[np.ix_(back, tour[1:])], np.zeros((n, 1))])
    # entering at i now meets what was j; leaving at j now comes from what was i
    gain = into[:, None] + out[None, :] - enter - leave
    gain[np.tril_indices(n, -1)] = -np.inf
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    if gain[i, j] <= 1e-12:
        return None
    return np.concatenate([tour[:i], back[i : j + 1][::-1], tour[j + 1 :]])


def _relocation(tour: np.ndarray, costs: _Costs) -> np.ndarray | None:
    """Return the tour with one stretch of up to three pairs moved elsewhere."""
    total = costs.total(tour)
    best: tuple[float, np.ndarray] | None = None
    for size in (1, 2, 3):
        for i in range(len(tour) - size + 1):
            move = _best_place(tour, i, size, costs)
            if move is not None and (best is None or move[0] < best[0]):
                best = move
    return best[1] if best is not None and best[0] < total - 1e-12 else None


def _best_place(
    tour: np.ndarray, i: int, size: int, costs: _Costs
) -> tuple[float, np.ndarray] | None:
    rest = np.concatenate([tour[:i], tour[i + size :]])
    if not len(rest):
        return None
    piece = tour[i : i + size]
    base = costs.total(rest)
    inner = costs.between[piece[:-1], piece[1:]].sum()
    best: tuple[float, np.ndarray] | None = None
    for run in (piece, (piece ^ 1)[::-1]):
        enter = np.concatenate([[costs.first[run[0]]], costs.between[rest, run[0]]])
        leave = np.concatenate([costs.between[run[-1], rest], [0.0]])
        old = np.concatenate(
            [[costs.first[rest[0]]], costs.between[rest[:-1], rest[1:]], [0.0]]
        )
        added = enter + leave - old
        k = int(np.argmin(added))
        total = base + float(added[k]) + float(inner)
        if best is None or total < best[0]:
            best = total, np.concatenate([rest[:k], run, rest[k:]])
    return best
