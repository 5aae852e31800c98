"""Distances between swapped responses, and between strangers of the same room."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.differences import compared_symbols
from analysis.metrics import METRICS
from analysis.metrics.metric import Features
from rir.arrays import FloatArray
from rir.dataset import Dataset
from rir.errors import DatasetError
from rir.rows import PairRows

__all__ = ["RoomDistances", "measure_pairs", "pairs_of_rooms"]

Rows = NDArray[np.intp]

MAX_BROADCAST = 8_000_000
"""Numbers compared in one go; larger descriptions go pair by pair, in the cache."""

MAX_STRANGERS = 4000
"""Un-paired comparisons per room; more pairs are compared inside random groups."""


@dataclass(frozen=True)
class RoomDistances:
    """All distances of one room."""

    room: str
    """Name of the room."""
    simulated: bool
    """Whether any response of it was simulated."""
    flavour: str
    """Flavour of the metrics."""
    pairs: list[PairRows]
    """The pairs compared."""
    excluded: list[tuple[str, str]]
    """Pairs that were not, with the reason."""
    paired: dict[str, FloatArray] = field(default_factory=dict)
    """Distance of the two directions, with the forward and with the reverse response as
    the truth; the mean over takes. Each of shape (n_pairs, 2)."""
    unpaired: dict[str, FloatArray] = field(default_factory=dict)
    """Distances of ordered un-paired responses. Each of shape (n,)."""
    strangers: NDArray[np.intp] = field(
        default_factory=lambda: np.empty((0, 2), dtype=np.intp)
    )
    """The pairs those responses belong to. Shape (n, 2)."""

    @property
    def mark(self) -> str:
        """SIMULATED or MEASURED."""
        return "SIMULATED" if self.simulated else "MEASURED"


def measure_pairs(
    dataset: Dataset,
    *,
    flavour: str = "paper",
    symbols: Sequence[str] | None = None,
    duration: float | None = None,
    rng: np.random.Generator | None = None,
) -> list[RoomDistances]:
    """Compare the two directions of each pair, and strangers with each other.

    The time axis is the recorded one: nothing is aligned and no level matched, so
    that every difference between the directions counts.

    Parameters
    ----------
    dataset : Dataset
        Sessions with pairs, of one or more rooms.
    flavour : str
        Flavour of the metrics.
    symbols : sequence of str, optional
        Metrics to compute; :func:`analysis.differences.compared_symbols` by default.
    duration : float, optional
        Compare the first seconds only [s].
    rng : numpy.random.Generator, optional
        Draws the groups of un-paired comparisons in large sets; seed 0 by default.

    Returns
    -------
    list of RoomDistances
        One for each room, in the order of the data set.

    Raises
    ------
    DatasetError
        If no pair is complete.
    """
    chosen = compared_symbols(flavour) if symbols is None else tuple(symbols)
    compare = _Comparison(
        dataset, flavour, chosen, duration, rng or np.random.default_rng(0)
    )
    rooms = [
        compare.room(room, kept, excluded)
        for room, kept, excluded in pairs_of_rooms(dataset)
        if kept
    ]
    if not rooms:
        raise DatasetError(
            "no complete reciprocity pair in these sessions: both directions of at"
            " least one pair must have an accepted take"
        )
    return rooms


def pairs_of_rooms(
    dataset: Dataset,
) -> Iterator[tuple[str, list[PairRows], list[tuple[str, str]]]]:
    """Yield room, usable pairs, and the others with the reason."""
    room_of = {s["session"]: s["room_name"] or s["session"] for s in dataset.sessions}
    accepted = {(p.session, p.pair_id): p for p in dataset.pairs()}
    planned = dataset.pairs(accepted_only=False)
    for room in dict.fromkeys(room_of.values()):
        kept: list[PairRows] = []
        excluded: list[tuple[str, str]] = []
        for pair in planned:
            if room_of[pair.session] != room:
                continue
            usable = accepted.get((pair.session, pair.pair_id))
            reason = _why_unusable(dataset, usable)
            if usable is not None and not reason:
                kept.append(usable)
            else:
                excluded.append((f"{pair.session}/{pair.pair_id}", reason))
        yield room, kept, excluded


def _why_unusable(dataset: Dataset, pair: PairRows | None) -> str:
    if pair is None:
        return "no accepted take"
    if not pair.complete:
        missing = "B to A" if len(pair.forward) else "A to B"
        return f"no accepted take from {missing}"
    responses = dataset.responses[np.r_[pair.forward, pair.reverse]]
    if not np.all(np.isfinite(responses)):
        return "a response holds numbers that are not finite"
    if not np.all(np.any(responses, axis=-1)):
        return "a response is silent"
    return ""


@dataclass(frozen=True)
class _Comparison:
    """One way of comparing, applied to each room of a data set."""

    dataset: Dataset
    flavour: str
    symbols: tuple[str, ...]
    duration: float | None
    rng: np.random.Generator

    def responses(self, rows: Rows) -> FloatArray:
        """Return the compared part of the given rows."""
        count = self.dataset.n_samples
        if self.duration is not None:
            wanted = round(self.duration * self.dataset.sample_rate)
            count = min(count, max(1, wanted))
        return np.asarray(self.dataset.responses[rows][:, :count], float)

    def room(
        self, room: str, pairs: list[PairRows], excluded: list[tuple[str, str]]
    ) -> RoomDistances:
        simulated = {s["session"]: s["simulated"] for s in self.dataset.sessions}
        paired = {s: np.full((len(pairs), 2), np.nan) for s in self.symbols}
        found: dict[str, list[FloatArray]] = {s: [] for s in self.symbols}
        index: list[Rows] = []
        for group in _groups(len(pairs), self.rng):
            rows = np.array([[pairs[k].forward[0], pairs[k].reverse[0]] for k in group])
            samples = self.responses(rows.ravel())
            owner = np.repeat(group, 2)
            stranger = owner[:, None] != owner[None, :]
            both = np.stack(np.broadcast_arrays(owner[:, None], owner), -1)
            index.append(both[stranger])
            ahead = np.arange(0, len(owner), 2)
            for s in self.symbols:
                matrix = distance_matrix(
                    s, samples, self.dataset.sample_rate, self.flavour
                )
                found[s].append(matrix[stranger])
                paired[s][group, 0] = matrix[ahead, ahead + 1]
                paired[s][group, 1] = matrix[ahead + 1, ahead]
        self._add_further_takes(pairs, paired)
        return RoomDistances(
            room,
            any(simulated[p.session] for p in pairs),
            self.flavour,
            pairs,
            excluded,
            paired,
            {s: np.concatenate(parts) for s, parts in found.items()},
            np.concatenate(index),
        )

    def _add_further_takes(
        self, pairs: list[PairRows], paired: dict[str, FloatArray]
    ) -> None:
        """Average the paired distances over further takes of the same pair."""
        for k, pair in enumerate(pairs):
            takes = min(len(pair.forward), len(pair.reverse))
            if takes < 2:
                continue
            ends = [
                self.responses(rows[1:takes]) for rows in (pair.forward, pair.reverse)
            ]
            for symbol, table in paired.items():
                for order, (a, b) in enumerate((ends, ends[::-1])):
                    more = METRICS[symbol].difference(
                        a, b, self.dataset.sample_rate, self.flavour
                    )
                    table[k, order] = np.mean(np.r_[table[k, order], more])


def _groups(count: int, rng: np.random.Generator) -> list[Rows]:
    """Split pairs into groups so that all comparisons inside them stay in bounds."""
    size = max(2, 1 + MAX_STRANGERS // (4 * count))
    if count <= size:
        return [np.arange(count)]
    return np.array_split(rng.permutation(count), count // size)


def distance_matrix(
    symbol: str, samples: FloatArray, sample_rate: int, flavour: str
) -> FloatArray:
    """Return the distances of all ordered pairs of responses [truth, prediction].

    Examples
    --------
    >>> h = np.array([[1.0, 0.5, 0.1, 0.0], [1.0, 0.4, 0.2, 0.0]])
    >>> bool(np.all(np.diag(distance_matrix("Env", h, 8000, "paper")) == 0))
    True
    """
    chosen = METRICS[symbol].flavour(flavour)
    described = chosen.describe(samples, sample_rate)
    if chosen.matrix is not None:
        return chosen.matrix(described)
    count = len(samples)
    matrix = np.zeros((count, count))
    small = sum(part.size for part in described) <= MAX_BROADCAST
    for i in range(count):
        truth: Features = tuple(part[i] for part in described)
        if small:
            matrix[i] = chosen.compare(truth, described)
            continue
        for j in range(count):
            if i != j:
                prediction = tuple(part[j] for part in described)
                matrix[i, j] = chosen.compare(truth, prediction)
    np.fill_diagonal(matrix, 0.0)
    return matrix
