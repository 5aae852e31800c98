"""Figures drawn as SVG text: small, sharp, and readable without a program."""

import math
from collections.abc import Callable, Sequence
from html import escape

import numpy as np

from rir.arrays import FloatArray

__all__ = [
    "FORWARD",
    "REVERSE",
    "STRANGER",
    "strip_chart",
    "svg",
    "svg_text",
    "waveform_chart",
]

FORWARD = "#1f6fb2"
REVERSE = "#d9690f"
STRANGER = "#8a8f98"


def svg(width: float, height: float, label: str, body: Sequence[str]) -> str:
    """Return an SVG element with a title for readers that cannot see it."""
    return (
        f'<svg viewBox="0 0 {width:g} {height:g}" role="img"'
        f' xmlns="http://www.w3.org/2000/svg" aria-label="{escape(label)}">'
        f"<title>{escape(label)}</title>{''.join(body)}</svg>"
    )


def svg_text(
    x: float, y: float, words: str, anchor: str = "start", size: int = 11
) -> str:
    """Return an SVG text in the colour of the page."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}"'
        f' font-family="sans-serif" fill="currentColor">{escape(words)}</text>'
    )


def strip_chart(
    title: str,
    unit: str,
    paired: FloatArray,
    unpaired: FloatArray,
    names: Sequence[str] = (),
) -> str:
    """Draw paired and un-paired distances as dots on one logarithmic axis.

    Each paired dot carries the number of its pair, so that a page can react to it.

    Parameters
    ----------
    title, unit : str
        What is drawn, in which unit.
    paired, unpaired : ndarray
        Distances; those that are zero or undefined are left out.
    names : sequence of str
        Names of the pairs, shown beside the pointer.
    """
    strangers = _positive(unpaired)
    together = np.concatenate([_positive(paired), strangers])
    label = f"{title} [{unit}]" if unit else title
    body = [svg_text(4, 14, label, size=12)]
    if not len(together):
        return svg(340, 96, label, [*body, svg_text(4, 50, "all distances are zero")])
    low = math.floor(math.log10(together.min()))
    high = max(low + 1, math.ceil(math.log10(together.max())))

    def across(value: float) -> float:
        return 70 + 260 * (math.log10(value) - low) / (high - low)

    for power in range(low, high + 1):
        x = across(10.0**power)
        body.append(f'<path d="M{x:.1f} 22V76" stroke="currentColor" opacity=".15"/>')
        body.append(svg_text(x, 90, f"{10.0**power:g}", "middle", 10))
    body.append(svg_text(64, 42, "paired", "end"))
    body.append(svg_text(64, 68, "un-paired", "end"))
    body += _stranger_dots(strangers, across)
    body += _pair_dots(paired, names or [str(k) for k in range(len(paired))], across)
    body += [
        _mean_mark(values, color, y, across)
        for values, color, y in (
            (_positive(paired), FORWARD, 38),
            (strangers, STRANGER, 64),
        )
        if len(values)
    ]
    return svg(340, 96, label, body)


def _positive(values: FloatArray) -> FloatArray:
    kept = values[np.isfinite(values)]
    return np.sort(kept[kept > 0])


Across = Callable[[float], float]


def _lift(index: int, y: float) -> float:
    """Spread dots up and down evenly, the same way on every run."""
    return y + 14 * ((0.618 * index) % 1 - 0.5)


def _stranger_dots(values: FloatArray, across: Across) -> list[str]:
    # Many dots are thinned evenly over their ranks, so the spread stays visible.
    shown = values[np.linspace(0, len(values) - 1, min(len(values), 150)).astype(int)]
    path = "".join(
        f"M{across(v):.1f} {_lift(i, 64):.1f}h0" for i, v in enumerate(shown)
    )
    return [
        f'<path d="{path}" stroke="{STRANGER}" stroke-width="4" opacity=".55"'
        ' stroke-linecap="round"/>'
    ]


def _pair_dots(values: FloatArray, names: Sequence[str], across: Across) -> list[str]:
    dots = []
    for k, value in enumerate(values):
        if np.isfinite(value) and value > 0:
            x, y = across(float(value)), _lift(k, 38)
            dots.append(
                f'<g data-pair="{k}"><circle cx="{x:.1f}" cy="{y:.1f}" r="2.6"'
                f' fill="{FORWARD}" opacity=".6"><title>pair {escape(names[k])}'
                "</title></circle></g>"
            )
    return dots


def _mean_mark(values: FloatArray, color: str, y: float, across: Across) -> str:
    x = across(float(values.mean()))
    return f'<path d="M{x:.1f} {y - 10}v20" stroke="{color}" stroke-width="2.5"/>'


def waveform_chart(
    title: str,
    curves: Sequence[tuple[str, str, FloatArray]],
    sample_rate: int,
    duration: float,
) -> str:
    """Draw responses over one another.

    Parameters
    ----------
    title : str
        Heading of the figure.
    curves : sequence of (name, colour, samples)
        What to draw, the last on top.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Seconds to show.
    """
    count = max(2, round(duration * sample_rate))
    tallest = max(
        (float(np.max(np.abs(s[:count]), initial=0.0)) for _, _, s in curves),
        default=0.0,
    )
    body = [svg_text(4, 14, title, size=12)]
    body.append('<path d="M10 84H330" stroke="currentColor" opacity=".3"/>')
    for name, color, samples in curves:
        line = _polyline(samples[:count], tallest or 1.0)
        body.append(
            f'<path d="{line}" fill="none" stroke="{color}" stroke-width="1.1"'
            f' opacity=".85"><title>{escape(name)}</title></path>'
        )
    for k, (name, color, _) in enumerate(curves):
        body.append(
            f'<path d="M{200 + 70 * k} 10h14" stroke="{color}" stroke-width="3"/>'
        )
        body.append(svg_text(217 + 70 * k, 14, name, size=10))
    for fraction in (0, 0.5, 1.0):
        words = f"{1000 * duration * fraction:.0f} ms"
        anchor = ("start", "middle", "end")[round(2 * fraction)]
        body.append(svg_text(10 + 320 * fraction, 160, words, anchor, 10))
    return svg(340, 164, title, body)


def _polyline(samples: FloatArray, tallest: float, points: int = 640) -> str:
    """Return a path through the extremes of each pixel column."""
    blocks = np.array_split(samples, min(len(samples), points // 2))
    extremes = np.array([(b.min(), b.max()) for b in blocks]).ravel()
    if len(samples) <= points:
        extremes = samples
    x = np.linspace(10, 330, len(extremes))
    y = 84 - 62 * extremes / tallest
    pairs = " ".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))
    return f"M{pairs}"
