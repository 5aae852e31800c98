"""``capture-pairs rebuild``: derive a data set from its session again."""

from pathlib import Path
from typing import Annotated

import typer

from capture.commands.measure import say_written
from rir.command import make_console

__all__ = ["rebuild"]


def rebuild(
    session: Annotated[Path, typer.Argument(help="The session's folder.")],
) -> None:
    """Derive dataset.h5 of a session anew, byte for byte."""
    from capture.session.dataset import build_dataset
    from capture.session.folder import SessionFolder

    folder = SessionFolder(session)
    config = folder.load_config()
    say_written(build_dataset(folder), config, make_console())
