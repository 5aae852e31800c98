"""The further commands of train-field."""

from pathlib import Path
from typing import Annotated

import typer

from rir.command import make_app, make_console

__all__ = ["more"]

more = make_app("Compare, time and look at trained fields.")


@more.command("list")
def list_models() -> None:
    """List the models with their origin."""
    from rich.table import Table

    from fields.table import FIELDS

    table = Table(title="models of train-field")
    for heading in ("name", "what it is", "origin", "needs"):
        table.add_column(heading)
    for name, kind in FIELDS.items():
        needs = "torch" if kind.neural else "–"
        table.add_row(name, kind.summary, kind.citation, needs)
    make_console().print(table)


@more.command("compare")
def compare_models(
    config: Annotated[
        str,
        typer.Argument(help="same, diff, one of their tables, or a YAML file."),
    ],
    out: Annotated[Path, typer.Option(help="Folder of results.")] = Path(
        "runs/compare"
    ),
    size: Annotated[
        str, typer.Option(help="cpu, or paper: 5000 listeners, 200 epochs.")
    ] = "cpu",
    budget: Annotated[
        str, typer.Option(help="CPU time a training in place of the file's.")
    ] = "",
) -> None:
    """Train models x forms x seeds and write tables with mean and spread.

    same and diff are built in: three simulated rooms, equal and unequal gain
    patterns, one table for each question. Run again, it goes on where it stopped.
    """
    from fields.commands.train import parse_seconds
    from fields.comparison.config import load_comparisons
    from fields.comparison.run import compare

    console = make_console()
    seconds = parse_seconds(budget) if budget else None
    for folder, asked in load_comparisons(config, size):
        chosen = asked if seconds is None else asked.with_budget(seconds)
        for table in compare(chosen, out / folder, lambda line: console.out(line)):
            console.print(table.rich())
            console.print(table.rich_checks())
    console.out(f"tables and plots: {out}")


@more.command("map")
def draw_map(
    run: Annotated[Path, typer.Argument(help="Run folder or field file.")],
    emitter: Annotated[
        str, typer.Option(help="Emitter x,y,z [m]; the box's middle if left out.")
    ] = "",
    spacing: Annotated[float, typer.Option(help="Grid spacing [m].")] = 0.2,
    height: Annotated[
        float | None, typer.Option(help="Height of the listeners [m].")
    ] = None,
    frequency: Annotated[float, typer.Option(help="Of the phase map [Hz].")] = 500.0,
    out: Annotated[
        Path | None, typer.Option(help="PNG to write; beside the field by default.")
    ] = None,
) -> None:
    """Draw loudness and phase over a plane, and check the field's reciprocity."""
    import numpy as np

    from fields.evaluate import score_units
    from fields.field import load_field
    from fields.maps import check_reciprocity, draw_more, make_map, plot_map
    from rir import Pose

    field = load_field(run)
    place = _position(emitter) if emitter else field.frame.center.tolist()
    shown = make_map(
        field, Pose.at(*place), spacing=spacing, height=height, frequency=frequency
    )
    target = out or (run if run.is_dir() else run.parent) / "map.png"
    plot_map(target, shown, f"{field.name}, emitter at {place}")
    shown.save(target.with_suffix(".npz"))
    gap = check_reciprocity(field, rng=np.random.default_rng(0))
    units = score_units()
    told = ", ".join(f"{n} {v:.3g} {units[n]}".strip() for n, v in gap.items())
    console = make_console()
    console.out(field.frame.mark, style="bold", end=" ")
    console.out(f"{field.name}: {target}")
    for more in draw_more(field, target.parent):
        console.out(f"also drawn: {more}")
    console.out(f"swapping the ends changes: {told}")


def _position(text: str) -> list[float]:
    from rir.errors import ConfigError

    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise ConfigError(
            f"emitter {text!r} is not a place; write x,y,z in metres"
        ) from error
    return [x, y, z]


@more.command("cost")
def show_cost(
    dataset: Annotated[Path, typer.Argument(help="Session folder or .h5 file.")],
    model: Annotated[str, typer.Option(help="Model.")] = "avr",
    knob: Annotated[str, typer.Option(help="Model setting to turn.")] = "",
    values: Annotated[str, typer.Option(help="Its values, as 24,48,96.")] = "",
    budgets: Annotated[str, typer.Option(help="CPU times, as 5s,10s,20s.")] = "5s,10s",
    out: Annotated[Path, typer.Option(help="Folder of results.")] = Path("runs/cost"),
) -> None:
    """Measure each metric against the seconds of training."""
    import yaml

    from analysis.cost import write_cost_page
    from fields.commands.train import parse_seconds
    from fields.comparison.sets import open_divided
    from fields.cost import measure_training

    console = make_console()
    divided = open_divided(dataset, dataset.stem)
    turned = [yaml.safe_load(one) for one in values.split(",") if one]
    seconds = [parse_seconds(one) for one in budgets.split(",")]
    curves = measure_training(divided, model, knob, turned, budgets=seconds)
    for curve in curves:
        name = curve.quantity.replace("*", "-true").lower()
        curve.save(out / f"cost-{name}.json")
        console.out(curve.sentence)
    page = write_cost_page(curves, out / "cost.html")
    console.out(divided.mark, style="bold", end=" ")
    console.out(f"curves: {page}")
