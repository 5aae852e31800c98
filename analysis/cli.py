"""The command `analyze-reciprocity`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rir.command import make_app, make_console, run

__all__ = ["app", "main"]

app = make_app("Analyse impulse responses and their reciprocity.")
Seed = Annotated[int, typer.Option(min=0, help="Seed of the bootstrap.")]


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
        float | None,
        typer.Option(help="Repeatability of places for the floor [the session's own]."),
    ] = None,
    figures: Annotated[
        bool, typer.Option(help="Also write SVG and PNG files.")
    ] = False,
    seed: Seed = 0,
) -> None:
    """Compare paired and un-paired responses; write HTML, JSON and CSV."""
    from analysis.report.command import make_report
    from analysis.report.study import StudyOptions

    options = StudyOptions(flavour, duration, position_mm, seed)
    make_report(sessions, out, title=title, options=options, figures=figures)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="A report's folder or report.json.")],
    second: Annotated[Path, typer.Argument(help="The other one.")],
    out: Annotated[Path, typer.Option(help="Page to write.")] = Path("compare.html"),
    seed: Seed = 0,
) -> None:
    """Compare two reports: which session came closer to reciprocity."""
    from analysis.report.command import compare_two

    compare_two(first, second, out, seed)


@app.command()
def metrics(
    files: Annotated[
        list[Path], typer.Argument(help="WAV, FLAC, SOFA, .h5 or session folders.")
    ],
    bands: Annotated[str, typer.Option(help="none, octave or third.")] = "none",
    out: Annotated[
        Path | None, typer.Option(help="Also write the table: .csv or .json.")
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(help="For G: the same source and chain in the free field."),
    ] = None,
    reference_distance: Annotated[
        float | None, typer.Option(help="Distance of that response, in metres.")
    ] = None,
) -> None:
    """Print acoustic parameters (ISO 3382) of response files."""
    from analysis.table.command import show_parameters

    show_parameters(
        files,
        bands=bands,
        out=out,
        reference=reference,
        reference_distance=reference_distance,
    )


@app.command()
def cost(
    results: Annotated[list[Path], typer.Argument(help="JSON files of cost runs.")],
    out: Annotated[Path, typer.Option(help="Page to write.")] = Path("cost.html"),
) -> None:
    """Draw what accuracy costs in time, with the setting to take."""
    from analysis.cost import CostCurve, write_cost_page

    screen = make_console()
    curves = [CostCurve.load(path) for path in results]
    for curve in curves:
        screen.out(curve.sentence)
    path = write_cost_page(curves, out)
    screen.out(f"wrote {path}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(app, argv, prog="analyze-reciprocity")
