"""All that is found out about one room before anything is written."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.likeness import RoomLikeness, fit_room
from analysis.likeness.floor import predicted_floor
from analysis.reciprocity import RoomDistances, measure_pairs
from rir.dataset import Dataset

__all__ = ["RoomStudy", "StudyOptions", "study_rooms"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class StudyOptions:
    """How rooms are compared.

    Parameters
    ----------
    flavour : str
        Flavour of the metrics.
    duration : float, optional
        Compare the first seconds only [s].
    position_mm : float
        Repeatability of a place, for the predicted floor [mm].
    seed : int
        Seeds the bootstrap, the grouping and the floor.
    """

    flavour: str = "paper"
    duration: float | None = None
    position_mm: float = 0.5
    seed: int = 0


@dataclass(frozen=True)
class RoomStudy:
    """Distances, likeness and floor of one room.

    Parameters
    ----------
    dataset : Dataset
        Where the room's responses are.
    distances : RoomDistances
    likeness : RoomLikeness
    floor : dict of str to float
        Predicted mean distance by metric, in its own unit.
    warming : ndarray, shape (n_pairs,)
        Logged temperature of reverse minus forward [K]; NaN where not logged.
    """

    dataset: Dataset
    distances: RoomDistances
    likeness: RoomLikeness
    floor: dict[str, float]
    warming: FloatArray

    def takes(self, k: int) -> tuple[FloatArray, FloatArray]:
        """Return the first take of both directions of a pair."""
        return first_takes(self.dataset, self.distances, k)


def first_takes(
    dataset: Dataset, room: RoomDistances, k: int
) -> tuple[FloatArray, FloatArray]:
    """Return the first take of both directions of pair `k`, shape (n,) each."""
    pair = room.pairs[k]
    rows = [int(pair.forward[0]), int(pair.reverse[0])]
    forward, reverse = np.asarray(dataset.responses[rows], float)
    return forward, reverse


def study_rooms(
    datasets: Sequence[Dataset], options: StudyOptions, rng: np.random.Generator
) -> list[RoomStudy]:
    """Compare, fit and predict every room of the data sets."""
    return [
        _study(dataset, room, options, rng)
        for dataset in datasets
        for room in measure_pairs(
            dataset, flavour=options.flavour, duration=options.duration, rng=rng
        )
    ]


def _study(
    dataset: Dataset,
    room: RoomDistances,
    options: StudyOptions,
    rng: np.random.Generator,
) -> RoomStudy:
    takes = [first_takes(dataset, room, k) for k in range(len(room.pairs))]
    forward, reverse = [list(side) for side in zip(*takes, strict=True)]
    names = pair_names(dataset, room)
    warming = _warming(dataset, room)
    rate = dataset.sample_rate
    # Ten pairs give the mean floor well enough.
    some = np.linspace(0, len(takes) - 1, min(len(takes), 10)).astype(int)
    floor = predicted_floor(
        [forward[k] for k in some],
        [reverse[k] for k in some],
        rate,
        rng,
        flavour=options.flavour,
        symbols=list(room.paired),
        temperature_changes=list(warming[some]),
        position_m=options.position_mm / 1000,
        count=None if options.duration is None else round(options.duration * rate),
    )
    likeness = fit_room(forward, reverse, names, rate)
    return RoomStudy(dataset, room, likeness, floor, warming)


def pair_names(dataset: Dataset, room: RoomDistances) -> list[str]:
    """Return how a person calls each pair, with the session if there are several.

    The session's own name for it is what its take names start with.
    """
    takes = dataset.table["take_id"]
    names = []
    for pair in room.pairs:
        own = {str(takes[rows[0]]) for rows in (pair.forward, pair.reverse)}
        heads = {name.split("_")[0] for name in own}
        head = heads.pop() if len(heads) == 1 and len(own) == 2 else ""
        names.append(head or str(pair.pair_id))
    if len({pair.session for pair in room.pairs}) == 1:
        return names
    return [f"{p.session}/{name}" for p, name in zip(room.pairs, names, strict=True)]


def _warming(dataset: Dataset, room: RoomDistances) -> FloatArray:
    logged = np.asarray(dataset.table["temperature_c"], float)
    return np.array(
        [logged[pair.reverse[0]] - logged[pair.forward[0]] for pair in room.pairs]
    )
