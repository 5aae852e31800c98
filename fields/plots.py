"""Pictures of a training: scores, loss curve and example responses."""

from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData
from fields.evaluate import score_units
from fields.field import Field
from fields.results import ResultTable

__all__ = ["plot_results"]


def plot_results(
    path: Path,
    table: ResultTable,
    history: list[list[float]],
    field: Field,
    test: FieldData,
) -> None:
    """Draw scores beside the baselines, the loss, and one unseen response.

    Parameters
    ----------
    path : Path
        PNG file to write.
    table : ResultTable
        Scores to draw, relative to chance.
    history : list
        Points (step, seconds, loss).
    field, test
        The trained field and held-out rows, for the example.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    scores, loss, example = figure.subplots(1, 3, width_ratios=[3, 2, 3])
    figure.suptitle(f"{table.title} [{table.mark}]")
    _draw_scores(scores, table)
    _draw_loss(loss, history)
    _draw_example(example, field, test)
    figure.savefig(path, dpi=110)


def _draw_scores(axes: Any, table: ResultTable) -> None:
    chance = next(row for row in table.rows if row["method"] == "chance")
    methods = [row for row in table.rows if row is not chance]
    names = [name for name in score_units() if name in chance]
    places = np.arange(len(names))
    width = 0.8 / max(len(methods), 1)
    for number, row in enumerate(methods):
        heights = [_ratio(row[name], chance[name]) for name in names]
        axes.bar(places + number * width, heights, width, label=row["method"])
    axes.axhline(1.0, color="black", linewidth=0.8, linestyle=":")
    axes.set_xticks(places + 0.4 - width / 2, names)
    axes.set_ylabel("difference / chance")
    axes.legend(fontsize="small")


def _ratio(value: float, chance: float) -> float:
    return value / chance if chance > 0 else float("nan")


def _draw_loss(axes: Any, history: list[list[float]]) -> None:
    if history:
        points = np.array(history)
        axes.semilogy(points[:, 1], np.maximum(points[:, 2], 1e-12))
    axes.set_xlabel("seconds")
    axes.set_ylabel("training loss")


def _draw_example(axes: Any, field: Field, test: FieldData) -> None:
    predicted = field.predict(test.emitters[0:1], test.listeners[0:1])[0]
    truth = test.responses[0] * test.frame.scale
    times = 1e3 * np.arange(len(truth)) / test.frame.sample_rate
    axes.plot(times, truth, linewidth=0.8, label="truth")
    axes.plot(times, predicted, linewidth=0.8, alpha=0.8, label=field.name)
    axes.set_xlabel("ms after emission")
    axes.set_title("one unseen response", fontsize="small")
    axes.legend(fontsize="small")
