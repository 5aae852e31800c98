"""Put a report together and write its files."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.metrics import METRICS
from analysis.reciprocity import RoomDistances, measure_pairs
from analysis.report.charts import (
    FORWARD,
    REVERSE,
    STRANGER,
    strip_chart,
    waveform_chart,
)
from analysis.report.page import render_page
from analysis.report.pictures import WAVE_SECONDS, packed_pair
from analysis.report.summary import room_summary, verdict, without_nan
from analysis.report.tables import csv_table
from rir.dataset import Dataset
from rir.records import software_version

__all__ = ["SCHEMA", "write_report"]

FloatArray = NDArray[np.float64]

SCHEMA = 1


def write_report(
    datasets: Sequence[Dataset],
    folder: str | Path,
    *,
    title: str = "Reciprocity report",
    flavour: str = "paper",
    duration: float | None = None,
    seed: int = 0,
    created_utc: str = "",
) -> dict[str, Path]:
    """Write a reciprocity report: ``report.html``, ``report.json``, ``report.csv``.

    Parameters
    ----------
    datasets : sequence of Dataset
        Sessions with pairs.
    folder : path
        Where to write; made if absent.
    title : str
        Heading of the page.
    flavour : str
        Flavour of the metrics.
    duration : float, optional
        Compare the first seconds only [s].
    seed : int
        Seeds the bootstrap and the grouping of large sets; written to the report.
    created_utc : str
        Time to write on the page.

    Returns
    -------
    dict of str to Path
        The files made, by kind.
    """
    rng = np.random.default_rng(seed)
    measured = [
        (dataset, room)
        for dataset in datasets
        for room in measure_pairs(dataset, flavour=flavour, duration=duration, rng=rng)
    ]
    rooms = [room_summary(room, rng) for _, room in measured]
    report = {
        "schema": SCHEMA,
        "title": title,
        "software": software_version(),
        "created_utc": created_utc,
        "mark": " and ".join(sorted({room["mark"] for room in rooms})),
        "verdicts": [verdict(room) for room in rooms],
        "methods": _methods(flavour, duration, seed),
        "rooms": rooms,
    }
    page = render_page(
        report,
        [_figures(dataset, room) for dataset, room in measured],
        [
            _pictures(dataset, room, summary)
            for (dataset, room), summary in zip(measured, rooms, strict=True)
        ],
    )
    return _write(Path(folder), report, page)


def _write(folder: Path, report: dict[str, Any], page: str) -> dict[str, Path]:
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        "html": page,
        "json": json.dumps(without_nan(report), indent=1) + "\n",
        "csv": csv_table(report),
    }
    paths = {kind: folder / f"report.{kind}" for kind in texts}
    for kind, text in texts.items():
        paths[kind].write_text(text, encoding="utf-8")
    return paths


def _methods(flavour: str, duration: float | None, seed: int) -> dict[str, str]:
    methods = {
        f"{symbol} ({metric.flavour(flavour).version})": (
            f"{metric.formula}. {metric.flavour(flavour).source}."
        )
        for symbol, metric in METRICS.items()
    }
    methods["paired"] = "the two directions of a pair; mean of both orders as truth"
    methods["un-paired"] = "all other ordered pairs of responses in the same room"
    methods["time axis"] = "as recorded from the emission; no alignment, levels kept"
    methods["length"] = "whole" if duration is None else f"the first {duration} s"
    methods["intervals"] = f"95 %, studentised bootstrap over pairs, seed {seed}"
    return methods


def _first_takes(
    dataset: Dataset, room: RoomDistances, k: int
) -> tuple[FloatArray, FloatArray]:
    pair = room.pairs[k]
    rows = [int(pair.forward[0]), int(pair.reverse[0])]
    forward, reverse = np.asarray(dataset.responses[rows], float)
    return forward, reverse


def _figures(dataset: Dataset, room: RoomDistances) -> dict[str, str]:
    forward, reverse = _first_takes(dataset, room, 0)
    stranger = _first_takes(dataset, room, len(room.pairs) - 1)[1]
    shown = min(0.05, dataset.n_samples / dataset.sample_rate)
    drawn = {
        "paired": waveform_chart(
            "Paired responses",
            [("A to B", FORWARD, forward), ("B to A", REVERSE, reverse)],
            dataset.sample_rate,
            shown,
        ),
        "unpaired": waveform_chart(
            "Un-paired responses",
            [("A to B", FORWARD, forward), ("stranger", STRANGER, stranger)],
            dataset.sample_rate,
            shown,
        ),
    }
    for symbol, values in room.paired.items():
        metric = METRICS[symbol]
        drawn[symbol] = strip_chart(
            f"{symbol}: {metric.title}",
            metric.table_unit,
            metric.table_factor * values.mean(axis=1),
            metric.table_factor * room.unpaired[symbol],
        )
    return drawn


def _pictures(
    dataset: Dataset, room: RoomDistances, summary: dict[str, Any]
) -> dict[str, Any]:
    duration = dataset.n_samples / dataset.sample_rate
    pairs = [
        {
            "pair": said["pair"],
            "note": said.get("note", ""),
            **packed_pair(*_first_takes(dataset, room, k), dataset.sample_rate),
        }
        for k, said in enumerate(summary["pairs"])
    ]
    return {
        "room": room.room,
        "duration": duration,
        "wave_seconds": min(WAVE_SECONDS, duration),
        "nyquist": dataset.sample_rate / 2,
        "pairs": pairs,
    }
