"""The error tree.

Every error of the project is a `ResoundingError`; each leaf also inherits the
builtin a Python reader expects, so that ``except ValueError`` keeps working.
A message says what was asked, what is, and what to do, with numbers and units.
"""

__all__ = [
    "ConfigError",
    "DatasetError",
    "ExtensionError",
    "InterfaceError",
    "MissingPartError",
    "OutOfReachError",
    "ResoundingError",
    "RigError",
    "SceneError",
    "SessionError",
    "SignalError",
    "TrainingError",
    "UnknownNameError",
]


class ResoundingError(Exception):
    """Root of every error that Resounding raises on purpose."""


class ConfigError(ResoundingError, ValueError):
    """A configuration cannot be used; the message lists every mistake."""


class SignalError(ResoundingError, ValueError):
    """A signal or its description (rate, shape, band) cannot be used."""


class OutOfReachError(ResoundingError, ValueError):
    """A pose lies outside what a rig or a room allows; nothing was moved."""


class SceneError(ResoundingError, ValueError):
    """A room or scene cannot be simulated as described."""


class DatasetError(ResoundingError, ValueError):
    """A data set or session file is broken, newer than this program, or unfit."""


class RigError(ResoundingError, RuntimeError):
    """A positioning rig failed or its position is not known."""


class InterfaceError(ResoundingError, RuntimeError):
    """An audio interface failed or cannot do what was asked."""


class SessionError(ResoundingError, RuntimeError):
    """A capture session cannot start, resume or finish."""


class TrainingError(ResoundingError, RuntimeError):
    """A field cannot be trained or loaded."""


class MissingPartError(ResoundingError, ImportError):
    """An optional part is not installed; the message says what to install."""


class ExtensionError(ResoundingError, ImportError):
    """What an installed package adds cannot be used; the message names the package."""


class UnknownNameError(ResoundingError, KeyError):
    """A name is not in a table; the message lists the near and the known ones."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""
