"""What can go wrong with a rig, in the words of the driver."""

from rir.errors import RigError


class LineError(RigError):
    """The serial line is gone or cannot be opened."""


class SilenceError(RigError):
    """The controller did not answer in time."""


class RefusedError(RigError):
    """The controller refused a line."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class AlarmError(RigError):
    """The controller raised an alarm."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class RebootError(RigError):
    """The controller restarted by itself; where the carriage is has become unknown."""


class UnknownPositionError(RigError):
    """The position is not known, so nothing may move but the homing cycle."""


class StrayError(RigError):
    """The carriage is not where it should be."""
