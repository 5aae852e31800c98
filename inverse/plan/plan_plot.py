"""Draw a plan: walls with their spread, places, and the room as described."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from inverse.objects.found_objects import FoundObjects
from inverse.plan.ground_plan import GroundPlan, PlanWall

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_plan", "write_plan"]

SURE_MM, POOR_MM = 0.1, 30.0
"""Spreads drawn thickest and thinnest: of clean responses, and of poses 3 cm off."""
THICK, THIN = 5.0, 1.0  # points
MOST_ALARMS, WIDTH = 6, 88  # lines and letters that fit above the plan
LINE_IN = 0.16  # inches a line of 8 points takes


def write_plan(plan: GroundPlan, folder: Path) -> list[Path]:
    """Draw plan.png and write plan.json into a folder; return both paths."""
    made = [folder / "plan.png", folder / "plan.json"]
    draw_plan(made[0], plan)
    plan.save(made[1])
    return made


def draw_plan(path: Path, plan: GroundPlan) -> None:
    """Draw a plan as a PNG; thick dark lines are sure, dashed ones unheard."""
    from matplotlib.figure import Figure

    lines = _lines(plan)
    height = _page_height(plan) + LINE_IN * len(lines)
    figure = Figure(figsize=(8, height), layout="constrained")
    axes = figure.add_subplot()
    for one, other in plan.known:
        axes.plot(*np.stack([one, other]).T, color="0.6", lw=1, ls=":", zorder=1)
    for wall in plan.walls:
        _draw_wall(axes, wall)
    _draw_furnishing(axes, plan.furnishing)
    axes.plot(*plan.listeners.T, ".", color="tab:blue", ms=3, zorder=6)
    axes.plot(*plan.emitters.T, "^", color="tab:red", ms=8, zorder=5)
    _name_marks(axes, len(plan.known) > 0)
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    title = f"walls heard, cut at {plan.height_m:.2f} m [{plan.mark}]"
    axes.set_title("\n".join([title, *lines]), fontsize=8, loc="left")
    figure.savefig(path, dpi=110)


def _page_height(plan: GroundPlan) -> float:
    """Return inches that suit the shape of the room."""
    parts = [wall.pieces.reshape(-1, 2) for wall in plan.walls]
    points = np.concatenate([plan.emitters, plan.listeners, *parts])
    wide, deep = np.maximum(np.ptp(points, axis=0), 0.5)
    return float(np.clip(7.2 * deep / wide + 2.0, 3.5, 14.0))


def _draw_wall(axes: "Axes", wall: PlanWall) -> None:
    from matplotlib import colormaps

    if len(wall.pieces) == 0:
        return
    sure = _sureness(wall.sd_mm)
    colour = colormaps["viridis"](0.85 * (1 - sure))
    width = THIN + (THICK - THIN) * sure
    for piece, heard in zip(wall.pieces, wall.heard, strict=True):
        wide, dashes = (width, "-") if heard else (THIN, (0, (2, 2)))
        axes.plot(*piece.T, color=colour, zorder=3, lw=wide, ls=dashes)
    middle = wall.pieces.reshape(-1, 2).mean(axis=0)
    away = middle + 0.12 * wall.normal[:2]
    turn = "vertical" if abs(wall.normal[0]) > abs(wall.normal[1]) else "horizontal"
    axes.annotate(
        _spread(wall.sd_mm), away, fontsize=7, rotation=turn, ha="center", va="center"
    )


def _draw_furnishing(axes: "Axes", found: FoundObjects) -> None:
    """Draw blocks as shades and small objects as rings as wide as they are loud."""
    for square in found.squares:
        axes.fill(*square.T, color="tab:orange", alpha=0.5, lw=0, zorder=1)
    if len(found.squares):
        axes.fill([], [], color="tab:orange", alpha=0.5, label="in the way of sound")
    if len(found.points):
        size = 30 + 1500 * np.clip(found.gains, 0, 0.3)
        x, y = found.points[:, 0], found.points[:, 1]
        axes.scatter(x, y, size, "none", edgecolors="tab:orange", zorder=4,
                     label="small object, scattering")  # fmt: skip


def _sureness(sd_mm: float) -> float:
    """Return 1 for a tenth of a millimetre and less, 0 for 3 cm and unknown."""
    if not np.isfinite(sd_mm):
        return 0.0
    share = np.log(POOR_MM / max(sd_mm, 1e-6)) / np.log(POOR_MM / SURE_MM)
    return float(np.clip(share, 0, 1))


def _spread(sd_mm: float) -> str:
    return f"±{sd_mm:.1g} mm" if np.isfinite(sd_mm) else "as drawn"


def _name_marks(axes: "Axes", known: bool) -> None:
    axes.plot([], [], "^", color="tab:red", label="emitters")
    axes.plot([], [], ".", color="tab:blue", label="listeners")
    axes.plot([], [], color="0.2", lw=THICK, label="wall, sure")
    axes.plot([], [], color="0.2", lw=THIN, ls="--", label="no reflection fell there")
    if known:
        axes.plot([], [], color="0.6", lw=1, ls=":", label="room as described")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3, fontsize=8)


def _lines(plan: GroundPlan) -> list[str]:
    from textwrap import wrap

    levels = [
        f"{wall.level} {wall.offset_m * np.sign(wall.normal[2]):.3f} m "
        f"{_spread(wall.sd_mm)}"
        for wall in plan.walls
        if wall.level
    ]
    found = "; ".join([f"{len(plan.walls)} walls", *filter(None, [", ".join(levels)])])
    if plan.furnishing:
        count, blocks = len(plan.furnishing.points), len(plan.furnishing.blocks)
        found += f"; small objects: {count}, blocks: {blocks}"
    lines = [f"{found}; {100 * plan.unexplained:.1f} % of the energy unexplained"]
    for alarm in plan.alarms[:MOST_ALARMS]:
        lines += wrap(f"! {alarm}", WIDTH)
    return lines
