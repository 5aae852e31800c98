"""Cost curves on one page."""

import math
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from rir.cost import CostCurve, CostPoint

__all__ = ["cost_chart", "write_cost_page"]


def write_cost_page(curves: Sequence[CostCurve], path: str | Path) -> Path:
    """Write one self-contained HTML page of several curves."""
    css = (files("analysis.report") / "page.css").read_text(encoding="utf-8")
    body = "".join(
        f"<h2>{escape(c.knob)}</h2><p class='verdict'>{escape(c.sentence)}</p>"
        f"<div class='figures'><figure>{cost_chart(c)}</figure></div>{_table(c)}"
        for c in curves
    )
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<link rel="icon" href="data:,"><title>What accuracy costs</title>'
        f"<style>{css}</style></head><body><h1>What accuracy costs</h1>"
        "<p>Blue: settings no other beats in both time and error; ringed: the one "
        f"recommended.</p>{body}</body></html>\n",
        encoding="utf-8",
    )
    return target


def _table(curve: CostCurve) -> str:
    rows = "".join(
        f"<tr{' class=paired' if k == curve.knee else ''}><td>{escape(p.setting)}</td>"
        f"<td>{p.seconds:.3g}<small>{p.seconds_low:.3g}–{p.seconds_high:.3g}</small>"
        f"</td><td>{p.error:.3g}<small>{p.error_low:.3g}–{p.error_high:.3g}</small>"
        f"</td><td>{p.repeats}</td></tr>"
        for k, p in enumerate(curve.points)
    )
    each = f" a {escape(curve.per)}" if curve.per else ""
    return (
        "<div class='scroll'><table><thead><tr><th>setting</th>"
        f"<th>{escape(curve.seconds_of)} seconds{each}</th>"
        f"<th>{escape(curve.quantity)} error [{escape(curve.unit or '1')}]</th>"
        f"<th>repeats</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def cost_chart(curve: CostCurve) -> str:
    """Draw error against seconds, both logarithmic, as SVG text."""
    from analysis.report.charts import FORWARD, STRANGER, svg, svg_text

    shown = [p for p in curve.points if p.seconds > 0 and p.error > 0]
    title = f"{curve.quantity} error [{curve.unit or '1'}] against seconds"
    body = [svg_text(4, 14, title, size=12)]
    if not shown:
        return svg(340, 60, title, [*body, svg_text(4, 40, "nothing to draw")])
    x_of = _LogAxis([p.seconds for p in shown], 50, 330)
    y_of = _LogAxis([p.error for p in shown], 190, 30)
    for power, x in x_of.ticks:
        body.append(f'<path d="M{x:.1f} 30V190" stroke="currentColor" opacity=".12"/>')
        body.append(svg_text(x, 206, f"{10.0**power:g} s", "middle", 10))
    for power, y in y_of.ticks:
        body.append(f'<path d="M50 {y:.1f}H330" stroke="currentColor" opacity=".12"/>')
        body.append(svg_text(46, y + 4, f"{10.0**power:g}", "end", 10))
    front = " ".join(
        f"{x_of(p.seconds):.1f},{y_of(p.error):.1f}" for p in curve.front if p in shown
    )
    body.append(f'<polyline points="{front}" fill="none" stroke="{FORWARD}"/>')
    for p in shown:
        color = FORWARD if p.on_front else STRANGER
        ringed = curve.knee >= 0 and p is curve.points[curve.knee]
        body.append(_dot(p, x_of, y_of, color, ringed))
    return svg(340, 212, title, body)


class _LogAxis:
    """A logarithmic axis from pixel `start` to pixel `end`."""

    def __init__(self, values: Sequence[float], start: float, end: float) -> None:
        self.low = math.floor(math.log10(min(values)))
        self.high = max(self.low + 1, math.ceil(math.log10(max(values))))
        self.start, self.end = start, end

    def __call__(self, value: float) -> float:
        position = (math.log10(value) - self.low) / (self.high - self.low)
        return self.start + (self.end - self.start) * position

    @property
    def ticks(self) -> list[tuple[int, float]]:
        return [(p, self(10.0**p)) for p in range(self.low, self.high + 1)]


def _dot(p: CostPoint, x_of: _LogAxis, y_of: _LogAxis, color: str, ringed: bool) -> str:
    x, y = x_of(p.seconds), y_of(p.error)
    bars = ""
    if p.error_low > 0 and p.seconds_low > 0:
        bars = (
            f'<path d="M{x:.1f} {y_of(p.error_low):.1f}V{y_of(p.error_high):.1f}'
            f'M{x_of(p.seconds_low):.1f} {y:.1f}H{x_of(p.seconds_high):.1f}"'
            f' stroke="{color}" opacity=".5"/>'
        )
    ring = f' stroke="{color}" stroke-opacity=".4" stroke-width="7"' if ringed else ""
    return (
        f'{bars}<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{color}"{ring}>'
        f"<title>{escape(p.setting)}: {p.error:.3g}, {p.seconds:.3g} s</title></circle>"
    )
