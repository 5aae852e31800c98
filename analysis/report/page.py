"""The report as one HTML page that needs nothing but a browser."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from analysis.report.chapters import (
    mark_banner,
    methods_chapter,
    overview_chapter,
    room_chapter,
)
from analysis.report.contents import Report, without_nan

__all__ = ["render_page"]


def render_page(
    report: Report,
    figures: Sequence[Mapping[str, str]],
    pictures: Sequence[Mapping[str, Any]],
) -> str:
    """Return the page.

    Parameters
    ----------
    report : Report
    figures : sequence of mapping
        For each room, SVG texts by name.
    pictures : sequence of mapping
        For each room, what the program in the page draws of each pair.
    """
    here = files("analysis.report")
    template = Template((here / "page.html").read_text(encoding="utf-8"))
    data = json.dumps(without_nan({"rooms": list(pictures)}), separators=(",", ":"))
    verdicts = (f'<p class="verdict">{escape(v)}</p>' for v in report.verdicts)
    rooms = (
        room_chapter(index, room, drawn)
        for index, (room, drawn) in enumerate(zip(report.rooms, figures, strict=True))
    )
    return template.substitute(
        title=escape(report.title),
        generator=escape(report.software),
        css=(here / "page.css").read_text(encoding="utf-8"),
        js=(here / "page.js").read_text(encoding="utf-8"),
        mark=mark_banner(report.mark),
        verdicts="".join(verdicts),
        overview=overview_chapter(report.rooms),
        rooms="".join(rooms),
        methods=methods_chapter(report),
        # The only sequence that could end the script element early.
        data=data.replace("</", "<\\/"),
    )
