"""Bring a session's files and its journal back into agreement after a bad end."""

from pathlib import Path
from typing import Any

from capture.interfaces.protocol import Recording
from capture.session.dataset import lost_takes
from capture.session.engine import Session
from capture.session.folder import SessionFolder
from rir import SignalError

__all__ = ["recover"]


def recover(session: Session) -> list[str]:
    """Mend what a killed process, a full disk or a careless hand left behind.

    Half-written files are removed. A good take whose raw file is gone or was
    changed is dropped, so that it is measured again. A finished raw file that the
    journal does not know is judged and entered.

    Parameters
    ----------
    session : Session
        The session, not yet running.

    Returns
    -------
    list of str
        One line for each thing mended.
    """
    lines = session.record.journal.text.complaints()
    folder = session.folder
    lines += [
        f"{path.name} was half-written; removed" for path in folder.sweep_partials()
    ]
    for take, problem in lost_takes(folder, session.state).items():
        file = folder.path / session.state.takes[take].event["file"]
        _set_aside(folder, file)
        session.record.add({"event": "take_dropped", "take": take, "reason": problem})
        lines.append(f"{take} is measured again: {problem}")
    _recall_golden(session)
    for path in _unknown_files(session):
        lines.append(_adopt(session, path))
    return lines


def _set_aside(folder: SessionFolder, file: Path) -> None:
    """Move a file out of the way of the take that replaces it; never delete it."""
    if not file.exists():
        return
    aside = folder.path / "set_aside"
    aside.mkdir(exist_ok=True)
    number = 1 + len(list(aside.iterdir()))
    file.replace(aside / f"{number:03d}_{file.name}")


def _recall_golden(session: Session) -> None:
    """Take the golden loopback from the first good take again."""
    for take in session.state.takes.values():
        if take.accepted:
            session.take_judge.set_golden(session.folder.read_raw(take.event["file"]))
            return


def _unknown_files(session: Session) -> list[Path]:
    known = {take.event["file"] for take in session.state.takes.values()}
    files = sorted(session.folder.raw_path.glob("[!.]*"))
    return [path for path in files if f"raw/{path.name}" not in known]


def _adopt(session: Session, path: Path) -> str:
    """Enter a finished raw file into the journal, or set it aside."""
    take = path.stem
    started = session.state.started.get(take)
    try:
        if started is None:
            raise SignalError("the journal does not say how it was recorded")
        samples = session.folder.read_raw(f"raw/{path.name}")
        if samples.shape[-1] != session.take_judge.signal.shape[-1]:
            raise SignalError("it is shorter than a take")
        recording = Recording(samples, session.config.sample_rate)
        verdict = session.take_judge.judge(recording, started)
    except SignalError as error:
        _set_aside(session.folder, path)
        return f"{path.name} is set aside: {error}"
    about: dict[str, Any] = {key: started[key] for key in ("take", "key", "take_no")}
    event = session.finished(about, path.name, verdict, [])
    session.record.add({**event, "adopted": True})
    return f"{take} was recorded but not entered; it is checked and entered now"
