"""The homing cycle of a Grbl board: Z first, then X and Y, onto the switches."""

from collections.abc import Callable

import numpy as np

from rigs.firmware.grbl.board import Board
from rigs.firmware.motion import Glide

SEARCH = 1.5  # HOMING_AXIS_SEARCH_SCALAR of Grbl 1.1
LOCATE_PASSES = 2  # N_HOMING_LOCATE_CYCLE 1 of Grbl 1.1: towards the switch, and off it
SEEK_ACCELERATION = 1e6
"""mm/s²: so high that the ramps vanish; how long homing takes is only typical."""
DEBOUNCES = 4
"""Debounce times ($26) waited: after the seek, two locating passes and the pull-off."""
FAILED_RESTART = 0.65
"""From a failed homing to the banner of the restart, s, as recorded."""


class Homing:
    """Home a board, and say when it is done.

    Parameters
    ----------
    board
        The board.
    done
        Called when all axes stand off their switches.
    """

    def __init__(self, board: Board, done: Callable[[], None]) -> None:
        self.board, self.done = board, done
        self.cycles = [[2], [0, 1]]

    def seek(self) -> None:
        """Begin with the next axes."""
        board, state = self.board, self.board.state
        axes = self.cycles[0]
        travel = max(state.settings[130 + k] for k in axes) * SEARCH
        gaps = np.zeros(3)
        for k in axes:
            gaps[k] = max(0.0, -board.true_position[k])
        if np.max(gaps) > travel:
            seconds = travel / state.settings[25] * 60.0
            board.schedule(seconds, self._fail)
            return
        self._run(state.rest.copy(), gaps, gaps)

    def _run(self, start: np.ndarray, gaps: np.ndarray, left: np.ndarray) -> None:
        """Run all axes at the same rate until the nearest switch, then the others."""
        board, state = self.board, self.board.state
        going = left > 1e-9
        if not np.any(going):
            state.rest = start + gaps
            self._locate()
            return
        step = np.where(going, np.min(left[going]), 0.0)
        speed = float(state.settings[25] / 60.0 * np.sqrt(np.sum(going)))
        here = state.rest.copy()
        glide = Glide(here, here + step, speed, SEEK_ACCELERATION, board.now)
        state.glide = glide

        def reached() -> None:
            state.rest = glide.end.copy()
            state.glide = None
            self._run(start, gaps, left - step)

        board.schedule(glide.end_time - board.now, reached)

    def _locate(self) -> None:
        state = self.board.state
        state.glide = None
        pull = state.settings[27]
        seconds = LOCATE_PASSES * 2 * pull / state.settings[24] * 60.0
        seconds += state.settings[26] / 1000.0 * DEBOUNCES
        self.board.schedule(seconds, self._pull_off)

    def _pull_off(self) -> None:
        state = self.board.state
        for k in self.cycles.pop(0):
            state.rest[k] = -state.settings[27]
            state.slipped[k] = 0.0
        state.planned = state.rest.copy()
        if self.cycles:
            self.seek()
        else:
            self.done()

    def _fail(self) -> None:
        board = self.board
        board.send("ALARM:9\r\n")
        board.state.name = "Alarm"
        board.state.locked = True

        def restart() -> None:
            board.send("ok\r\n")
            board.state.locked = False
            board.clear()
            board.greet()

        board.schedule(FAILED_RESTART, restart)
