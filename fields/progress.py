"""Live progress of a training on a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fields.plan import Progress

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["progress_bar"]

SMOOTHING = 0.98


@contextmanager
def progress_bar(
    console: "Console", model: str, *, quiet: bool = False
) -> Iterator[Callable[[Progress], None]]:
    """Show a bar with step, loss and the time left; yields what to call."""
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.TaskProgressColumn(),
        bars.TextColumn("step {task.fields[step]} loss {task.fields[loss]:.4g}"),
        bars.TimeRemainingColumn(),
    )
    with bars.Progress(*columns, console=console, disable=quiet) as bar:
        task = bar.add_task(f"training {model}", total=1.0, step=0, loss=float("nan"))
        smooth = float("nan")

        def tell(now: Progress) -> None:
            nonlocal smooth
            new = now.loss == now.loss and smooth != smooth
            smooth = (
                now.loss if new else SMOOTHING * smooth + (1 - SMOOTHING) * now.loss
            )
            bar.update(task, completed=now.fraction, step=now.step, loss=smooth)

        yield tell
