"""The report as one HTML page that needs nothing but a browser."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from analysis.metrics import METRICS
from analysis.report.summary import without_nan
from analysis.report.tables import cell, ratio_cell

__all__ = ["render_page"]


def render_page(
    report: Mapping[str, Any],
    figures: Sequence[Mapping[str, str]],
    pictures: Sequence[Mapping[str, Any]],
) -> str:
    """Return the page.

    Parameters
    ----------
    report : mapping
        What the JSON file holds.
    figures : sequence of mapping
        For each room, SVG texts by name.
    pictures : sequence of mapping
        For each room, what the program in the page draws of each pair.
    """
    here = files("analysis.report")
    template = Template((here / "page.html").read_text(encoding="utf-8"))
    data = json.dumps(without_nan({"rooms": list(pictures)}), separators=(",", ":"))
    return template.substitute(
        title=escape(report["title"]),
        generator=escape(report["software"]),
        css=(here / "page.css").read_text(encoding="utf-8"),
        js=(here / "page.js").read_text(encoding="utf-8"),
        mark=_mark(report["mark"]),
        verdicts="".join(
            f'<p class="verdict">{escape(words)}</p>' for words in report["verdicts"]
        ),
        overview=_overview(report["rooms"]),
        rooms="".join(
            _room(index, room, drawn)
            for index, (room, drawn) in enumerate(
                zip(report["rooms"], figures, strict=True)
            )
        ),
        methods=_methods(report),
        # The only sequence that could end the script element early.
        data=data.replace("</", "<\\/"),
    )


def _mark(mark: str) -> str:
    kind = "simulated" if "SIMULATED" in mark else "measured"
    words = {
        "SIMULATED": "SIMULATED: no microphone heard any of this",
        "MEASURED": "MEASURED",
    }.get(mark, mark)
    return f'<div class="mark {kind}">{escape(words)}</div>'


def _overview(rooms: Sequence[Mapping[str, Any]]) -> str:
    symbols = list(rooms[0]["metrics"])
    head = "".join(
        f"<th>{s}{_unit(rooms[0]['metrics'][s]['unit'])}</th>" for s in symbols
    )
    body = "".join(_room_rows(room, symbols) for room in rooms)
    return (
        "<h2>Paired and un-paired responses</h2>"
        '<div class="scroll"><table><thead><tr><th>room</th><th>variant</th>'
        f"{head}</tr></thead><tbody>{body}</tbody></table></div>"
        "<p>Mean distance, below it the 95 % interval of the mean over pairs. "
        "Ratio: how many times closer swapped responses are than strangers of the "
        "same room. P: chance that an un-paired distance exceeds a paired one.</p>"
    )


def _unit(unit: str) -> str:
    return f" [{escape(unit)}]" if unit else ""


def _room_rows(room: Mapping[str, Any], symbols: Sequence[str]) -> str:
    name = f"{escape(room['room'])} <small>{room['mark']}, {room['n_pairs']} pairs"
    rows = []
    for variant in ("unpaired", "paired"):
        cells = "".join(
            f"<td>{cell(s, room['metrics'][s][variant])}</td>" for s in symbols
        )
        label = {"unpaired": "un-paired", "paired": "paired"}[variant]
        first = f"<td>{name}</small></td>" if variant == "unpaired" else "<td></td>"
        rows.append(f'<tr class="{variant}">{first}<td>{label}</td>{cells}</tr>')
    ratios = "".join(f"<td>{ratio_cell(room['metrics'][s])}</td>" for s in symbols)
    chances = "".join(
        f"<td>{room['metrics'][s]['superiority']:.2f}</td>" for s in symbols
    )
    rows.append(f"<tr><td></td><td>ratio</td>{ratios}</tr>")
    rows.append(f"<tr><td></td><td>P</td>{chances}</tr>")
    return "".join(rows)


def _room(index: int, room: Mapping[str, Any], drawn: Mapping[str, str]) -> str:
    figures = "".join(f"<figure>{svg}</figure>" for svg in drawn.values())
    return (
        f'<section data-room="{index}"><h2>{escape(room["room"])} '
        f"({room['mark']})</h2>{_excluded(room)}"
        f'<div class="figures">{figures}</div>{_pair_table(room)}{_detail()}</section>'
    )


def _excluded(room: Mapping[str, Any]) -> str:
    if not room["excluded"]:
        return ""
    items = "".join(
        f"<li>pair {escape(e['pair'])}: {escape(e['reason'])}</li>"
        for e in room["excluded"]
    )
    return f'<p class="flag">Counted out:</p><ul>{items}</ul>'


def _pair_table(room: Mapping[str, Any]) -> str:
    symbols = list(room["metrics"])
    head = "".join(f"<th>{s}</th>" for s in symbols)
    rows = []
    for k, pair in enumerate(room["pairs"]):
        values = "".join(
            f"<td>{pair['distances'][s]:.{METRICS[s].decimals}f}</td>" for s in symbols
        )
        note = escape(pair.get("note", ""))
        rows.append(
            f'<tr data-pair="{k}" tabindex="0"><td>{escape(pair["pair"])}</td>{values}'
            f'<td class="flag">{note}</td></tr>'
        )
    return (
        "<h3>Pairs (click one to see it)</h3>"
        f'<div class="scroll"><table><thead><tr><th>pair</th>{head}<th></th></tr>'
        f"</thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _detail() -> str:
    kinds = {
        "paired": "paired: A to B, B to A",
        "unpaired": "un-paired: A to B, a stranger",
        "decay": "decay curves",
        "spectrogram-forward": "A to B",
        "spectrogram-reverse": "B to A",
    }
    figures = "".join(
        f'<figure data-figure="{kind}"><canvas></canvas><figcaption>{words}'
        "</figcaption></figure>"
        for kind, words in kinds.items()
    )
    return (
        '<div class="detail" hidden><h3></h3><p class="note"></p><p class="key">'
        '<span><i style="background:#1f6fb2"></i>A to B</span>'
        '<span><i style="background:#d9690f"></i>B to A</span>'
        '<span><i style="background:#8a8f98"></i>un-paired</span>'
        '<label>zoom <input type="range" min="5" max="100" value="40"></label></p>'
        f'<div class="figures">{figures}</div></div>'
    )


def _methods(report: Mapping[str, Any]) -> str:
    entries = dict(report["methods"])
    entries["program"] = report["software"]
    entries["made"] = report["created_utc"]
    body = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(str(words))}</dd>"
        for name, words in entries.items()
    )
    return f"<h2>Methods and versions</h2><dl>{body}</dl>"
