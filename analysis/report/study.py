"""All that is found out about one room before anything is written."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.likeness import RoomLikeness, fit_room
from analysis.likeness.floor import predicted_floor
from analysis.reciprocity import RoomDistances, measure_pairs
from rir.arrays import FloatArray
from rir.dataset import Dataset

__all__ = ["RoomStudy", "StudyOptions", "study_rooms"]

ASSUMED_MM = 0.5
"""Repeatability of places where a measured session does not state it."""


@dataclass(frozen=True)
class StudyOptions:
    """How rooms are compared.

    Parameters
    ----------
    flavour : str
        Flavour of the metrics.
    duration : float, optional
        Compare the first seconds only [s].
    position_mm : float, optional
        Standard deviation of one visit to a place along each axis, for the predicted
        floor [mm]; what the session says when left out.
    seed : int
        Seeds the bootstrap, the grouping and the floor.
    """

    flavour: str = "paper"
    duration: float | None = None
    position_mm: float | None = None
    seed: int = 0


@dataclass(frozen=True)
class RoomStudy:
    """Distances, likeness and floor of one room."""

    dataset: Dataset
    """Where the room's responses are."""
    distances: RoomDistances
    likeness: RoomLikeness
    floor: dict[str, float]
    """Predicted mean distance by metric, in its own unit."""
    warming: FloatArray
    """Logged temperature of reverse minus forward [K]; NaN where not logged. Shape
    (n_pairs,)."""
    position_mm: float
    """Repeatability of places that the floor was predicted with [mm]."""

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
    position_mm = options.position_mm
    if position_mm is None:
        position_mm = stated_repeatability(dataset, room)
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
        stored=dataset.responses.dtype,
        position_m=position_mm / 1000,
        count=None if options.duration is None else round(options.duration * rate),
    )
    likeness = fit_room(forward, reverse, names, rate)
    return RoomStudy(dataset, room, likeness, floor, warming, position_mm)


def stated_repeatability(dataset: Dataset, room: RoomDistances) -> float:
    """Return what the room's sessions say of how exactly places are met [mm].

    A session that says nothing met them exactly if it was simulated, and is taken
    to half a millimetre if it was measured.
    """
    own = {pair.session for pair in room.pairs}
    sigmas = [0.0]
    for session in dataset.sessions:
        if session["session"] in own:
            config = session.get("config") or {}
            simulation = config.get("simulation") or {}
            stated = config.get("placement_sigma_mm")
            if stated is None and session["simulated"]:
                stated = simulation.get("placement_mm", 0.0)
            sigmas.append(ASSUMED_MM if stated is None else float(stated))
    return max(sigmas)


def pair_names(dataset: Dataset, room: RoomDistances) -> list[str]:
    """Return how a person calls each pair, with the session if there are several."""
    column = dataset.table.get("pair_name")
    names = [
        str(pair.pair_id if column is None else column[pair.forward[0]])
        for pair in room.pairs
    ]
    if len({pair.session for pair in room.pairs}) == 1:
        return names
    return [f"{p.session}/{name}" for p, name in zip(room.pairs, names, strict=True)]


def _warming(dataset: Dataset, room: RoomDistances) -> FloatArray:
    logged = np.asarray(dataset.table["temperature_c"], float)
    return np.array(
        [logged[pair.reverse[0]] - logged[pair.forward[0]] for pair in room.pairs]
    )
