"""Two reports against each other: whether a session came out better."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from html import escape
from importlib.resources import files
from pathlib import Path

import numpy as np

from analysis.report.chapters import mark_banner
from analysis.report.contents import Report, RoomSummary, without_nan
from analysis.report.tables import number
from analysis.statistics import interval_of_pseudo_values
from rir.arrays import FloatArray
from rir.errors import DatasetError

__all__ = ["MetricChange", "compare_reports", "write_comparison"]


@dataclass(frozen=True)
class MetricChange:
    """How one metric of one room changed from a report to another.

    Parameters
    ----------
    room, metric, unit : str
        What was compared, and the unit of the tables.
    marks : list of str
        SIMULATED or MEASURED, of both.
    first, second : float
        Mean distance of swapped responses.
    change, low, high : float
        Second over first, with its 95 % interval.
    ratio_first, ratio_second : float
        Un-paired over paired.
    words : str
        What to tell a person.
    """

    room: str
    marks: list[str]
    metric: str
    unit: str
    first: float
    second: float
    change: float
    low: float
    high: float
    ratio_first: float
    ratio_second: float
    words: str


def compare_reports(
    first: Report, second: Report, rng: np.random.Generator
) -> list[MetricChange]:
    """Return one line for each room and metric that both reports have.

    Rooms go by name; where no name is common, by their order.

    Parameters
    ----------
    first, second : Report
    rng : numpy.random.Generator
        Draws the bootstrap resamples.

    Returns
    -------
    list of MetricChange

    Raises
    ------
    DatasetError
        If the reports use different flavours of the metrics.
    """
    lines = []
    for a, b in _common_rooms(first.rooms, second.rooms):
        if a.flavour != b.flavour:
            raise DatasetError(
                f"the reports use different metrics ({a.flavour} and "
                f"{b.flavour}): make both with one --flavour"
            )
        same = [p.pair for p in a.pairs] == [p.pair for p in b.pairs]
        places = [p.a + p.b for p in a.pairs]
        moved = [p.a + p.b for p in b.pairs]
        matched = same and np.allclose(places, moved, atol=0.02)
        for symbol in (s for s in a.metrics if s in b.metrics):
            lines.append(_line(symbol, a, b, matched, rng))
    return lines


def _common_rooms(
    first: Sequence[RoomSummary], second: Sequence[RoomSummary]
) -> list[tuple[RoomSummary, RoomSummary]]:
    names = {room.room: room for room in second}
    common = [(room, names[room.room]) for room in first if room.room in names]
    return common or list(zip(first, second, strict=False))


def _line(
    symbol: str,
    a: RoomSummary,
    b: RoomSummary,
    matched: bool,
    rng: np.random.Generator,
) -> MetricChange:
    values = [_distances(room, symbol) for room in (a, b)]
    low, high = _interval(values[0], values[1], matched, rng)
    means = [float(np.nanmean(v)) if np.isfinite(v).any() else np.nan for v in values]
    change = means[1] / means[0] if means[0] > 0 else math.nan
    said = "no clear difference"
    if high < 1:
        said = "the second is closer"
    elif low > 1:
        said = "the first is closer"
    return MetricChange(
        room=a.room if a.room == b.room else f"{a.room} / {b.room}",
        marks=[a.mark, b.mark],
        metric=symbol,
        unit=a.metrics[symbol].unit,
        first=means[0],
        second=means[1],
        change=change,
        low=low,
        high=high,
        ratio_first=a.metrics[symbol].ratio,
        ratio_second=b.metrics[symbol].ratio,
        words=said,
    )


def _distances(room: RoomSummary, symbol: str) -> FloatArray:
    return np.array([pair.distances[symbol] for pair in room.pairs], dtype=float)


def _interval(
    first: FloatArray, second: FloatArray, matched: bool, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % interval of mean(second) / mean(first).

    Where both reports have the same pairs, a pair's two distances go together.
    """
    kept = [v[np.isfinite(v)] for v in (first, second)]
    if min(map(len, kept)) < 3 or min(v.mean() for v in kept) <= 0:
        return np.nan, np.nan
    relative = [v / v.mean() for v in kept]
    factor = kept[1].mean() / kept[0].mean()
    if matched and len(kept[0]) == len(kept[1]) == len(first):
        # The delta method: the logarithm of the factor moves by this much per pair.
        low, high = interval_of_pseudo_values(relative[1] - relative[0], rng)
        return float(factor * np.exp(low)), float(factor * np.exp(high))
    ends = [np.log(interval_of_pseudo_values(v, rng, positive=True)) for v in relative]
    below = np.hypot(ends[1][0], ends[0][1])
    above = np.hypot(ends[1][1], ends[0][0])
    return float(factor * np.exp(-below)), float(factor * np.exp(above))


def write_comparison(
    lines: Sequence[MetricChange],
    titles: tuple[str, str],
    path: str | Path,
) -> Path:
    """Write the comparison as one self-contained page, and as JSON beside it."""
    css = (files("analysis.report") / "page.css").read_text(encoding="utf-8")
    marks = sorted({mark for line in lines for mark in line.marks})
    rows = "".join(
        f"<tr><td>{escape(line.room)}</td><td>{line.metric} "
        f"{escape(line.unit)}</td><td>{number(line.first)}</td>"
        f"<td>{number(line.second)}</td><td>{number(line.change)}"
        f"<small>{number(line.low)}–{number(line.high)}</small></td>"
        f"<td>{number(line.ratio_first)}</td><td>{number(line.ratio_second)}</td>"
        f"<td>{line.words}</td></tr>"
        for line in lines
    )
    heads = ("room", "metric", "first", "second", "second / first")
    cells = "".join(f"<th>{h}</th>" for h in (*heads, "ratio 1st", "ratio 2nd", ""))
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,"><title>Two reports compared</title>'
        f"<style>{css}</style></head><body>{mark_banner(' and '.join(marks))}"
        f"<h1>Two reports compared</h1><p>First: {escape(titles[0])}<br>"
        f"Second: {escape(titles[1])}</p><p>Mean distance of swapped responses in each "
        "report, the factor between them with its 95 % interval, and how many times "
        "closer swapped responses are than un-paired ones.</p>"
        f'<div class="scroll"><table><thead><tr>{cells}</tr></thead><tbody>{rows}'
        "</tbody></table></div></body></html>\n",
        encoding="utf-8",
    )
    beside = target.with_suffix(".json")
    beside.write_text(
        json.dumps(without_nan([asdict(line) for line in lines]), indent=1) + "\n"
    )
    return target
