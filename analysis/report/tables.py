"""The report's tables as cells, CSV and LaTeX."""

import csv
import io
import math
from collections.abc import Mapping
from typing import Any

from analysis.metrics import METRICS

__all__ = ["cell", "csv_table", "ratio_cell"]


def cell(symbol: str, estimate: Mapping[str, Any]) -> str:
    """Return a mean with its interval, as the HTML of a table cell."""
    if not math.isfinite(estimate["mean"]):
        return "undetermined"
    digits = METRICS[symbol].decimals
    text = f"{estimate['mean']:.{digits}f}"
    if math.isfinite(estimate["low"]):
        text += f"<small>{estimate['low']:.{digits}f}–{estimate['high']:.{digits}f}"
        text += "</small>"
    return text


def ratio_cell(summary: Mapping[str, Any]) -> str:
    """Return a ratio with its interval, as the HTML of a table cell."""
    ratio = summary["ratio"]
    if math.isnan(ratio):
        return "undetermined"
    if math.isinf(ratio):
        return "∞"
    text = f"{ratio:.3g}"
    if math.isfinite(summary["ratio_low"]):
        text += f"<small>{summary['ratio_low']:.3g}–{summary['ratio_high']:.3g}</small>"
    return text


def csv_table(report: Mapping[str, Any]) -> str:
    """Return one line for each room, metric and variant.

    Columns: room, mark, metric, unit, version, variant, mean, deviation, low, high,
    count, undefined.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    keys = ("mean", "deviation", "median", "low", "high", "count", "undefined")
    writer.writerow(["room", "mark", "metric", "unit", "version", "variant", *keys])
    for room in report["rooms"]:
        for symbol, summary in room["metrics"].items():
            for variant in ("unpaired", "paired"):
                head = [room["room"], room["mark"], symbol, summary["unit"]]
                head += [summary["version"], variant]
                writer.writerow(head + [summary[variant][key] for key in keys])
    return out.getvalue()
