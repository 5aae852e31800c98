"""What `analyze-reciprocity metrics` does, behind its options."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from analysis.report.tables import number
from analysis.table.parameters_table import SYMBOLS, UNITS, tabulate_files, write_table
from analysis.table.strength_column import UNKNOWN, read_reference

__all__ = ["show_parameters"]

SHOWN = 60


def show_parameters(
    files: Sequence[Path],
    *,
    bands: str,
    out: Path | None,
    reference: Path | None = None,
    reference_distance: float | None = None,
    console: Console | None = None,
) -> list[dict[str, Any]]:
    """Print the parameters of files, and write them if asked to."""
    screen = console or Console()
    free = None
    if reference is not None:
        free = read_reference(reference, reference_distance)
    lines = tabulate_files(files, bands, free)
    for name in dict.fromkeys(line["file"] for line in lines[:SHOWN]):
        own = [line for line in lines[:SHOWN] if line["file"] == name]
        screen.print(f"{name} {own[0]['mark']}", highlight=False, markup=False)
        screen.print(_table(own, bands != "none"))
    if len(lines) > SHOWN:
        screen.print(
            f"and {len(lines) - SHOWN} more lines; --out table.csv has them all"
        )
    if any(line["reasons"] for line in lines):
        screen.print("–: undetermined; --out writes the reasons", highlight=False)
    if any(line["reasons"].get("G") == UNKNOWN for line in lines):
        screen.print(f"G: {UNKNOWN}", highlight=False, markup=False)
    if out is not None:
        path = write_table(lines, out)
        screen.print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)
    return lines


def _table(lines: Sequence[dict[str, Any]], banded: bool) -> Table:
    table = Table(box=None, padding=(0, 1), pad_edge=False)
    for name in ("response", "Hz")[: 1 + banded]:
        table.add_column(name, overflow="fold")
    for symbol in SYMBOLS:
        unit = UNITS.get(symbol, "dB")
        table.add_column(f"{symbol}\n{unit}", justify="right", no_wrap=True)
    table.add_column("flags", overflow="fold")
    for line in lines:
        band = "all" if line["band_hz"] is None else f"{line['band_hz']:.0f}"
        head = [line["response"], band][: 1 + banded]
        values = [number(line[symbol]) for symbol in SYMBOLS]
        table.add_row(*head, *values, ", ".join(line["flags"]))
    return table
