"""What ``capture-pairs cost`` shows on screen."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from capture.config import SessionConfig
from capture.cost.trials import imperfect
from rir.cost import CostCurve

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["assumed_line", "cost_table"]


def assumed_line(config: SessionConfig) -> str:
    """Return the line that says what the figures hold for."""
    simulation = imperfect(config).simulation
    if simulation is None or simulation.distortion_db is None:
        raise ValueError("an imperfect session has a simulation with distortion")
    second, third = simulation.distortion_db
    return (
        f"SIMULATED in {config.room.name}, pair {config.pairs[0].id}: room noise "
        f"{simulation.noise_db:g} dB re the direct sound at 1 m, harmonics "
        f"{second:g} and {third:g} dB (--noise-db and simulation: change them)"
    )


def cost_table(curves: Sequence[CostCurve]) -> "Table":
    """Return the settings of one knob with the error of each quantity."""
    from rich.table import Table
    from rich.text import Text

    first = curves[0]
    table = Table(title=f"{first.knob} ({first.mark})")
    table.add_column("setting")
    table.add_column(f"{first.seconds_of} s / {first.per}", justify="right")
    for curve in curves:
        table.add_column(curve.quantity, justify="right")
    table.add_column("")
    for k, point in enumerate(first.points):
        words = [curve.quantity for curve in curves if curve.knee == k]
        table.add_row(
            point.setting,
            f"{point.seconds:.3g}",
            *(curve.shown(curve.points[k].error) for curve in curves),
            Text(f"take for {', '.join(words)}", "green") if words else "",
        )
    return table
