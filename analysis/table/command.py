"""What `analyze-reciprocity metrics` does, behind its options."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from analysis.report.tables import number
from analysis.table.parameters_table import SYMBOLS, UNITS, tabulate_files, write_table
from analysis.table.strength_column import UNKNOWN, read_reference
from rir.command import make_console

__all__ = ["show_parameters"]

SHOWN = 60
"""Lines on screen at the most: two pages of a terminal; --out has all."""


def show_parameters(
    files: Sequence[Path],
    *,
    bands: str,
    out: Path | None,
    reference: Path | None = None,
    reference_distance: float | None = None,
) -> list[dict[str, Any]]:
    """Print the parameters of files, and write them if asked to."""
    screen = make_console()
    free = None
    if reference is not None:
        free = read_reference(reference, reference_distance)
    lines = tabulate_files(files, bands, free)
    for name in dict.fromkeys(line["file"] for line in lines[:SHOWN]):
        own = [line for line in lines[:SHOWN] if line["file"] == name]
        screen.out(f"{name} {own[0]['mark']}")
        screen.print(_table(own, bands != "none"))
    if len(lines) > SHOWN:
        screen.out(f"and {len(lines) - SHOWN} more lines; --out table.csv has them all")
    if any(line["reasons"] for line in lines):
        screen.out("–: undetermined; --out writes the reasons")
    if any(line["reasons"].get("G") == UNKNOWN for line in lines):
        screen.out(f"G: {UNKNOWN}")
    if out is not None:
        path = write_table(lines, out)
        screen.out(f"wrote {path}")
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
