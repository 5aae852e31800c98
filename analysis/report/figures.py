"""The figures as files: SVG as on the page, PNG for slides."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from analysis.metrics import METRICS
from analysis.report.charts import FORWARD, REVERSE, STRANGER
from analysis.report.study import RoomStudy

__all__ = ["write_figures"]


def write_figures(
    folder: Path, studies: Sequence[RoomStudy], drawn: Sequence[Mapping[str, str]]
) -> Path:
    """Write every figure of every room as SVG, and two overviews as PNG.

    Parameters
    ----------
    folder : Path
        Where to write; made if absent.
    studies : sequence of RoomStudy
        The rooms.
    drawn : sequence of mapping
        SVG texts by name, for each room.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for study, texts in zip(studies, drawn, strict=True):
        name = "".join(c if c.isalnum() else "-" for c in study.distances.room)
        for kind, text in texts.items():
            (folder / f"{name}-{kind}.svg").write_text(text, encoding="utf-8")
        _distances_png(study, folder / f"{name}-distances.png")
        _waveforms_png(study, folder / f"{name}-waveforms.png")
    return folder


def _distances_png(study: RoomStudy, path: Path) -> None:
    from matplotlib.figure import Figure

    room = study.distances
    rows = -(-len(room.paired) // 3)
    figure = Figure(figsize=(9, 2.5 * rows), layout="constrained")
    axes = figure.subplots(rows, 3, squeeze=False).ravel()
    for axis in axes[len(room.paired) :]:
        axis.axis("off")
    for axis, (symbol, values) in zip(axes, room.paired.items(), strict=False):
        metric = METRICS[symbol]
        both = [values.mean(axis=1), room.unpaired[symbol]]
        for k, (distances, color) in enumerate(
            zip(both, (FORWARD, STRANGER), strict=True)
        ):
            kept = metric.table_factor * distances[np.isfinite(distances)]
            lift = k + 0.5 * (0.618 * np.arange(len(kept)) % 1 - 0.5)
            axis.plot(kept, lift, ".", color=color, alpha=0.5, ms=4)
        axis.set_xscale("symlog", linthresh=1e-3)
        axis.set_yticks([0, 1], ["paired", "un-paired"])
        axis.set_title(f"{symbol} {metric.table_unit}".strip())
    figure.suptitle(f"{room.room} ({room.mark})")
    figure.savefig(path, dpi=150)


def _waveforms_png(study: RoomStudy, path: Path) -> None:
    from matplotlib.figure import Figure

    rate = study.dataset.sample_rate
    count = min(study.dataset.n_samples, round(0.05 * rate))
    forward, reverse = study.takes(0)
    stranger = study.takes(len(study.distances.pairs) - 1)[1]
    figure = Figure(figsize=(9, 3), layout="constrained")
    sides = figure.subplots(1, 2, sharey=True)
    time = 1000 * np.arange(count) / rate
    for axis, other, words, color in (
        (sides[0], reverse, "paired", REVERSE),
        (sides[1], stranger, "un-paired", STRANGER),
    ):
        axis.plot(time, forward[:count], color=FORWARD, lw=0.8)
        axis.plot(time, other[:count], color=color, lw=0.8, alpha=0.8)
        axis.set_title(words)
        axis.set_xlabel("time since emission [ms]")
    figure.suptitle(f"{study.distances.room} ({study.distances.mark})")
    figure.savefig(path, dpi=150)
