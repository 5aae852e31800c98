"""The report's tables as cells, CSV and LaTeX."""

import csv
import io
import math
from dataclasses import astuple, fields
from typing import Any

from analysis.report.contents import MetricSummary, Report
from analysis.statistics import Estimate

__all__ = ["cell", "csv_table", "latex_table", "number", "pair_csv", "ratio_cell"]


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, never as 1e-03.

    Examples
    --------
    >>> number(0.0012345), number(1234.5), number(float("nan")), number(0.0)
    ('0.00123', '1234', '–', '0')
    """
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞"
    if value == 0 or abs(value) < 1e-9:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(places, 9)}f}"


def cell(estimate: Estimate) -> str:
    """Return a mean with its interval, as the HTML of a table cell."""
    text = number(estimate.mean)
    if math.isfinite(estimate.low):
        text += f"<small>{number(estimate.low, 2)}–{number(estimate.high, 2)}</small>"
    if estimate.undefined:
        text += f"<small>{estimate.undefined} undetermined</small>"
    return text


def ratio_cell(summary: MetricSummary) -> str:
    """Return a ratio with its interval, as the HTML of a table cell."""
    text = number(summary.ratio)
    if math.isfinite(summary.ratio_low):
        low, high = number(summary.ratio_low, 2), number(summary.ratio_high, 2)
        text += f"<small>{low}–{high}</small>"
    return text


def csv_table(report: Report) -> str:
    """Return one line for each room, metric and variant.

    Columns: room, mark, metric, unit, version, variant, mean, deviation, median,
    low, high, count, undefined. Distances are in the unit of the line; an absent
    number is an empty field.
    """
    keys = [entry.name for entry in fields(Estimate)]
    lines: list[list[Any]] = [
        ["room", "mark", "metric", "unit", "version", "variant", *keys]
    ]
    for room in report.rooms:
        for symbol, metric in room.metrics.items():
            head = [room.room, room.mark, symbol, metric.unit, metric.version]
            lines.append([*head, "unpaired", *astuple(metric.unpaired)])
            lines.append([*head, "paired", *astuple(metric.paired)])
            lines.append([*head, "floor", metric.floor, *[""] * 6])
    return _csv(lines)


def pair_csv(report: Report) -> str:
    """Return one line for each pair: distances in table units, fits and faults."""
    symbols = list(report.rooms[0].metrics)
    fits = ("gain_db", "temperature_change_k", "delay_us")
    lines: list[list[Any]] = [["room", "mark", "pair", *symbols, *fits, "faults"]]
    for room in report.rooms:
        for pair in room.pairs:
            values = [pair.distances[s] for s in symbols]
            fitted = [pair.gain_db, pair.temperature_change_k, pair.delay_us]
            head = [room.room, room.mark, pair.pair]
            lines.append([*head, *values, *fitted, pair.note])
    return _csv(lines)


def _csv(lines: list[list[Any]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for line in lines:
        writer.writerow(
            "" if isinstance(v, float) and math.isnan(v) else v for v in line
        )
    return out.getvalue()


def latex_table(report: Report) -> str:
    """Return the verification table in the form of the paper's, for booktabs."""
    heads = " & ".join(
        f"{symbol} [{metric.unit}]" if metric.unit else symbol
        for symbol, metric in report.rooms[0].metrics.items()
    ).replace("%", r"\%")
    lines = [
        rf"\begin{{tabular}}{{ll{'c' * len(report.rooms[0].metrics)}}}",
        r"\toprule",
        rf"Environment & Variant & {heads} \\ \midrule",
    ]
    for room in report.rooms:
        name = f"{room.room} ({room.mark.lower()})".replace("_", r"\_")
        metrics = room.metrics.values()
        unpaired = [number(m.unpaired.mean) for m in metrics]
        paired = [rf"\textbf{{{number(m.paired.mean)}}}" for m in metrics]
        lines.append(f"{name} & un-paired & {' & '.join(unpaired)} " + r"\\")
        lines.append(f" & paired & {' & '.join(paired)} " + r"\\")
        lines.append(r"\midrule")
    lines[-1] = r"\bottomrule"
    return "\n".join([*lines, r"\end{tabular}", ""])
