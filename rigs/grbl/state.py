"""What is known about a Grbl board: connecting, homing, checking, stopping."""

import re
from collections.abc import Callable

import numpy as np

from rigs.clock import Clock
from rigs.controller import NEVER_HOMED, Knowledge, State
from rigs.faults import (
    AlarmError,
    LineError,
    RebootError,
    RefusedError,
    SilenceError,
    StrayError,
    UnknownPositionError,
)
from rigs.grbl.board import BoardFacts, read_board
from rigs.grbl.codes import KEEPS_POSITION, alarm_text
from rigs.grbl.link import HOLD, GrblLink, Patience
from rigs.grbl.options import GrblOptions
from rigs.grbl.parsing import Status
from rigs.grbl.reference import SwitchReference
from rigs.lines.serial import Line
from rir.errors import RigError

STAMP = 7.313
"""G92 offset of X in mm that says: homed since the last reset."""


class GrblState(Knowledge[np.ndarray]):
    """Know at any time whether the position of one board is known.

    Parameters
    ----------
    line
        The serial line.
    clock
        Time.
    options
        What the rig file says.
    patience
        Time-outs.
    """

    def __init__(
        self,
        line: Line,
        clock: Clock,
        options: GrblOptions | None = None,
        patience: Patience | None = None,
        *,
        simulated: bool = False,
    ) -> None:
        super().__init__()
        self.options = options or GrblOptions()
        self.axes = self.options.axes
        self.simulated = simulated
        self.clock = clock
        self.link = GrblLink(line, clock, patience)
        self.board: BoardFacts | None = None
        self.state: str = State.DISCONNECTED
        self._snag = ""
        self.reference: SwitchReference | None = None
        self.alarms = 0
        self.homings = 0

    # -- what is known ----------------------------------------------------------------

    @property
    def why(self) -> str:
        """Why the position is not known, or what keeps it from moving."""
        return self._snag if self.known else self._why

    def _told(self, error: BaseException) -> None:
        """Draw the consequences of an error for what is known."""
        if isinstance(error, RebootError):
            self.state = State.ALARM
            self._lose(error)
        elif isinstance(error, AlarmError):
            self.alarms += 1
            self.state = f"Alarm({error.code})"
            if error.code not in KEEPS_POSITION:
                self._lose(error)
        elif isinstance(error, LineError):
            self.state = State.DISCONNECTED
            self._lose(error)

    # -- connecting -------------------------------------------------------------------

    def connect(self) -> None:
        """Open the line and read the board, without resetting it unless it is stuck.

        A board homed by this driver and not reset since is recognised by its stamp;
        any other position is unknown until `home`.

        Raises
        ------
        RigError
            If nothing answers, it is not Grbl 1.1, or its settings are not as the
            rig file expects.
        """
        self.state = State.CONNECTING
        self._lose(NEVER_HOMED)
        self.link.line.open()
        while self.link.next(self.link.patience.boot if not self.link.banner else 0.2):
            pass
        status = self._first_status()
        self.board = read_board(self.link, self.axes, self.options)
        self.state = status.state
        if status.state == State.IDLE and self._stamped():
            self._at = self.link.settled()[1][: len(self.axes)]

    def _first_status(self) -> Status:
        try:
            status = self._rested()
        except (SilenceError, RebootError, AlarmError):
            self.link.soft_reset()
            status = self.link.status()
        if status.state not in (State.IDLE, State.ALARM):
            self.link.soft_reset()
            status = self.link.status()
        return status

    def _rested(self) -> Status:
        """Return the status, after the end of a move that is still going on."""
        status = self.link.status()
        deadline = self.clock.now() + 120.0
        while status.state in (State.RUN, State.JOG) and self.clock.now() < deadline:
            self.clock.sleep(0.2)
            status = self.link.status()
        return status

    def _stamped(self) -> bool:
        if not self.options.stamp or self._board.family != "Grbl":
            return False
        return abs(self._board.g92(self.link) - STAMP) < 5e-4

    @property
    def _board(self) -> BoardFacts:
        if self.board is None:
            raise RigError("the controller is not connected; connect first")
        return self.board

    # -- homing -----------------------------------------------------------------------

    def home(self) -> None:
        """Run the homing cycle; afterwards the position is known.

        Raises
        ------
        RigError
            If the board has homing switched off, finds no switch, or does not answer.
        """
        board = self._board
        if not board.homing:
            raise RigError(
                "homing is switched off ($22=0), so the position can never be known; "
                "fit switches and set $22=1"
            )
        self._lose("homing has not finished")
        try:
            self._unstick()
            self.state = State.HOME
            self.link.command("$H", self.options.homing_s or board.homing_seconds())
            status, here = self.link.settled()
            if status.state != State.IDLE:
                raise RigError(f"after homing the board is {status.state}, not Idle")
            self._learn_reference()
            self._stamp()
        except BaseException as error:
            self._told(error)
            self._give_up(error)
            raise
        self.state = State.IDLE
        self.homings += 1
        self._at = here[: len(self.axes)]

    def _learn_reference(self) -> None:
        settings = self._board.settings
        self.reference = None
        plain = not settings.get(21, 0) and not settings.get(23, 0)
        if self.options.reference and plain:
            pull = settings.get(27, 1.0)
            self.reference = SwitchReference(self.link, pull, len(self.axes))
            self.reference.learn()

    def _unstick(self) -> None:
        """Bring the board into Idle or Alarm, from which it can home."""
        try:
            if self.link.status().state in (State.IDLE, State.ALARM):
                return
        except (SilenceError, RebootError, AlarmError):
            pass
        self.link.soft_reset()
        status = self.link.status()
        if status.state not in (State.IDLE, State.ALARM):
            raise RigError(
                f"the board stays in {status.state} after a reset; look at it"
            )

    def _stamp(self) -> None:
        if self.options.stamp and self._board.family == "Grbl":
            x = self.link.settled()[1][0] - self._board.g54(self.link)
            self.link.command(f"G21 G92 X{x - STAMP:.3f}")

    def _give_up(self, error: BaseException) -> None:
        """After an interrupted homing, leave the board still and at rest."""
        if isinstance(error, LineError | RefusedError):
            return
        try:
            self.link.soft_reset()
        except RigError:
            self.state = State.FAULT

    def unlock(self) -> None:
        """Leave an alarm that kept the position, by explicit consent of the caller.

        Raises
        ------
        UnknownPositionError
            If the position is not known: only homing helps then.
        """
        if not self.known:
            raise UnknownPositionError(
                f"unlocking would pretend a position that is not known ({self.why}); "
                "home instead"
            )
        at = self._at
        try:
            self._unstick()
            self.link.command("$X")
            self._stamp()
        except RigError as error:
            self._told(error)
            raise
        self._at = at
        self.state = State.IDLE
        self.verify()

    # -- checking ---------------------------------------------------------------------

    def verify(self) -> np.ndarray:
        """Check that nothing happened since the last move; return the position.

        Raises
        ------
        UnknownPositionError
            If the position is not known.
        RebootError, AlarmError, StrayError, SilenceError
            If something happened; the position is unknown afterwards.
        """
        if self._at is None:
            raise UnknownPositionError(f"the position is not known: {self.why}; home")
        if match := re.fullmatch(r"Alarm\((\d+)\)", self.state):
            raise AlarmError(
                f"it is locked by {alarm_text(int(match[1]))}; unlock or home it",
                int(match[1]),
            )
        try:
            status, here = self.link.settled()
            self._compare(status, here[: len(self.axes)])
            if status.state == State.IDLE and not self._stamp_holds():
                raise RebootError("the controller was reset unnoticed; home it again")
        except SilenceError as error:
            self._halt(error)
            raise
        except RigError as error:
            self._told(error)
            raise
        return self._at

    def _compare(self, status: Status, here: np.ndarray) -> None:
        if status.state != State.IDLE:
            self.state = status.state
            raise RigError(f"the board is {status.state}, not Idle; see why")
        off = float(np.max(np.abs(here - self._at)))
        if off > self.options.tolerance_mm:
            self._lose(f"the position jumped by {off:.3f} mm")
            raise StrayError(f"the position jumped by {off:.3f} mm on its own; home it")

    def _stamp_holds(self) -> bool:
        return not self.options.stamp or self._board.family != "Grbl" or self._stamped()

    # -- stopping ---------------------------------------------------------------------

    def stop(self) -> None:
        """Slow down, then clear everything; the position stays known if that works."""
        if self.state in (State.MOVING, State.HOLDING, State.HOME):
            self._halt(None)

    def emergency(self) -> None:
        """Reset at once; the position is lost if anything was moving."""
        self._lose("an emergency stop was made")
        self.state = State.ALARM
        self.link.send(b"\x18")

    def _halt(self, error: BaseException | None) -> None:
        """Bring the board to rest and make up one's mind about the position."""
        was_known = self.known
        if error is not None:
            self._told(error)
        if isinstance(error, LineError):
            return
        if isinstance(error, AlarmError) and error.code in KEEPS_POSITION:
            return
        try:
            self._controlled_stop()
            self._take_rest() if was_known and self.known else None
        except BaseException as second:
            self._told(second)
            self._lose(f"it could not be stopped in an orderly way: {second}")
            self.state = State.FAULT
            if not isinstance(second, RigError):
                raise
            self._last_resort()

    def _last_resort(self) -> None:
        try:
            self.link.soft_reset()
        except LineError:
            self.state = State.DISCONNECTED
        except RigError:
            self.state = State.FAULT

    def _controlled_stop(self) -> None:
        status = self.link.status()
        if status.state in (State.RUN, State.JOG, State.HOLD, State.DOOR):
            self.link.send(HOLD)
            self._await_state(
                lambda s: (
                    s.state in (State.IDLE, State.ALARM)
                    or (s.state in (State.HOLD, State.DOOR) and s.substate == 0)
                )
            )
        self.link.soft_reset()
        if self.link.status().state != State.IDLE:
            self._lose("it stopped with an alarm, so the position is unsure")
            self.state = State.ALARM

    def _await_state(self, wanted: Callable[[Status], bool]) -> None:
        deadline = self.clock.now() + self.link.patience.stop
        while not wanted(status := self.link.status()):
            if self.clock.now() > deadline:
                raise SilenceError(f"the board stays in {status.state}")
            self.clock.sleep(0.05)

    def _take_rest(self) -> np.ndarray | None:
        """Take over the position at which a stop left the board."""
        status, here = self.link.settled()
        self.state = status.state
        if status.state != State.IDLE:
            self._lose(f"it stopped in {status.state}")
            return None
        self._stamp()
        self._at = here[: len(self.axes)]
        return self._at
