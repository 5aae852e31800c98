"""Run a session from its folder to its data set."""

import platform
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from capture.config import SessionConfig
from capture.devices.movers import Mover
from capture.devices.stage import set_stage
from capture.operator.display import PlainDisplay
from capture.plan import Plan, build_plan
from capture.session.dataset import build_dataset
from capture.session.engine import Session
from capture.session.folder import SessionFolder, file_sha256
from capture.session.journal import Journal
from capture.session.recover import recover
from rir import SessionError
from rir.records import software_version

__all__ = ["check_plan", "run_session", "utc_now"]


class Willing:
    """A voice that says yes to everything.

    Parameters
    ----------
    display : PlainDisplay
        Shows what was asked and answered.
    """

    def __init__(self, display: PlainDisplay) -> None:
        self._display = display

    def ask(self, text: str) -> str:
        """Show the question and answer yes."""
        self.say(f"{text} yes")
        return "yes"

    def say(self, text: str) -> None:
        """Show a text."""
        self._display.say(text)


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
    plan = build_plan(config)
    for move in plan.moves:
        mover.check(move)
    return replace(plan, move_s=mover.seconds(plan.moves))


def run_session(
    folder: SessionFolder,
    config: SessionConfig | None,
    display: PlainDisplay,
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
    display : PlainDisplay
        What shows it.
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

    def note(text: str) -> None:
        session.record({"event": "note", "text": text})

    voice = Willing(display) if yes else display
    rate = config.sample_rate
    stage = set_stage(
        config,
        voice=voice,
        note=note,
        on_progress=lambda samples: display.progress(samples, rate),
    )
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
