"""``capture-pairs cost``: what accuracy costs in a session's own simulated room."""

from dataclasses import dataclass
from pathlib import Path

from capture.commands.options import SessionOptions, option
from rir.command import make_console

__all__ = ["REAL", "CostOptions", "show_cost"]

REAL = ("--rig", "--device", "--host-api", "--thermometer", "--overlap", "--closure")
"""Flags of real hardware and of whole sessions: one simulated pair has neither."""


@dataclass(frozen=True)
class CostOptions:
    """Where the curves go."""

    out: Path | None = option("Folder for page and curves (cost-<room>).")


def show_cost(session: SessionOptions, writing: CostOptions) -> None:
    """Simulate what sweep, takes, band and float width gain."""
    from analysis.cost import write_cost_page
    from capture.cost import measure_session
    from capture.cost.table import assumed_line, cost_table

    console = make_console()
    config = session.plan()
    folder = writing.out or Path(f"cost-{config.room.name}")
    console.out(assumed_line(config))
    curves = []
    for knob, pair in measure_session(config).items():
        console.print(cost_table(pair))
        for curve in pair:
            console.out(curve.sentence)
            name = f"{knob}-{curve.quantity}".replace(" ", "-")
            curve.save(folder / f"{name}.json")
        curves += pair
    page = write_cost_page(curves, folder / "cost.html")
    console.out(f"SIMULATED curves: {page}")
