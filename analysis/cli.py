"""The command `analyze-reciprocity`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rir.command import run

__all__ = ["app", "main"]

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    help="Analyse impulse responses and their reciprocity.",
)


@app.callback()
def _commands() -> None:
    """Keep `report` a sub-command even while it is the only one."""


@app.command()
def report(
    sessions: Annotated[list[Path], typer.Argument(help="Sessions or .h5 files.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write to [beside the first session]."),
    ] = None,
    title: Annotated[str, typer.Option(help="Heading.")] = "Reciprocity report",
    flavour: Annotated[str, typer.Option(help="paper, raf or robust.")] = "paper",
    duration: Annotated[
        float | None, typer.Option(help="Compare the first seconds only [s].")
    ] = None,
    position_mm: Annotated[
        float, typer.Option(help="Repeatability of places, for the predicted floor.")
    ] = 0.5,
    figures: Annotated[
        bool, typer.Option(help="Also write SVG and PNG files.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of the bootstrap.")] = 0,
) -> None:
    """Compare paired and un-paired responses; write HTML, JSON and CSV."""
    from analysis.report.command import make_report
    from analysis.report.study import StudyOptions

    options = StudyOptions(flavour, duration, position_mm, seed)
    make_report(sessions, out, title=title, options=options, figures=figures)


@app.command()
def cost(
    results: Annotated[list[Path], typer.Argument(help="JSON files of cost runs.")],
    out: Annotated[Path, typer.Option(help="Page to write.")] = Path("cost.html"),
) -> None:
    """Draw what accuracy costs in time, with the setting to take."""
    from rich.console import Console

    from analysis.cost import CostCurve, write_cost_page

    screen = Console()
    curves = [CostCurve.load(path) for path in results]
    for curve in curves:
        screen.print(curve.sentence, highlight=False, markup=False)
    path = write_cost_page(curves, out)
    screen.print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(app, argv, prog="analyze-reciprocity")
