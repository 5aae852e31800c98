"""Maps: where the pairs stand in the room, and where the directions agree."""

import math
from collections.abc import Sequence
from html import escape

from analysis.report.charts import FORWARD, svg, svg_text
from analysis.report.contents import Coherence, PairSummary

__all__ = ["coherence_chart", "position_map"]

ODD = "#b3261e"


def position_map(
    room: str, pairs: Sequence[PairSummary], size: Sequence[float] | None
) -> str:
    """Draw the pairs from above; a line is a pair, red if something is wrong.

    Parameters
    ----------
    room : str
        Name of the room.
    pairs : sequence of PairSummary
    size : sequence of float, optional
        Edges of the room [m], where known.
    """
    points = [place for p in pairs for place in (p.a, p.b)]
    if size is not None:
        points += [[0.0, 0.0], list(size[:2])]
    low = [min(p[k] for p in points) for k in (0, 1)]
    high = [max(p[k] for p in points) for k in (0, 1)]
    wide = max(high[0] - low[0], high[1] - low[1], 0.1)
    scale = 290 / wide
    height = 46 + scale * (high[1] - low[1])

    def place(p: Sequence[float]) -> tuple[float, float]:
        return 25 + scale * (p[0] - low[0]), height - 18 - scale * (p[1] - low[1])

    body = [svg_text(4, 14, f"{room} from above", size=12)]
    if size is not None:
        (x0, y1), (x1, y0) = place([0.0, 0.0]), place(size)
        body.append(
            f'<rect x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}"'
            f' height="{y1 - y0:.1f}" fill="none" stroke="currentColor" opacity=".5"/>'
        )
    body += [_pair_line(k, p, place(p.a), place(p.b)) for k, p in enumerate(pairs)]
    metre = scale * (1 if wide < 20 else 10)
    body.append(f'<path d="M25 {height - 6:.0f}h{metre:.1f}" stroke="currentColor"/>')
    said = "1 m" if wide < 20 else "10 m"
    body.append(svg_text(30 + metre, height - 3, said, size=10))
    return svg(340, height, f"{room} from above", body)


def _pair_line(
    index: int,
    pair: PairSummary,
    a: tuple[float, float],
    b: tuple[float, float],
) -> str:
    color = ODD if pair.faults else FORWARD
    words = escape(f"pair {pair.pair} {pair.note}".strip())
    return (
        f'<g data-pair="{index}" stroke="{color}" fill="{color}"><title>{words}</title>'
        f'<path d="M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" stroke-width="1.5"'
        f' opacity=".6"/><path d="M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}"'
        ' stroke="transparent" stroke-width="10"/>'
        f'<circle cx="{a[0]:.1f}" cy="{a[1]:.1f}" r="3"/>'
        f'<rect x="{b[0] - 2.7:.1f}" y="{b[1] - 2.7:.1f}" width="5.4" height="5.4"/>'
        "</g>"
    )


def coherence_chart(
    title: str, table: Coherence, values: Sequence[Sequence[float]]
) -> str:
    """Draw the correlation of the directions over octaves and time windows.

    Parameters
    ----------
    title : str
        Heading.
    table : Coherence
        Has the octaves and the edges of the windows.
    values : sequence of sequence of float
        The correlation to draw, by octave and window.
    """
    octaves, edges = table.octaves_hz, table.edges_ms
    body = [svg_text(4, 14, title, size=12)]
    wide, tall = 280 / max(1, len(edges) - 1), 20
    bottom = 26 + tall * len(octaves)
    for row, (octave, line) in enumerate(zip(octaves, values, strict=True)):
        y = bottom - tall * (row + 1)
        name = f"{octave:g}" if octave < 1000 else f"{octave / 1000:g}k"
        body.append(svg_text(44, y + 14, name, "end", 10))
        for k, value in enumerate(line):
            body.append(_cell(50 + wide * k, y, wide, tall, value))
    for k, edge in enumerate(edges):
        body.append(svg_text(50 + wide * k, bottom + 12, f"{edge:.0f}", "middle", 9))
    body.append(svg_text(334, bottom + 24, "ms after the direct sound", "end", 9))
    body.append(svg_text(4, bottom + 24, "Hz", size=9))
    return svg(340, bottom + 28, title, body)


def _cell(x: float, y: float, wide: float, tall: float, value: float) -> str:
    if not math.isfinite(value):
        return (
            f'<rect x="{x:.1f}" y="{y}" width="{wide - 1:.1f}" height="{tall - 1}"'
            ' fill="#8883"><title>covered by noise</title></rect>'
        )
    share = min(1.0, max(0.0, value))
    color = f"hsl({8 + 200 * share:.0f} 65% 33%)"
    return (
        f'<rect x="{x:.1f}" y="{y}" width="{wide - 1:.1f}" height="{tall - 1}"'
        f' fill="{color}"/><text x="{x + wide / 2:.1f}" y="{y + 14}" fill="#fff"'
        f' font-size="10" font-family="sans-serif" text-anchor="middle">{value:.2f}'
        "</text>"
    )
