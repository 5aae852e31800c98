"""Jogging by the keys of a terminal."""

import sys
from collections.abc import Callable, Iterator

import numpy as np

from rigs.rig import Rig
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

KEYS = {
    "\x1b[A": (0, 1, 0), "\x1b[B": (0, -1, 0), "\x1b[C": (1, 0, 0),
    "\x1b[D": (-1, 0, 0), "\x1b[5~": (0, 0, 1), "\x1b[6~": (0, 0, -1),
}  # fmt: skip
"""Arrows move in x and y, page up and down in z."""
FASTER, SLOWER, LEAVE = "+", "-", "q"


def jog_by_keys(
    rig: Rig,
    step: float,
    show: Callable[[str], None],
    keys: Iterator[str] | None = None,
) -> None:
    """Move a rig by small steps as keys are pressed, until q.

    Parameters
    ----------
    rig
        A homed rig.
    step
        Length of a step, m; + and - double and halve it.
    show
        Shows one line.
    keys
        The keys; those of the terminal by default.

    Raises
    ------
    RigError
        If the rig does not know where it is, or fails.
    """
    show(f"arrows: x, y; page up/down: z; + and -: step ({1000 * step:g} mm); q: leave")
    for key in keys or terminal_keys():
        if key == LEAVE:
            return
        if key in (FASTER, SLOWER):
            step *= 2.0 if key == FASTER else 0.5
            show(f"step {1000 * step:g} mm")
        elif key in KEYS:
            show(_step(rig, step * np.array(KEYS[key], dtype=float)))


def _step(rig: Rig, way: np.ndarray) -> str:
    here = rig.where()
    if here is None:
        raise RigError(f"{rig.name} cannot be jogged: {rig.trouble()}; home it first")
    try:
        return str(rig.move(Pose(here.position + way, here.orientation)))
    except OutOfReachError as error:
        return str(error)


def terminal_keys() -> Iterator[str]:
    """Yield the keys pressed in the terminal."""
    import termios
    import tty

    if not sys.stdin.isatty():
        raise RigError("jogging needs a terminal with a keyboard")
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        while True:
            key = sys.stdin.read(1)
            if key == "\x1b":
                key += sys.stdin.read(2)
                key += sys.stdin.read(1) if key[-1].isdigit() else ""
            yield key
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
