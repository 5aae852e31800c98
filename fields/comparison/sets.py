"""Data sets to compare fields on: built-in simulated ones, or any file."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fields.data import FieldData, prepare
from rir import Dataset, Poses

__all__ = ["DividedSet", "built_in", "jitter_floor", "open_divided"]

FLOOR_ROWS = 48
"""Rows simulated again for the floor: each is a simulation of its own."""


@dataclass(frozen=True, eq=False)
class DividedSet:
    """Hold a data set divided for a comparison.

    Parameters
    ----------
    name : str
        Shown in tables.
    mark : str
        SIMULATED or MEASURED.
    train, test : FieldData
        Rows of training emitters, and of emitters no model has heard.
    scene : str
        Name of the simulated scene; empty for files.
    """

    name: str
    mark: str
    train: FieldData
    test: FieldData
    scene: str = ""


def built_in(
    scene: str,
    gains: str,
    listeners: int,
    folder: Path,
    *,
    fewer: int = 1,
    duration: float = 0.1,
) -> Path:
    """Return the file of a built-in set, simulated on first use.

    Parameters
    ----------
    scene : str
        A scene of ``rooms``: kitchen, l-shaped, coupled and so on.
    gains : str
        "same" (both ends omnidirectional) or "diff" (cardioid emitter).
    listeners : int
        Listeners on one grid that all emitters share; about 150 is the small
        CPU size, 5000 the paper's.
    folder : Path
        Where the files are kept.
    fewer : int
        Keep every so-many-th listener.
    """
    from rooms.factory import Recipe, make_dataset

    recipe = Recipe(
        scene, listeners=listeners, gains=gains, fewer=fewer, duration=duration
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{scene}-{gains}-{listeners}-{fewer}-{recipe.key}.h5"
    return path if path.exists() else make_dataset(recipe, path)


def open_divided(
    path: Path,
    name: str,
    *,
    train_emitters: int | None = None,
    most_test_rows: int = 600,
    seed: int = 0,
    scene: str = "",
    spread_emitters: int | None = None,
) -> DividedSet:
    """Open a set and divide it by its own "split" column, or by emitter.

    Parameters
    ----------
    path : Path
        Data-set file or session folder.
    name : str
        Shown in tables.
    train_emitters : int, optional
        Use only the first so many training emitters.
    most_test_rows : int
        Score at most so many rows, drawn evenly.
    seed : int
        Of the split, where the set brings none.
    scene : str
        Name of the simulated scene.
    spread_emitters : int, optional
        Train on so many emitters that stand far apart, and test on all others,
        in place of the set's own split.
    """
    dataset = Dataset.open(path)
    train, test = _divided(dataset, seed, spread_emitters)
    if train_emitters is not None:
        places = dataset.emitters.positions[train]
        _, first = np.unique(places.round(4), axis=0, return_index=True)
        kept = places[np.sort(first)[:train_emitters]].round(4)
        train = train[(places.round(4)[:, None] == kept).all(-1).any(-1)]
    data = prepare(dataset, train_rows=train, seed=seed)
    count = min(len(test), most_test_rows)
    test = test[np.linspace(0, len(test) - 1, count).astype(int)]
    return DividedSet(name, dataset.mark, data.rows(train), data.rows(test), scene)


def _divided(
    dataset: Dataset, seed: int, spread_emitters: int | None
) -> tuple[np.ndarray, np.ndarray]:
    from fields.split import split_by_emitter, split_spread

    if spread_emitters is None:
        split = split_by_emitter(dataset, seed=seed)
    else:
        split = split_spread(dataset, spread_emitters)
    return np.array(split.train), np.array(split.test)


def jitter_floor(divided: DividedSet, spread_m: float = 0.003) -> FieldData | None:
    """Return test rows simulated again with both ends a little off.

    No model can be asked to do better than the truth does when places are known
    to so many metres only. None for sets that are not built in.
    """
    if not divided.scene:
        return None
    from dataclasses import replace

    from rooms import simulate
    from rooms.builtin import load_scene

    test = divided.test
    rows = np.linspace(0, len(test) - 1, min(len(test), FLOOR_ROWS)).astype(int)
    scene = load_scene(divided.scene)
    frame = test.frame
    scene = replace(
        scene,
        emitter_gain=frame.emitter_gain or scene.emitter_gain,
        listener_gain=frame.listener_gain or scene.listener_gain,
    )
    rng = np.random.default_rng(0)
    moved = np.empty((len(rows), frame.n_samples))
    for number, row in enumerate(rows):
        ends = [
            Poses(
                one.positions[row : row + 1] + spread_m * rng.standard_normal((1, 3)),
                one.orientations[row : row + 1],
            )
            for one in (test.emitters, test.listeners)
        ]
        moved[number] = simulate(
            scene,
            *ends,
            sample_rate=int(frame.sample_rate),
            duration=frame.n_samples / frame.sample_rate,
        ).responses[0, 0]
    return replace(test.rows(rows), responses=(moved / frame.scale).astype(np.float32))
