"""The command `find-room`."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rir.command import make_app, run

__all__ = ["app", "main"]

app = make_app()


@app.command()
def find(
    session: Annotated[
        list[str],
        typer.Argument(help="Sessions or data sets of one room; or one SOFA file."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for plan and room; SESSION-room by default."),
    ] = None,
    drawn: Annotated[
        str | None,
        typer.Option(help="Start from this mesh, room file or built-in scene."),
    ] = None,
    pose_error: Annotated[
        float,
        typer.Option(help="Standard deviation of coordinates [mm]; 0: exact."),
    ] = 3.0,
    sample_rate: Annotated[
        float, typer.Option(help="Look at this rate [Hz]; 0 keeps the data's.")
    ] = 16000.0,
    reach: Annotated[float, typer.Option(help="Longest path [s].")] = 0.12,
    simulated: Annotated[
        bool | None,
        typer.Option("--simulated/--measured", help="For files that do not say it."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Find the walls of a room in measured responses and draw its plan."""
    from inverse.command import RoomRequest, find_and_report

    find_and_report(
        RoomRequest(
            session,
            out,
            drawn,
            pose_error / 1000,
            sample_rate or None,
            reach,
            simulated,
            quiet,
        )
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run find-room and return its exit code."""
    return run(app, argv, "find-room")


if __name__ == "__main__":
    sys.exit(main())
