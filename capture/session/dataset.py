"""Derive the data set of a session from its configuration, journal and raw files."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from capture.config import SessionConfig
from capture.plan import Measure, build_plan
from capture.session.folder import SessionFolder, file_sha256
from capture.session.journal import read_journal
from capture.session.state import SessionState, TakeState
from capture.session.take_judge import TakeJudge, take_poses
from capture.signal.calibration import read_microphone_file
from rir import DatasetWriter, GainPattern, Poses, SessionError, SignalError

__all__ = ["build_dataset", "lost_takes"]

log = logging.getLogger(__name__)

BLOCK = 32  # takes written at once: few chunks touched twice, few MB held


def build_dataset(folder: SessionFolder) -> Path:
    """Write ``dataset.h5`` anew; the same session gives the same bytes.

    Rows are ordered by the plan, whatever order the takes were recorded in. A
    take whose raw file is missing or was changed is left out.

    Parameters
    ----------
    folder : SessionFolder
        The session.

    Returns
    -------
    Path
        The data set.

    Raises
    ------
    SessionError
        If the session has no good take.
    """
    config = folder.load_config()
    state = SessionState.of(read_journal(folder.journal_path).events)
    takes = list(_usable_takes(folder, config, state))
    if not takes:
        raise SessionError(f"{folder.path} has no good take yet; run the session first")
    take_judge = TakeJudge(config)
    with _writer(folder, config, take_judge, state) as writer:
        rows = Rows(writer)
        for measure, take in takes:
            _append(rows, folder, take_judge, state, measure, take)
        rows.flush()
    return folder.dataset_path


class Rows:
    """Rows on their way into a data set, written in blocks."""

    def __init__(self, writer: DatasetWriter) -> None:
        self._writer = writer
        self._waiting: list[tuple[Any, Poses, Poses, dict[str, Any]]] = []

    def add(
        self, responses: Any, emitters: Poses, listeners: Poses, columns: dict[str, Any]
    ) -> None:
        """Take some rows; every column has one value per row."""
        self._waiting.append((responses, emitters, listeners, columns))
        if len(self._waiting) >= BLOCK:
            self.flush()

    def flush(self) -> None:
        """Write what is waiting."""
        if not self._waiting:
            return
        responses, emitters, listeners, columns = zip(*self._waiting, strict=True)
        self._waiting = []
        poses = [
            Poses(
                np.concatenate([some.positions for some in ends]),
                np.concatenate([some.orientations for some in ends]),
            )
            for ends in (emitters, listeners)
        ]
        self._writer.append(
            np.concatenate(responses),
            poses[0],
            poses[1],
            {
                name: np.concatenate([column[name] for column in columns])
                for name in columns[0]
            },
        )


def _usable_takes(
    folder: SessionFolder, config: SessionConfig, state: SessionState
) -> Iterator[tuple[Measure, TakeState]]:
    for measure in build_plan(config).measures:
        if measure.closure:
            continue
        for take in state.accepted(measure.key):
            problem = raw_problem(folder, take)
            if problem is None:
                yield measure, take
            else:
                log.warning("%s left out: %s", take.name, problem)


def raw_problem(folder: SessionFolder, take: TakeState) -> str | None:
    """Return what is wrong with a take's raw file, None if it is as recorded."""
    path = folder.path / take.event["file"]
    if not path.exists():
        return f"{take.event['file']} is missing"
    if file_sha256(path) != take.event["sha256"]:
        return f"{take.event['file']} was changed (its SHA-256 differs)"
    return None


def lost_takes(folder: SessionFolder, state: SessionState) -> dict[str, str]:
    """Return the good takes whose raw files cannot be trusted, with the reason."""
    problems = {
        take.name: raw_problem(folder, take)
        for take in state.takes.values()
        if take.accepted
    }
    return {name: problem for name, problem in problems.items() if problem}


def _writer(
    folder: SessionFolder,
    config: SessionConfig,
    take_judge: TakeJudge,
    state: SessionState,
) -> DatasetWriter:
    simulation = config.simulation if config.simulated else None
    gain = None
    if simulation is not None:
        cardioid = simulation.loudspeaker == "cardioid"
        gain = GainPattern.cardioid() if cardioid else GainPattern.omni()
    about = state.first.get("about", {})
    return DatasetWriter(
        folder.dataset_path,
        sample_rate=config.sample_rate,
        n_samples=take_judge.length,
        simulated=config.simulated or about.get("simulated", False),
        pre=take_judge.pre,
        dtype="float64" if simulation and simulation.exact else "float32",
        session=folder.path.resolve().name,
        room=config.room,
        metadata={
            "config": config.model_dump(mode="json"),
            "sweep": take_judge.sweep.describe(),
            "started": about,
            **({"notes": state.notes} if state.notes else {}),
        },
        created_utc=state.first.get("time", ""),
        emitter_gain=gain,
        listener_gain=GainPattern.omni() if simulation else None,
        extras={"excitation": np.asarray(take_judge.sweep), **_microphone(config)},
    )


def _microphone(config: SessionConfig) -> dict[str, Any]:
    """Return the microphone's own response, where a file gives it."""
    name = config.calibration.microphone_file
    if name is None:
        return {}
    return {"microphone_hz_db": np.stack(read_microphone_file(Path(name)), axis=1)}


def _append(
    rows: Rows,
    folder: SessionFolder,
    take_judge: TakeJudge,
    state: SessionState,
    measure: Measure,
    take: TakeState,
) -> None:
    started = state.started[take.name]
    try:
        samples = folder.read_raw(take.event["file"])
    except SignalError as error:
        log.warning("%s left out: %s", take.name, error)
        return
    responses = take_judge.deconvolve(samples)
    emitters, listeners = take_poses(take_judge.config, started)
    speakers, channels = np.indices((len(emitters), len(listeners))).reshape(2, -1)
    columns = _columns(take_judge.config, measure, take, started)
    rows.add(
        responses,
        Poses.of([emitters[k] for k in speakers]),
        Poses.of([listeners[k] for k in channels]),
        {
            "channel": channels,
            "loudspeaker": measure.loudspeaker + speakers,
            **{name: np.full(len(channels), v) for name, v in columns.items()},
        },
    )


def _columns(
    config: SessionConfig, measure: Measure, take: TakeState, started: dict[str, Any]
) -> dict[str, Any]:
    air = {
        key: np.nan if value is None else value for key, value in started["air"].items()
    }
    names = [pair.id for pair in config.pairs]
    return {
        "take_id": take.name,
        "pair_id": names.index(measure.pair),
        "pair_name": measure.pair,
        "direction": measure.direction,
        "take_no": take.take_no,
        "accepted": True,
        "time_utc": started["time"],
        "raw_file": take.event["file"],
        "raw_sha256": take.event["sha256"],
        "verdict": "accepted",
        "reasons": "; ".join([*started.get("mended", []), *take.event["marks"]]),
        **air,
    }
