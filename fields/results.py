"""A table of scores: one row a method, one column a metric."""

import csv
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fields.evaluate import Scores, score_units
from rir.schema import Schema

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["TABLE", "ResultTable"]

TABLE = Schema("result table", 1)


@dataclass
class ResultTable:
    """Collect scores and show them to people and programs."""

    title: str
    """What the table is about."""
    mark: str
    """SIMULATED or MEASURED, shown with the title."""
    rows: list[dict[str, Any]] = field(default_factory=list)
    """Each with "method", "seconds" and one value a metric; further keys are kept."""
    notes: list[str] = field(default_factory=list)
    """Sentences below the table."""
    checks: dict[str, str] = field(default_factory=dict)
    """Further keys of the rows to show, with their units."""

    def add(self, method: str, scores: Scores, **more: Any) -> None:
        """Append one method's scores."""
        self.rows.append({"method": method, **scores, **more})

    def save(self, folder: Path) -> None:
        """Write table.json and table.csv."""
        content = {
            **TABLE.stamp,
            "title": self.title,
            "mark": self.mark,
            "units": score_units(),
            "rows": [_plain(row) for row in self.rows],
            "notes": self.notes,
        }
        (folder / "table.json").write_text(json.dumps(content, indent=1) + "\n")
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        with (folder / "table.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(self.rows)

    def rich(self) -> "Table":
        """Return the table for a terminal."""
        from rich.table import Table

        table = Table(title=f"{self.title} [{self.mark}]", caption_justify="left")
        table.caption = "\n".join(self.notes)
        table.add_column("method")
        units = score_units()
        for name, unit in units.items():
            table.add_column(f"{name} {unit}".strip(), justify="right")
        table.add_column("CPU s", justify="right")
        for row in self.rows:
            cells = [_cell(row.get(name)) for name in units]
            table.add_row(row["method"], *cells, _cell(row.get("seconds"), 1))
        return table

    def rich_checks(self) -> "Table":
        """Return the further keys of the rows that have some, for a terminal."""
        from rich.table import Table

        table = Table(title=f"{self.title}, checks [{self.mark}]")
        table.add_column("method")
        for name, unit in self.checks.items():
            table.add_column(f"{name} {unit}".strip(), justify="right")
        for row in self.rows:
            if any(name in row for name in self.checks):
                cells = [_cell(row.get(name)) for name in self.checks]
                table.add_row(row["method"], *cells)
        return table


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    # JSON has no NaN; a missing value is null.
    return {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in row.items()
    }


def _cell(value: float | None, places: int = 3) -> str:
    if value is None or math.isnan(value):
        return "–"
    return f"{value:.{places}f}" if abs(value) < 100 else f"{value:.1f}"
