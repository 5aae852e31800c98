"""The further commands of train-field."""

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["more"]

more = typer.Typer(add_completion=False, rich_markup_mode=None, no_args_is_help=True)


@more.callback()
def _group() -> None:
    """Compare, time and look at trained fields."""


@more.command("list")
def list_models() -> None:
    """List the models with their origin."""
    from rich.console import Console
    from rich.table import Table

    from fields.table import FIELDS

    table = Table(title="models of train-field")
    for heading in ("name", "what it is", "origin", "needs"):
        table.add_column(heading)
    for name, kind in FIELDS.items():
        needs = "torch" if kind.neural else "–"
        table.add_row(name, kind.summary, kind.citation, needs)
    Console().print(table)


@more.command("compare")
def compare_models(
    config: Annotated[Path, typer.Argument(help="YAML of the comparison.")],
    out: Annotated[Path, typer.Option(help="Folder of results.")] = Path(
        "runs/compare"
    ),
) -> None:
    """Train models x forms x seeds and write tables with mean and spread.

    Run again, it goes on where it stopped.
    """
    from rich.console import Console

    from fields.compare import CompareConfig, compare
    from rir.config import load_yaml

    console = Console()
    chosen = load_yaml(config, CompareConfig)
    for table in compare(chosen, out, lambda line: console.print(line, soft_wrap=True)):
        console.print(table.rich())
    console.print(f"tables and plots: {out}")
