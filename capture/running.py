"""Run a session from its folder to its data set."""

import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from capture.build import build_dataset
from capture.config import SessionConfig
from capture.display import PlainDisplay
from capture.folder import SessionFolder, file_sha256
from capture.journal import Journal
from capture.movers import Mover
from capture.plan import Plan, build_plan
from capture.recover import recover
from capture.session import Session
from capture.stage import set_stage
from rir import SessionError
from rir.records import software_version

__all__ = ["check_plan", "run_session", "utc_now"]


def utc_now() -> str:
    """Return the time of day as ISO 8601 text, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def check_plan(config: SessionConfig, mover: Mover) -> Plan:
    """Return the plan of a session after asking the movers about every pose.

    Raises
    ------
    OutOfReachError
        If a place cannot be reached; nothing is moved.
    """
    plan = build_plan(config, mover.seconds())
    for move in plan.moves:
        mover.check(move)
    return plan


def run_session(
    folder: SessionFolder, config: SessionConfig | None, display: PlainDisplay
) -> Path:
    """Start or resume a session, finish it, and build its data set.

    Parameters
    ----------
    folder : SessionFolder
        Where it is or will be.
    config : SessionConfig or None
        The configuration of a new session; None resumes.
    display : PlainDisplay
        What shows it.

    Returns
    -------
    Path
        The data set.

    Raises
    ------
    SessionError
        If some directions got no good take; running again tries them again.
    """
    if config is not None:
        folder.create(config)
    config = folder.load_config()

    def note(text: str) -> None:
        session.record({"event": "note", "text": text})

    stage = set_stage(config, voice=display, note=note)
    plan = check_plan(config, stage.mover)
    with Journal(folder.journal_path) as journal:
        session = Session(
            folder,
            config,
            plan,
            journal,
            stage.mover,
            stage.open_interface,
            utc_now,
            stage.sensor,
            stage.clock,
            display.show,
        )
        _begin(session)
        for line in recover(session):
            display.show({"event": "warning", "text": line})
        missing = session.run()
        path = build_dataset(folder)
        session.record({"event": "dataset_built", "sha256": file_sha256(path)})
    if missing:
        raise SessionError(
            f"{len(missing)} directions have too few good takes ({', '.join(missing)});"
            f" the rest is in {path}; run again to try them again"
        )
    return path


def _begin(session: Session) -> None:
    kind = "session_resumed" if session.state.first else "session_started"
    session.record({"event": kind, "about": about_session(session)})


def about_session(session: Session) -> dict[str, Any]:
    """Return where and with what a session runs."""
    config = session.config
    return {
        "software": software_version(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "system": platform.platform(),
        "simulated": config.simulated,
        "mark": "SIMULATED" if config.simulated else "MEASURED",
        "rigs": session.mover.describe(),
    }
