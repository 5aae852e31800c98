"""The chapters of the page: text and tables as HTML."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from html import escape

from analysis.report.contents import MetricSummary, Report, RoomSummary, Span
from analysis.report.tables import cell, number, ratio_cell

__all__ = ["mark_banner", "methods_chapter", "overview_chapter", "room_chapter"]


def mark_banner(mark: str) -> str:
    """Return the band on top that says whether a microphone heard this."""
    kind = "simulated" if "SIMULATED" in mark else "measured"
    words = {
        "SIMULATED": "SIMULATED: no microphone heard any of this",
        "MEASURED": "MEASURED",
    }.get(mark, f"{mark}: read which room is which")
    return f'<div class="mark {kind}">{escape(words)}</div>'


def _table(head: Sequence[str], rows: Sequence[str]) -> str:
    cells = "".join(f"<th>{words}</th>" for words in head)
    return (
        f'<div class="scroll"><table><thead><tr>{cells}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def overview_chapter(rooms: Sequence[RoomSummary]) -> str:
    """Return the table of all rooms, like the paper's."""
    first = rooms[0].metrics
    symbols = list(first)
    rows = [row for room in rooms for row in _room_rows(room, symbols)]
    odd = any(_has_outliers(room) for room in rooms)
    without = "<b>Without outliers</b>: paired, without the pairs named below. "
    return (
        "<h2>Paired and un-paired responses</h2>"
        + _table(["", *_heads(first)], rows)
        + "<p>Mean distance, below it the 95 % interval of the mean over pairs. "
        + (without if odd else "")
        + "<b>Ratio</b>: how many times closer swapped responses are than strangers of "
        "the same room. <b>P</b>: chance that an un-paired distance exceeds a paired "
        "one. <b>Floor</b>: paired distance that noise, logged temperature and the "
        "repeatability of places alone would leave.</p>"
    )


def _heads(metrics: Mapping[str, MetricSummary]) -> list[str]:
    """Return the symbols with their units on a line that may break."""
    return [
        f"{symbol} <span>[{escape(m.unit)}]</span>" if m.unit else symbol
        for symbol, m in metrics.items()
    ]


def _has_outliers(room: RoomSummary) -> bool:
    return any(pair.faults for pair in room.pairs)


def _signed(value: float) -> str:
    """Return a number with its sign, and none where it rounds to zero."""
    return f"{value:+.2f}" if abs(value) >= 0.005 else "0.00"


def _room_rows(room: RoomSummary, symbols: Sequence[str]) -> list[str]:
    metrics = [room.metrics[s] for s in symbols]
    lines = {
        "un-paired": [cell(m.unpaired) for m in metrics],
        "paired": [cell(m.paired) for m in metrics],
        "without outliers": [cell(m.paired_sound) for m in metrics],
        "ratio": [ratio_cell(m) for m in metrics],
        "P": [number(m.superiority) for m in metrics],
        "floor": [number(m.floor, 2) for m in metrics],
    }
    if not _has_outliers(room):
        del lines["without outliers"]
    about = f"{room.mark}, {room.n_pairs} pairs"
    rows = [
        f'<tr class="room"><th colspan="{len(symbols) + 1}">{escape(room.room)} '
        f"<small>{about}</small></th></tr>"
    ]
    for words, cells in lines.items():
        body = "".join(f"<td>{c}</td>" for c in cells)
        kind = ' class="paired"' if words == "paired" else ""
        rows.append(f'<tr{kind}><td class="variant">{words}</td>{body}</tr>')
    return rows


def room_chapter(index: int, room: RoomSummary, drawn: Mapping[str, str]) -> str:
    """Return everything of one room."""
    figures = "".join(
        f'<figure class="{name}">{text}</figure>' for name, text in drawn.items()
    )
    return (
        f'<section data-room="{index}"><h2>{escape(room.room)} '
        f"({room.mark})</h2>{_outliers(room)}"
        f'<div class="figures">{figures}</div>{_pair_table(room)}{_detail()}'
        f"{_quality(room)}</section>"
    )


def _outliers(room: RoomSummary) -> str:
    odd = [(k, p) for k, p in enumerate(room.pairs) if p.faults]
    text = ""
    if odd:
        items = "".join(
            f'<li><a href="#detail" data-pair="{k}" role="button" tabindex="0">pair '
            f"{escape(p.pair)}</a>: {escape(p.note)}</li>"
            for k, p in odd
        )
        text += f'<p class="flag">Pairs that stand out:</p><ul>{items}</ul>'
    if room.excluded:
        items = "".join(
            f"<li>pair {escape(e.pair)}: {escape(e.reason)}</li>" for e in room.excluded
        )
        text += f'<p class="flag">Counted out:</p><ul>{items}</ul>'
    return text or "<p>No pair stands out.</p>"


def _pair_table(room: RoomSummary) -> str:
    symbols = list(room.metrics)
    rows = []
    for k, pair in enumerate(room.pairs):
        values = "".join(f"<td>{number(pair.distances[s])}</td>" for s in symbols)
        fitted = (pair.gain_db, pair.temperature_change_k)
        values += "".join(f"<td>{_signed(value)}</td>" for value in fitted)
        reason = escape(", ".join(fault.kind for fault in pair.faults))
        rows.append(
            f'<tr data-pair="{k}" tabindex="0"><td>{escape(pair.pair)}</td>{values}'
            f'<td class="flag">{reason}</td></tr>'
        )
    heads = ["pair", *_heads(room.metrics), "gain [dB]", "air [K]", ""]
    return (
        "<details open><summary>Pairs (choose one to see it)</summary>"
        '<div class="tall">' + _table(heads, rows) + "</div>"
        "</details>"
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


def _quality(room: RoomSummary) -> str:
    quality, typical = room.quality, room.typical
    entries = {
        "sessions": ", ".join(quality.sessions),
        "takes": (
            f"{quality.takes} in all, {quality.takes_rejected} rejected, "
            f"{quality.takes_used} used"
        ),
        "responses": (
            f"{quality.duration_s:g} s at {quality.sample_rate_hz} Hz; noise "
            f"{_span(quality.noise_floor_db)} dB re the largest sample"
        ),
    }
    entries["median pair"] = (
        f"gain {typical.gain_db:+.2f} dB, air {typical.temperature_k:+.3f} K, "
        f"places {typical.position_mm:.1f} mm between the directions"
    )
    entries["floor"] = (
        f"predicted with {room.position_mm:g} mm repeatability of places "
        "along each axis"
    )
    entries |= {name: _span(span) for name, span in quality.logged.items()}
    body = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(words)}</dd>"
        for name, words in entries.items()
    )
    return f"<details><summary>Session quality</summary><dl>{body}</dl></details>"


def _span(span: Span) -> str:
    low, middle, high = (number(n, 4) for n in astuple(span))
    return low if low == high else f"{low} to {high}, median {middle}"


def methods_chapter(report: Report) -> str:
    """Return what was computed how, by which program, when."""
    entries = dict(report.methods)
    entries["program"] = report.software
    entries["made"] = report.created_utc
    body = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(str(words))}</dd>"
        for name, words in entries.items()
    )
    return f"<h2>Methods and versions</h2><dl>{body}</dl>"
