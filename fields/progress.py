"""Live progress of a training on a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fields.evaluate import METRIC_UNITS
from fields.plan import Progress

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["progress_bar", "sparkline"]

SMOOTHING = 0.98
"""Of the loss shown: a mean over about the last 50 steps."""
SHOWN = ("C50", "STFT*")
BARS = "▁▂▃▄▅▆▇█"


@contextmanager
def progress_bar(
    console: "Console", model: str, *, quiet: bool = False
) -> Iterator[Callable[[Progress], None]]:
    """Show a bar with step, loss, metric curves and the time left.

    Yields what to call after every step.
    """
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description}", markup=False),
        bars.BarColumn(),
        bars.TaskProgressColumn(),
        bars.TextColumn(
            "step {task.fields[step]} loss {task.fields[loss]:.4g}", markup=False
        ),
        bars.TextColumn("{task.fields[curves]}", markup=False),
        bars.TimeRemainingColumn(),
    )
    with bars.Progress(*columns, console=console, disable=quiet) as bar:
        task = bar.add_task(
            f"training {model}", total=1.0, step=0, loss=float("nan"), curves=""
        )
        smooth = float("nan")
        curves: dict[str, list[float]] = {name: [] for name in SHOWN}

        def tell(now: Progress) -> None:
            nonlocal smooth
            new = now.loss == now.loss and smooth != smooth
            smooth = (
                now.loss if new else SMOOTHING * smooth + (1 - SMOOTHING) * now.loss
            )
            bar.update(task, completed=now.fraction, step=now.step, loss=smooth)
            if now.scores is not None:
                for name in SHOWN:
                    curves[name].append(now.scores[name])
                told = [_curve(name, values) for name, values in curves.items()]
                bar.update(task, curves=" ".join(told))

        yield tell


def _curve(name: str, values: list[float]) -> str:
    unit = METRIC_UNITS[name]
    return f"{name} {sparkline(values)} {values[-1]:.2f} {unit}".rstrip()


def sparkline(values: list[float]) -> str:
    """Draw values as a line of bars, from none at zero to a full one.

    Examples
    --------
    >>> sparkline([4.0, 2.0, 1.0])
    '█▅▃'
    """
    known = [value for value in values if value == value]
    largest = max(known, default=0.0)
    if largest <= 0:
        return ""
    steps = len(BARS) - 1
    return "".join(
        BARS[round(steps * max(value, 0.0) / largest)] if value == value else " "
        for value in values
    )
