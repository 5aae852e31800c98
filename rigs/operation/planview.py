"""A plan view in the terminal: reach, keep-outs, pairs and carriers from above."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rigs.carriers import Carriers
from rigs.planning.envelope import FAR, Envelope
from rir.pose import Pose

if TYPE_CHECKING:
    from rich.text import Text

STYLES = {
    "▒": "yellow", "E": "bold red", "L": "bold blue", "a": "cyan", "b": "cyan",
    "·": "dim",
}  # fmt: skip


class Canvas:
    """Characters over a part of the floor; a character is twice as tall as wide."""

    def __init__(self, low: np.ndarray, high: np.ndarray, width: int = 64) -> None:
        self.low, self.high = low[:2], np.maximum(high[:2], low[:2] + 1e-6)
        size = self.high - self.low
        self.width = width
        self.height = max(3, round(width * float(size[1] / size[0]) / 2))
        self.rows = [[" "] * width for _ in range(self.height)]

    def cell(self, point: np.ndarray) -> tuple[int, int]:
        """Return row and column of a point; row 0 is the far side."""
        share = (np.asarray(point)[:2] - self.low) / (self.high - self.low)
        column = round(float(share[0]) * (self.width - 1))
        row = self.height - 1 - round(float(share[1]) * (self.height - 1))
        return min(max(row, 0), self.height - 1), min(max(column, 0), self.width - 1)

    def mark(self, point: np.ndarray, sign: str) -> None:
        """Put a sign at a point."""
        row, column = self.cell(point)
        self.rows[row][column] = sign

    def fill(self, low: np.ndarray, high: np.ndarray, sign: str) -> None:
        """Fill a rectangle."""
        bottom, left = self.cell(np.clip(low[:2], self.low, self.high))
        top, right = self.cell(np.clip(high[:2], self.low, self.high))
        for row in self.rows[top : bottom + 1]:
            row[left : right + 1] = sign * (right + 1 - left)

    def line(self, start: np.ndarray, end: np.ndarray, sign: str) -> None:
        """Draw a dotted line where nothing else stands."""
        for share in np.linspace(0.0, 1.0, 2 * self.width):
            row, column = self.cell(start + share * (end - start))
            if self.rows[row][column] == " ":
                self.rows[row][column] = sign

    def lines(self) -> list[str]:
        """Return the picture in a frame, with the scale below."""
        edge = "─" * self.width
        body = [f"│{''.join(row)}│" for row in self.rows]
        scale = (
            f"x {self.low[0]:.2f}…{self.high[0]:.2f} m →   "
            f"y {self.low[1]:.2f}…{self.high[1]:.2f} m ↑"
        )
        return [f"┌{edge}┐", *body, f"└{edge}┘", scale]


def draw_plan(
    envelope: Envelope,
    pairs: Sequence[tuple[Pose, Pose]] = (),
    carriers: tuple[Pose | None, Pose | None] = (None, None),
    width: int = 64,
) -> list[str]:
    """Return the lines of a plan view.

    Pairs are drawn as a and b joined by dots, carriers as E and L.

    Examples
    --------
    >>> from rigs.planning.envelope import KeepOut
    >>> room = Envelope([0, 0, 0], [4, 2, 2], [KeepOut("table", [1, 0, 0], [2, 1, 1])])
    >>> for line in draw_plan(room, carriers=(Pose.at(0, 2, 1), None), width=8):
    ...     print(line)
    ┌────────┐
    │E       │
    │  ▒▒▒   │
    │  ▒▒▒   │
    └────────┘
    x 0.00…4.00 m →   y 0.00…2.00 m ↑
    """
    canvas = Canvas(envelope.low, envelope.high, width)
    for box in envelope.keep_outs:
        if np.all(np.abs(box.low[:2]) < FAR):
            canvas.fill(box.low, box.high, "▒")
    for a, b in pairs:
        canvas.line(a.position, b.position, "·")
    for a, b in pairs:
        canvas.mark(a.position, "a")
        canvas.mark(b.position, "b")
    for pose, sign in zip(carriers, "EL", strict=True):
        if pose is not None:
            canvas.mark(pose.position, sign)
    return canvas.lines()


def coloured(lines: Sequence[str]) -> "Text":
    """Return a plan view with its colours, for rich."""
    from rich.text import Text

    text = Text()
    for line in lines:
        for sign in line:
            text.append(sign, STYLES.get(sign, ""))
        text.append("\n")
    return text


def plan_of(carriers: Carriers, pairs: Sequence[tuple[Pose, Pose]] = ()) -> list[str]:
    """Return the plan view of two carriers as they stand."""
    envelope = carriers.emitter.envelope or carriers.listener.envelope
    if envelope is None or np.any(envelope.high - envelope.low > 100.0):
        return ["no envelope is given, so there is no plan to draw"]
    return draw_plan(envelope, pairs, carriers.where())
