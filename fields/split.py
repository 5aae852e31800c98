"""Training and test rows that share no emitter and no swapped twin, as a file."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from rir import Dataset
from rir.errors import DatasetError
from rir.schema import Schema

__all__ = ["SPLIT", "Split", "split_by_emitter", "split_spread", "twin_rows"]

SPLIT = Schema("split file", 1)
SAME_PLACE_M = 0.01
"""A stand put back on its mark is within a centimetre of where it was."""


@dataclass(frozen=True)
class Split:
    """Name the rows to learn from and the rows to be tested on.

    Parameters
    ----------
    train, test : tuple of int
        Row numbers of the data set.
    dropped : tuple of int
        Rows used for neither, because they are swapped twins of test rows.
    unit : str
        What was kept apart: "emitter", "pair" (both ends of a reciprocity
        pair) or "row" (a single emitter: no emitter is left to hold out).
    seed : int
        Seed of the draw.
    rows : int
        Rows of the data set the split belongs to.
    """

    train: tuple[int, ...]
    test: tuple[int, ...]
    dropped: tuple[int, ...] = ()
    unit: str = "emitter"
    seed: int = 0
    rows: int = 0
    schema: int = SPLIT.version

    def save(self, path: Path) -> None:
        """Write the split as JSON."""
        path.write_text(json.dumps(asdict(self)) + "\n")

    @classmethod
    def load(cls, path: Path, dataset: Dataset) -> "Split":
        """Read a split and check that it belongs to ``dataset``.

        Raises
        ------
        DatasetError
            If there is no such file, or it is no split, is newer than this program
            or was made for other rows.
        """
        try:
            written = json.loads(path.read_text())
        except (OSError, ValueError) as error:
            raise DatasetError(
                f"{path} is no split file ({error}); leave --split out to draw one"
            ) from error
        plain = SPLIT.open(written, path)
        try:
            for key in ("train", "test", "dropped"):
                plain[key] = tuple(int(row) for row in plain[key])
            split = cls(**plain)
        except (KeyError, TypeError, ValueError) as error:
            raise DatasetError(
                f"{path} is no split file: {type(error).__name__} {error}"
            ) from error
        if split.rows != len(dataset):
            raise DatasetError(
                f"{path} splits {split.rows} rows, the data set has {len(dataset)}"
            )
        split.check()
        return split

    def check(self) -> None:
        """Refuse row numbers that the data set does not have.

        Raises
        ------
        DatasetError
            If a row lies outside, or is on both sides.
        """
        named = [*self.train, *self.test, *self.dropped]
        if named and not 0 <= min(named) <= max(named) < self.rows:
            raise DatasetError(
                f"the split names rows {min(named)} to {max(named)} of {self.rows}"
            )
        both = set(self.train) & set(self.test)
        if both:
            raise DatasetError(
                f"the split trains and tests on {len(both)} same rows (first: "
                f"{min(both)})"
            )

    def describe(self) -> str:
        """Return one line for a person."""
        twins = f", {len(self.dropped)} swapped twins left out" if self.dropped else ""
        return (
            f"{len(self.train)} training rows, {len(self.test)} test rows, "
            f"disjoint by {self.unit}{twins}"
        )


def split_by_emitter(
    dataset: Dataset,
    *,
    test_fraction: float = 0.25,
    seed: int = 0,
    tolerance: float = SAME_PLACE_M,
) -> Split:
    """Hold out emitters, and with them every swapped twin of a test row.

    A row with its ends swapped is by reciprocity the same response, so a
    training row whose twin is tested would leak the answer. Reciprocity pairs
    stay whole: both directions are on the same side of the split. Where a place
    is an emitter in one row and a listener in another, the training rows that
    mirror a test row are dropped. A data set whose column "split" says train or
    test of every row, as simulated ones do, is divided as it says.

    Parameters
    ----------
    dataset : Dataset
        The responses to divide.
    test_fraction : float
        Part of the emitters (or pairs) held out; at least one.
    seed : int
        Draws the emitters.
    tolerance : float
        Two poses nearer than this are the same place, metres.

    Raises
    ------
    DatasetError
        If ``test_fraction`` is not between 0 and 1.
    """
    if not 0 < test_fraction < 1:
        raise DatasetError(f"test fraction {test_fraction:g} is not between 0 and 1")
    emitters, listeners = _place_numbers(dataset, tolerance)
    units, unit = _units(dataset, emitters, listeners)
    test = _given(dataset)
    if test is None:
        test = _drawn(units, test_fraction, np.random.default_rng(seed))
    else:
        unit = "the data set's own split"
    return _without_twins(emitters, listeners, test, unit, seed)


def split_spread(
    dataset: Dataset, count: int, *, tolerance: float = SAME_PLACE_M
) -> Split:
    """Train on a few emitters that stand far apart, test on all the others.

    The first is the one nearest the middle of all; each further one stands
    farthest from those chosen. Nothing is drawn. Swapped twins of test rows are
    dropped, as by :func:`split_by_emitter`; a column "split" is not looked at.

    Parameters
    ----------
    dataset : Dataset
        The responses to divide.
    count : int
        Emitters to train on.
    tolerance : float
        Two poses nearer than this are the same place, metres.

    Raises
    ------
    DatasetError
        If the data set has no emitter left to test on.
    """
    emitters, listeners = _place_numbers(dataset, tolerance)
    names, first = np.unique(emitters, return_index=True)
    if not 0 < count < len(names):
        raise DatasetError(
            f"{count} emitters to train on, of {len(names)}: at least one must be "
            "trained on and one left for the test"
        )
    places = dataset.emitters.positions[first]
    test = ~np.isin(emitters, names[_far_apart(places, count)])
    return _without_twins(emitters, listeners, test, "emitter", 0)


def _far_apart(places: np.ndarray, count: int) -> list[int]:
    gaps = np.linalg.norm(places - places.mean(axis=0), axis=1)
    chosen = [int(np.argmin(gaps))]
    nearest = np.full(len(places), np.inf)
    while len(chosen) < count:
        gaps = np.linalg.norm(places - places[chosen[-1]], axis=1)
        nearest = np.minimum(nearest, gaps)
        chosen.append(int(np.argmax(nearest)))
    return chosen


def _without_twins(
    emitters: np.ndarray, listeners: np.ndarray, test: np.ndarray, unit: str, seed: int
) -> Split:
    dropped = ~test & twin_rows(emitters, listeners, test)
    train = ~test & ~dropped
    return Split(
        train=_numbers(train),
        test=_numbers(test),
        dropped=_numbers(dropped),
        unit=unit,
        seed=seed,
        rows=len(test),
    )


def twin_rows(
    emitters: np.ndarray, listeners: np.ndarray, of: np.ndarray
) -> np.ndarray:
    """Mark the rows that are the swap of a row in ``of``.

    Parameters
    ----------
    emitters, listeners : numpy.ndarray
        Place numbers of the two ends, shape (rows,), int.
    of : numpy.ndarray
        Rows whose twins are sought, shape (rows,), bool.

    Returns
    -------
    numpy.ndarray
        Shape (rows,), bool.

    Examples
    --------
    >>> e, l = np.array([0, 1, 2]), np.array([1, 0, 1])
    >>> twin_rows(e, l, np.array([True, False, False]))
    array([False,  True, False])
    """
    count = int(max(emitters.max(), listeners.max())) + 1
    swapped = listeners[of].astype(np.int64) * count + emitters[of]
    return np.isin(emitters.astype(np.int64) * count + listeners, swapped)


def _place_numbers(dataset: Dataset, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    places = np.vstack([dataset.emitters.positions, dataset.listeners.positions])
    from scipy.spatial import KDTree

    near = KDTree(places).query_pairs(tolerance, output_type="ndarray")
    numbers = _components(len(places), near)
    return numbers[: len(dataset)], numbers[len(dataset) :]


def _components(count: int, edges: np.ndarray) -> np.ndarray:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ones = np.ones(len(edges))
    graph = coo_matrix((ones, (edges[:, 0], edges[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _units(
    dataset: Dataset, emitters: np.ndarray, listeners: np.ndarray
) -> tuple[np.ndarray, str]:
    if len(np.unique(emitters)) == 1:
        return np.arange(len(dataset)), "row"
    if dataset.pairs():
        ends = np.stack([emitters, listeners], axis=1)
        count = int(ends.max()) + 1
        groups = _components(count, ends)[emitters]
        if len(np.unique(groups)) > 1:
            return groups, "pair"
    return emitters, "emitter"


def _given(dataset: Dataset) -> np.ndarray | None:
    if "split" not in dataset.table:
        return None
    names = np.asarray(dataset.table["split"]).astype(str)
    whole = np.isin(names, ["train", "test"]).all()
    return names == "test" if whole and len(np.unique(names)) == 2 else None


def _drawn(units: np.ndarray, fraction: float, rng: np.random.Generator) -> np.ndarray:
    names = np.unique(units)
    wanted = min(max(1, round(fraction * len(names))), len(names) - 1)
    return np.isin(units, rng.permutation(names)[:wanted])


def _numbers(mask: np.ndarray) -> tuple[int, ...]:
    return tuple(int(row) for row in np.flatnonzero(mask))
