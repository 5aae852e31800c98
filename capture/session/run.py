"""Run a session from its folder to its data set."""

import platform
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from capture.config import SessionConfig
from capture.devices.movers import Mover
from capture.devices.operator import ConsentingOperator
from capture.devices.stage import set_stage
from capture.plan import SessionPlan, build_plan
from capture.session.dataset import build_dataset
from capture.session.display import Display, NoDisplay
from capture.session.engine import Session
from capture.session.folder import SessionFolder, file_sha256
from capture.session.journal import Journal
from capture.session.record import SessionRecord
from capture.session.recover import recover
from rir import SessionError
from rir.records import software_version

__all__ = ["check_plan", "run_session", "utc_now"]


def utc_now() -> str:
    """Return the time of day as ISO 8601 text, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def check_plan(config: SessionConfig, mover: Mover) -> SessionPlan:
    """Return the plan of a session after asking the movers about every pose.

    Raises
    ------
    OutOfReachError
        If a place cannot be reached; nothing is moved.
    """
    plan = build_plan(config)
    for move in plan.moves:
        mover.check(move)
    return replace(plan, move_s=mover.seconds(plan.moves))


def run_session(
    folder: SessionFolder,
    config: SessionConfig | None,
    display: Display | None = None,
    *,
    yes: bool = False,
) -> Path:
    """Start or resume a session, finish it, and build its data set.

    Parameters
    ----------
    folder : SessionFolder
        Where it is or will be.
    config : SessionConfig or None
        The configuration of a new session; None resumes.
    display : Display, optional
        What shows it and talks with the operator; without one nobody can be asked.
    yes : bool
        Whether rigs may be homed without asking.

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
    shown = display or NoDisplay()
    with Journal(folder.journal_path) as journal:
        record = SessionRecord(journal, utc_now, shown.show)
        session = _set_up(folder, config, record, shown, yes=yes)
        _begin(session)
        for line in recover(session):
            shown.show({"event": "warning", "text": line})
        missing = session.run()
        path = build_dataset(folder)
        record.add({"event": "dataset_built", "sha256": file_sha256(path)})
    if missing:
        raise SessionError(
            f"{len(missing)} directions have too few good takes ({', '.join(missing)});"
            f" the rest is in {path}; run again to try them again"
        )
    return path


def _set_up(
    folder: SessionFolder,
    config: SessionConfig,
    record: SessionRecord,
    display: Display,
    *,
    yes: bool,
) -> Session:
    """Build the devices, check the plan with them, and return the session."""
    rate = config.sample_rate
    stage = set_stage(
        config,
        operator=ConsentingOperator(display) if yes else display,
        note=record.note,
        on_progress=lambda samples: display.progress(samples, rate),
    )
    plan = check_plan(config, stage.mover)
    mover, sensor, clock = stage.mover, stage.sensor, stage.clock
    return Session(
        folder, config, plan, record, mover, stage.open_interface, sensor, clock
    )


def _begin(session: Session) -> None:
    kind = "session_resumed" if session.state.first else "session_started"
    session.record.add({"event": kind, "about": about_session(session)})


def about_session(session: Session) -> dict[str, Any]:
    """Return where and with what a session runs."""
    simulated = session.config.simulated or session.mover.simulated
    return {
        "software": software_version(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "system": platform.platform(),
        "simulated": simulated,
        "mark": "SIMULATED" if simulated else "MEASURED",
        "rigs": session.mover.describe(),
    }
