"""What is looked at while a field learns: scores, files and a TensorBoard."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData
from fields.evaluate import METRIC_UNITS, Scores, score
from fields.plan import Progress

__all__ = [
    "curve_writer",
    "plot_curves",
    "tell_all",
    "tensorboard_writer",
    "watcher",
]

WATCHED_ROWS = 48
"""Unseen rows of a curve: scored in a second, steady enough to see a trend."""

Tell = Callable[[Progress], None]


def watcher(data: FieldData, rows: int = WATCHED_ROWS) -> Callable[[Any], Scores]:
    """Return a function that scores a field on a few rows, always the same ones.

    Parameters
    ----------
    data : FieldData
        Rows the training does not see.
    rows : int
        Score so many of them, spread evenly.
    """
    chosen = np.linspace(0, len(data) - 1, min(len(data), rows)).astype(int)
    few = data.rows(np.unique(chosen))
    return lambda field: score(field, few)


def tell_all(*listeners: Tell) -> Tell:
    """Return a function that tells every listener of a step."""

    def tell(now: Progress) -> None:
        for listener in listeners:
            listener(now)

    return tell


def curve_writer(folder: Path, title: str, mark: str) -> Tell:
    """Return a listener that keeps curves.csv and curves.png up to date."""
    rows: list[dict[str, float]] = []

    def tell(now: Progress) -> None:
        if now.scores is None:
            return
        rows.append({"step": now.step, "seconds": now.seconds, **now.scores})
        with (folder / "curves.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
        plot_curves(folder / "curves.png", {"": rows}, f"{title} [{mark}]")

    return tell


def plot_curves(
    path: Path,
    curves: dict[str, list[dict[str, float]]],
    title: str,
    lines: dict[str, Scores] | None = None,
) -> None:
    """Draw each metric against the seconds of training, one line a curve.

    Parameters
    ----------
    path : Path
        PNG file to write.
    curves : dict
        Rows with "seconds" and the metrics, by label.
    title : str
        Above the panels.
    lines : dict, optional
        Scores that took no training, drawn across, by label.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="constrained")
    figure.suptitle(title)
    panels = figure.subplots(2, 4).flat
    for axes, (name, unit) in zip(panels, METRIC_UNITS.items(), strict=False):
        for label, rows in curves.items():
            seconds = [row["seconds"] for row in rows]
            axes.plot(seconds, [row[name] for row in rows], ".-", label=label)
        for place, (label, row) in enumerate((lines or {}).items()):
            style = ("--", ":")[place % 2]
            axes.axhline(row[name], color="grey", linestyle=style, label=label)
        axes.set_title(f"{name} {unit}", fontsize="small")
        axes.set_xlabel("s of training")
    # Seven metrics leave the eighth panel for the names.
    spare = figure.axes[-1]
    spare.axis("off")
    if any(curves):
        named = figure.axes[0].get_legend_handles_labels()
        spare.legend(*named, fontsize="x-small", loc="center")
    figure.savefig(path, dpi=100)


def tensorboard_writer(folder: Path) -> Tell:
    """Return a listener that writes event files for TensorBoard.

    Raises
    ------
    MissingPartError
        If the package tensorboard is not installed.
    """
    from rir.optional import require

    require("tensorboard", why="writing event files")
    boards = require("torch.utils.tensorboard", why="writing event files")
    board = boards.SummaryWriter(str(folder / "tensorboard"), flush_secs=10)

    def tell(now: Progress) -> None:
        if now.scores is None:
            board.add_scalar("training/loss", now.loss, now.step)
            return
        for name, value in now.scores.items():
            board.add_scalar(f"unseen emitters/{name}", value, now.step)
        board.flush()

    return tell
