"""What find-room does: read a data set, find its room, show and write it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from inverse.acoustics import Acoustics
from inverse.find import CUT, find_room
from inverse.plan.described import described_walls
from inverse.plan.ground_plan import GroundPlan, plan_of
from inverse.plan.plan_plot import write_plan
from inverse.rows.reading import read_rows
from inverse.search import PriorKnowledge, SearchSettings
from rir import Dataset
from rir.command import make_console
from rir.errors import ConfigError

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["RoomRequest", "find_and_report"]


@dataclass(frozen=True)
class RoomRequest:
    """Hold what was asked on the command line, lengths in metres, times in seconds."""

    sessions: list[str]
    out: Path | None
    drawn: str | None
    pose_sd_m: float
    sample_rate: float | None
    reach_s: float
    simulated: bool | None
    quiet: bool

    def dataset(self) -> Dataset:
        """Open what was asked for; a file of another tool by its ending."""
        from rir.files import FORMATS, is_simulated

        path = Path(self.sessions[0])
        for kind in FORMATS.values():
            if kind.suffix and kind.suits(path) and len(self.sessions) == 1:
                return kind.read(path, self.simulated)
        dataset = Dataset.open(*self.sessions)
        is_simulated(self.simulated, {"simulated": dataset.simulated}, path)
        return dataset

    def folder(self) -> Path:
        """Return the folder to write to."""
        if self.out is not None:
            return self.out
        first = Path(self.sessions[0]).resolve()
        return Path(f"{first.stem if first.suffix else first.name}-room")


def find_and_report(request: RoomRequest) -> Acoustics:
    """Find a room, show its walls, and write its plan and the room itself.

    Raises
    ------
    ConfigError
        If a number asked for makes no sense.
    """
    if not 0 < request.reach_s < np.inf:
        raise ConfigError(f"--reach {request.reach_s:g} must be above 0 s, as 0.12")
    if not 0 <= request.pose_sd_m < np.inf:
        sd_mm = 1000 * request.pose_sd_m
        raise ConfigError(f"--pose-error {sd_mm:g} must not be below 0 mm; 0: exact")
    console = make_console()
    dataset = request.dataset()
    gains = dataset.emitter_gain, dataset.listener_gain
    if request.drawn in ("auto", "blind"):
        raise ConfigError(
            f"--drawn {request.drawn} names no mesh, room file or scene: leave it out"
            " to find the room blind"
        )
    prior = PriorKnowledge.of(request.drawn or "blind", None, *gains)
    longest = CUT * request.reach_s
    folder = request.folder()
    folder.mkdir(parents=True, exist_ok=True)
    with console.status("reading") as status:
        if request.quiet:
            status.stop()
        rows = read_rows(dataset, sample_rate=request.sample_rate, duration=longest)
        status.update(f"finding walls in {len(rows)} responses")
        acoustics = find_room(
            rows,
            SearchSettings(
                reach_s=request.reach_s, late=False, pose_sd_m=request.pose_sd_m
            ),
            prior,
        )
    plan = plan_of(
        acoustics,
        rows.emitters.positions,
        rows.listeners.positions,
        described_walls(dataset),
        dataset.mark,
    )
    places = f"{rows.n_places} emitter place" + "s" * (rows.n_places != 1)
    console.out(dataset.mark, style="bold", end=" ")
    console.out(f"data: {len(rows)} responses, {places}")
    console.print(_table(plan))
    if plan.walls:
        part = 100 * (1 - plan.unexplained)
        console.out(f"their paths explain {part:.0f} % of the energy")
    for alarm in plan.alarms:
        console.out(f"! {alarm}")
    written = [*write_plan(plan, folder), acoustics.save(folder / "room.npz")]
    console.out("wrote " + ", ".join(str(path) for path in written))
    return acoustics


def _table(plan: GroundPlan) -> "Table":
    from rich.table import Table

    count = len(plan.walls)
    table = Table(title=f"{count} wall{'s' * (count != 1)} found [{plan.mark}]")
    table.add_column("wall")
    for name in ("x", "y", "z", "offset [m]", "± [mm]", "reflection"):
        table.add_column(name, justify="right")
    for number, wall in enumerate(plan.walls, start=1):
        spread = f"{wall.sd_mm:.2g}" if np.isfinite(wall.sd_mm) else "as drawn"
        table.add_row(
            wall.level or f"wall {number}",
            *(f"{part:+.3f}" for part in wall.normal),
            f"{wall.offset_m:.3f}",
            spread,
            f"{wall.reflection:.2f}",
        )
    return table
