"""Put a report together and write its files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from analysis.differences import compared_symbols
from analysis.metrics import METRICS
from analysis.report.charts import (
    FORWARD,
    REVERSE,
    STRANGER,
    strip_chart,
    waveform_chart,
)
from analysis.report.contents import Report, RoomSummary, report_json
from analysis.report.maps import coherence_chart, position_map
from analysis.report.page import render_page
from analysis.report.pictures import WAVE_SECONDS, packed_pair
from analysis.report.study import RoomStudy, StudyOptions, study_rooms
from analysis.report.summary import room_summary
from analysis.report.tables import csv_table, latex_table, pair_csv
from analysis.report.verdict import verdict
from rir.dataset import Dataset
from rir.records import software_version

__all__ = ["build_report", "write_files", "write_report"]


def write_report(
    datasets: Sequence[Dataset],
    folder: str | Path,
    *,
    title: str = "Reciprocity report",
    options: StudyOptions | None = None,
    created_utc: str = "",
    figures: bool = False,
) -> dict[str, Path]:
    """Write a reciprocity report.

    ``report.html`` is for people; ``report.json`` holds every number;
    ``report.csv`` the table, ``pairs.csv`` the pairs, ``report.tex`` the table for
    a paper.

    Parameters
    ----------
    datasets : sequence of Dataset
        Sessions with pairs.
    folder : path
        Where to write; made if absent.
    title : str
        Heading of the page.
    options : StudyOptions, optional
        How rooms are compared.
    created_utc : str
        Time to write on the page.
    figures : bool
        Also write every figure as SVG and PNG, into ``figures/``.

    Returns
    -------
    dict of str to Path
        The files made, by kind.
    """
    studies, report = build_report(
        datasets, title=title, options=options, created_utc=created_utc
    )
    return write_files(report, studies, Path(folder), figures=figures)


def build_report(
    datasets: Sequence[Dataset],
    *,
    title: str,
    options: StudyOptions | None,
    created_utc: str,
) -> tuple[list[RoomStudy], Report]:
    """Study every room; return the studies and the report of them."""
    chosen = options or StudyOptions()
    rng = np.random.default_rng(chosen.seed)
    studies = study_rooms(datasets, chosen, rng)
    rooms = [room_summary(study, rng) for study in studies]
    return studies, Report(
        title=title,
        software=software_version(),
        created_utc=created_utc,
        mark=" and ".join(sorted({room.mark for room in rooms})),
        verdicts=[verdict(room) for room in rooms],
        methods=_methods(chosen),
        rooms=rooms,
    )


def write_files(
    report: Report, studies: Sequence[RoomStudy], folder: Path, *, figures: bool = False
) -> dict[str, Path]:
    """Write the files of a report; return them by kind."""
    told = list(zip(studies, report.rooms, strict=True))
    drawn = [room_figures(study, room) for study, room in told]
    pictures = [_pictures(study, room) for study, room in told]
    paths = _write(folder, report, render_page(report, drawn, pictures))
    if figures:
        from analysis.report.figures import write_figures

        paths["figures"] = write_figures(folder / "figures", studies, drawn)
    return paths


def _write(folder: Path, report: Report, page: str) -> dict[str, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        "report.html": page,
        "report.json": report_json(report),
        "report.csv": csv_table(report),
        "report.tex": latex_table(report),
        "pairs.csv": pair_csv(report),
    }
    paths = {}
    for name, text in texts.items():
        path = folder / name
        path.write_text(text, encoding="utf-8")
        kind = "pairs" if name == "pairs.csv" else path.suffix[1:]
        paths[kind] = path
    return paths


def _methods(options: StudyOptions) -> dict[str, str]:
    compared = compared_symbols(options.flavour)
    methods = {
        f"{symbol} ({metric.flavour(options.flavour).version})": (
            f"{metric.formula}; {metric.flavour(options.flavour).source}"
        )
        for symbol, metric in METRICS.items()
        if symbol in compared
    }
    length = options.duration
    stated = "as each session states it, see its quality"
    places = stated if options.position_mm is None else f"{options.position_mm:g} mm"
    return methods | {
        "paired": "the two directions of a pair; mean of both orders as truth",
        "un-paired": "all other ordered pairs of responses in the same room",
        "time axis": "as recorded from the emission; no alignment, levels kept",
        "length": "whole" if length is None else f"the first {length:g} s",
        "intervals": f"95 %, studentised bootstrap over pairs, seed {options.seed}",
        "floor": (
            "made-up reverse takes, 20 or more a room: noise of both takes, logged "
            f"change of temperature, repeatability of places ({places})"
        ),
        "coherence": (
            "correlation of the directions in octaves and time windows, mean over "
            "pairs; matched: after one stretch and one delay for each pair"
        ),
        "outliers": (
            "gain, time stretch and delay fitted from the phases of octave "
            "cross-correlations; what is left above 900 Hz tells a displaced end, "
            "below 600 Hz unequal gain patterns; swapped takes by correlation with "
            "other pairs"
        ),
    }


def room_figures(study: RoomStudy, summary: RoomSummary) -> dict[str, str]:
    """Return the figures of a room as SVG texts by name."""
    room, dataset = study.distances, study.dataset
    forward, reverse = study.takes(0)
    stranger = study.takes(len(room.pairs) - 1)[1]
    shown = min(0.05, dataset.n_samples / dataset.sample_rate)
    curves = {
        "paired": ("Paired responses", ("B to A", REVERSE, reverse)),
        "unpaired": ("Un-paired responses", ("stranger", STRANGER, stranger)),
    }
    drawn = {
        name: waveform_chart(
            title, [("A to B", FORWARD, forward), other], dataset.sample_rate, shown
        )
        for name, (title, other) in curves.items()
    }
    drawn["map"] = position_map(room.room, summary.pairs, _size(study))
    table = summary.coherence
    for kind, title, values in (
        ("as_recorded", "Coherence as recorded", table.as_recorded),
        ("matched", "Coherence, matched", table.matched),
    ):
        drawn[f"coherence-{kind}"] = coherence_chart(title, table, values)
    for symbol, values in room.paired.items():
        metric = METRICS[symbol]
        drawn[symbol] = strip_chart(
            f"{symbol}: {metric.title}",
            metric.table_unit,
            metric.table_factor * values.mean(axis=1),
            metric.table_factor * room.unpaired[symbol],
            [pair.pair for pair in summary.pairs],
        )
    return drawn


def _size(study: RoomStudy) -> Sequence[float] | None:
    for spec in study.dataset.rooms:
        if spec is not None and spec.name == study.distances.room:
            return spec.size_m
    return None


def _pictures(study: RoomStudy, summary: RoomSummary) -> dict[str, Any]:
    rate = study.dataset.sample_rate
    duration = study.dataset.n_samples / rate
    return {
        "room": study.distances.room,
        "duration": duration,
        "wave_seconds": min(WAVE_SECONDS, duration),
        "nyquist": rate / 2,
        "pairs": [
            {"pair": p.pair, "note": p.note, **packed_pair(*study.takes(k), rate)}
            for k, p in enumerate(summary.pairs)
        ],
    }
