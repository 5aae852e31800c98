"""``capture-pairs`` itself: start or resume a session."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from capture.commands.options import Misuse, SessionOptions, option
from rir.command import make_console

if TYPE_CHECKING:
    from rich.console import Console

    from capture.config import SessionConfig
    from capture.session.folder import SessionFolder

__all__ = ["RunOptions", "measure", "say_written"]


@dataclass(frozen=True)
class RunOptions:
    """How a session is run: none of it changes what is measured."""

    out: Path | None = option("Session folder; sessions/<room>-<date> if left out.")
    resume: bool | None = option(
        "Resume an unfinished session, or start anew; or ask.", flag="--resume/--new"
    )
    yes: bool = option("Answer yes where a rig asks to be homed.", default=False)
    plain: bool = option("Plain lines, no live screen.", default=False)


def measure(session: SessionOptions, running: RunOptions) -> None:
    """Choose the folder, run what its session still needs, say what came of it."""
    from capture.operator import make_display
    from capture.session.run import run_session
    from capture.session.start import choose_folder, is_complete, is_sound

    if session.room is None:
        raise Misuse("give --room kitchen, conference, office or a file")
    console = make_console()
    today, ask = date.today(), _asker(console)
    folder = choose_folder(
        running.out, session.room, today=today, resume=running.resume, ask=ask
    )
    new = None if folder.exists else session.plan()
    config = new or folder.load_config()
    _refuse_changes(session, config, folder)
    if running.yes and (config.rig == "manual" or config.thermometer == "ask"):
        raise Misuse("--yes contradicts a person who moves the stands or reads the air")
    if new is None and is_complete(folder) and is_sound(folder):
        _say_complete(folder, console)
        return
    console.out(f"session folder {folder.path}")
    with make_display(
        console, simulated=config.simulated, plain=running.plain
    ) as display:
        path = run_session(folder, new, display, yes=running.yes)
    say_written(path, config, console)


def _refuse_changes(
    session: SessionOptions, config: "SessionConfig", folder: "SessionFolder"
) -> None:
    """Refuse options that say otherwise than the session that is to be resumed."""
    from rooms.presets import load_room

    asked = load_room(str(session.room)).name
    if asked != config.room.name:
        raise Misuse(
            f"{folder.path} holds a session in {config.room.name}, not in {asked}"
        )
    stored = config.model_dump(mode="json")
    for key, value in session.keys_set():
        kept = reduce(lambda part, name: (part or {}).get(name), key.split("."), stored)
        if kept != value:
            raise Misuse(
                f"{folder.path} holds a session with {key} {kept}, not {value}: resume "
                "it as it is, or start another with --new or another --out"
            )


def _say_complete(folder: "SessionFolder", console: "Console") -> None:
    from capture.session.dataset import build_dataset

    if not folder.dataset_path.exists():
        build_dataset(folder)
    console.out(
        f"{folder.path} is complete already: {folder.dataset_path}\n"
        "(give another --out for a new session)"
    )


def say_written(path: Path, config: "SessionConfig", console: "Console") -> None:
    """Say where a data set is, and whether anybody heard it."""
    mark = "SIMULATED" if config.simulated else "MEASURED"
    console.out(f"{mark} data set written: {path}")


def _asker(console: "Console") -> Callable[[str], bool]:
    """Return what asks a yes/no question; without a person the answer is yes."""

    def ask(question: str) -> bool:
        if not console.is_terminal:
            return True
        return typer.confirm(question, default=True)

    return ask
