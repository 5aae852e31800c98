"""Write simulated responses to files."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from rir import Poses
from rir.errors import ConfigError
from rooms.scene import Scene
from rooms.simulation import Simulation
from rooms.transport import LATE_MODEL

__all__ = ["check_target", "write_simulation"]

_KINDS = (".h5", ".npz", ".wav")


def check_target(path: Path, kinds: tuple[str, ...] = _KINDS) -> None:
    """Check, before anything is computed, that a file can be written.

    Raises
    ------
    ConfigError
        If the name ends in none of the kinds, or no file can be written there.
    """
    if path.is_dir():
        raise ConfigError(f"cannot write {path}: it is a folder; name a file")
    if kinds and path.suffix not in kinds:
        raise ConfigError(f"cannot write {path.name}: end it in {', '.join(kinds)}")
    folder = next((up for up in path.absolute().parents if up.exists()), path)
    if not folder.is_dir():
        raise ConfigError(f"cannot write {path}: {folder} is no folder")
    written = path if path.exists() else folder
    if not os.access(written, os.W_OK):
        raise ConfigError(f"cannot write {path}: no right to write to {written}")


def write_simulation(
    result: Simulation, scene: Scene, emitters: Any, listeners: Any, path: Path
) -> Path:
    """Write responses as a data set (.h5), arrays (.npz), or audio (.wav).

    An .npz holds ``responses`` (emitters, listeners, samples), the poses of both,
    ``sample_rate``, ``simulated``, and ``plan`` as JSON. A .wav has one channel a pair.

    Raises
    ------
    ConfigError
        If the name ends in neither.
    """
    places = Poses.of(emitters), Poses.of(listeners)
    rows = result.responses.reshape(-1, result.responses.shape[-1])
    if path.suffix == ".h5":
        return _write_dataset(result, scene, places, rows, path)
    if path.suffix == ".wav":
        from rir.files.audio import write_audio

        path.parent.mkdir(parents=True, exist_ok=True)
        write_audio(path, rows, result.sample_rate, subtype="FLOAT")
        return path
    if path.suffix == ".npz":
        return _write_arrays(result, scene, places, path)
    raise ConfigError(f"cannot write {path.name}: end it in .h5, .npz or .wav")


def _plan(result: Simulation) -> dict[str, Any]:
    return {
        name: {"on": verdict.on, "reason": verdict.reason}
        for name, verdict in result.plan.verdicts.items()
    }


def _story(result: Simulation) -> dict[str, Any]:
    return {
        "plan": _plan(result),
        "errors": result.errors,
        "error_parts": result.error_parts,
        "mean_errors": result.mean_errors,
        "rays": result.rays,
        "late_model": LATE_MODEL,
    }


def _write_arrays(
    result: Simulation, scene: Scene, places: tuple[Poses, Poses], path: Path
) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    story = _story(result)
    np.savez_compressed(
        path,
        responses=result.responses,
        sample_rate=result.sample_rate,
        simulated=True,
        scene=scene.name,
        plan=json.dumps(story),
        emitter_positions=places[0].positions,
        emitter_orientations=places[0].orientations,
        listener_positions=places[1].positions,
        listener_orientations=places[1].orientations,
    )
    return path


def _write_dataset(
    result: Simulation, scene: Scene, places: tuple[Poses, Poses], rows: Any, path: Path
) -> Path:
    from rir import DatasetWriter

    each, all_of = (len(place) for place in places)
    first = np.repeat(np.arange(each), all_of)
    second = np.tile(np.arange(all_of), each)
    with DatasetWriter(
        path,
        sample_rate=result.sample_rate,
        n_samples=rows.shape[1],
        simulated=True,
        room_name=scene.name,
        metadata=_story(result),
        emitter_gain=scene.emitter_gain,
        listener_gain=scene.listener_gain,
    ) as out:
        out.append(rows, places[0][first], places[1][second])
    return path
