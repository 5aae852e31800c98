"""Where the pairs of a session stand: drawn at random, or read from a file."""

from pathlib import Path

import numpy as np

from capture.config import PlaceConfig, PlacePair, PlacePairsFile
from rir import ConfigError, OutOfReachError, Pose, RoomSpec
from rir.config import load_yaml

__all__ = ["draw_pairs", "load_pairs", "pair_between"]

TRIES = 20_000  # a second at most; rooms that need more have no space


def pair_between(name: str, a: np.ndarray, b: np.ndarray) -> PlacePair:
    """Return a pair whose two fronts face each other.

    Parameters
    ----------
    name : str
        Name of the pair.
    a, b : ndarray, shape (3,)
        The two places [m].
    """
    return PlacePair(
        id=name,
        a=PlaceConfig.of(Pose.facing(a, b)),
        b=PlaceConfig.of(Pose.facing(b, a)),
    )


def draw_pairs(
    room: RoomSpec,
    count: int,
    *,
    rng: np.random.Generator,
    clearance: float = 0.5,
    apart: float = 1.0,
    heights: tuple[float, float] = (0.9, 1.8),
) -> list[PlacePair]:
    """Draw pairs of places in the free air of a room.

    Parameters
    ----------
    room : RoomSpec
        The room; its furniture is kept clear of.
    count : int
        How many pairs.
    rng : numpy.random.Generator
        Source of the draw; the same state gives the same pairs.
    clearance : float
        Distance kept to walls and furniture [m].
    apart : float
        Least distance between the two places of a pair [m].
    heights : tuple of float
        Lowest and highest place [m].

    Raises
    ------
    ConfigError
        If the room has no space for such pairs.
    """
    pairs: list[PlacePair] = []
    for _ in range(TRIES):
        if len(pairs) == count:
            return pairs
        a, b = (_point(room, rng, clearance, heights) for _ in range(2))
        if np.linalg.norm(a - b) < apart or not _free(room, (a, b), clearance):
            continue
        pairs.append(pair_between(f"P{len(pairs) + 1:02d}", a, b))
    raise ConfigError(
        f"found {len(pairs)} of {count} pairs in {room.name} that keep {clearance:g} m "
        f"to walls and furniture and are {apart:g} m apart; lower --clearance or "
        "--apart, or list the pairs in a file"
    )


def _point(
    room: RoomSpec,
    rng: np.random.Generator,
    clearance: float,
    heights: tuple[float, float],
) -> np.ndarray:
    """Draw a place, in whole millimetres as a person would mark it."""
    x, y, z = room.size_m
    low = np.array([clearance, clearance, min(heights[0], z / 2)])
    high = np.array([x - clearance, y - clearance, min(heights[1], z - clearance)])
    return np.round(low + rng.random(3) * np.maximum(high - low, 0.0), 3)


def _free(
    room: RoomSpec, places: tuple[np.ndarray, np.ndarray], clearance: float
) -> bool:
    try:
        for place in places:
            room.check_inside(place, clearance)
    except OutOfReachError:
        return False
    return True


def load_pairs(path: Path) -> list[PlacePair]:
    """Read pairs from a YAML file: ``pairs: [{a: [x, y, z], b: [x, y, z]}, …]``.

    Raises
    ------
    ConfigError
        With every mistake and its place.
    """
    listed = load_yaml(path, PlacePairsFile).pairs
    return [
        pair_between(pair.id or f"P{number:02d}", np.array(pair.a), np.array(pair.b))
        for number, pair in enumerate(listed, start=1)
    ]
