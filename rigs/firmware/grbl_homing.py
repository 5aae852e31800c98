"""The homing cycle of a Grbl board: Z first, then X and Y, onto the switches."""

from typing import TYPE_CHECKING

import numpy as np

from rigs.firmware.motion import Glide

if TYPE_CHECKING:
    from rigs.firmware.grbl import GrblFirmware

SEARCH = 1.5
LOCATE_PASSES = 2


def start_homing(board: "GrblFirmware") -> None:
    """Begin the cycle; it answers when it is over."""
    _seek(board, [[2], [0, 1]])


def _seek(board: "GrblFirmware", cycles: list[list[int]]) -> None:
    axes = cycles[0]
    travel = max(board.settings[130 + k] for k in axes) * SEARCH
    gaps = np.zeros(3)
    for k in axes:
        gaps[k] = max(0.0, -board.true_position[k])
    if np.max(gaps) > travel:
        seconds = travel / board.settings[25] * 60.0
        board.schedule(seconds, lambda: _fail(board))
        return
    start = board.rest.copy()
    _run(board, start, gaps, gaps, cycles)


def _run(
    board: "GrblFirmware",
    start: np.ndarray,
    gaps: np.ndarray,
    left: np.ndarray,
    cycles: list[list[int]],
) -> None:
    """Run all axes at the same rate until the nearest switch, then the others on."""
    going = left > 1e-9
    if not np.any(going):
        board.rest = start
        _touched(board, gaps, cycles)
        return
    step = np.where(going, np.min(left[going]), 0.0)
    speed = board.settings[25] / 60.0 * np.sqrt(np.sum(going))
    glide = Glide(board.rest.copy(), board.rest + step, float(speed), 1e6, board.now)
    board.glide = glide

    def reached() -> None:
        board.rest = glide.end.copy()
        board.glide = None
        _run(board, start, gaps, left - step, cycles)

    board.schedule(glide.end_time - board.now, reached)


def _touched(board: "GrblFirmware", gaps: np.ndarray, cycles: list[list[int]]) -> None:
    board.rest = board.rest + gaps
    board.glide = None
    pull = board.settings[27]
    seconds = LOCATE_PASSES * 2 * pull / board.settings[24] * 60.0
    seconds += board.settings[26] / 1000.0 * 4
    board.schedule(seconds, lambda: _pulled_off(board, cycles))


def _pulled_off(board: "GrblFirmware", cycles: list[list[int]]) -> None:
    pull = board.settings[27]
    for k in cycles[0]:
        true = -pull
        board.rest[k] = -pull
        board.slipped[k] = true - board.rest[k]
    board.planned = board.rest.copy()
    if cycles[1:]:
        _seek(board, cycles[1:])
    else:
        _done(board)


def _done(board: "GrblFirmware") -> None:
    if board.reports.pending:
        board.reports.pending = False
        board.send(board.reports.status())
    board.state = "Idle"
    board.commands.homing_line = False
    board.run_startup()
    board.answer()
    board.wake()


def _fail(board: "GrblFirmware") -> None:
    board.send("ALARM:9\r\n")
    board.state = "Alarm"
    board.locked = True

    def restart() -> None:
        board.send("ok\r\n")
        board.locked = False
        board.clear()
        board.greet()

    board.schedule(0.65, restart)
