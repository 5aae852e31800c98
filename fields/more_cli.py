"""The further commands of train-field."""

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
