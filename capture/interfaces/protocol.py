"""The one thing every audio interface must do."""

from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from rir.arrays import FloatArray

__all__ = ["AudioInterface", "Recording"]


@dataclass(frozen=True, eq=False)
class Recording:
    """What the inputs heard during one take."""

    samples: FloatArray
    """Input samples, full scale = 1; microphones first, then the loopback. Shape
    (channels, n_samples)."""
    sample_rate: int
    """Rate [Hz]."""
    flags: list[str] = field(default_factory=list)
    """What the driver complained of, each with its frame; empty when all is well."""
    detail: dict[str, Any] = field(default_factory=dict)
    """Whatever else is worth keeping (device, block size, time stamps)."""


@runtime_checkable
class AudioInterface(Protocol):
    """A full-duplex interface, open for the whole session."""

    @property
    def sample_rate(self) -> int:
        """Rate [Hz]."""
        ...

    @property
    def n_inputs(self) -> int:
        """How many channels a recording has."""
        ...

    @property
    def loopback(self) -> int | None:
        """Which channel of a recording is the loopback (from 0), if any."""
        ...

    @property
    def simulated(self) -> bool:
        """Whether what is recorded comes from a computer model."""
        ...

    def play_record(
        self, signal: FloatArray, n_samples: int, *, label: str, output: int = 0
    ) -> Recording:
        """Play a signal and record all inputs from the same instant.

        Parameters
        ----------
        signal : ndarray, shape (n,) or (outputs, n)
            Output samples, full scale = 1; for one output, or for all in one take.
        n_samples : int
            How many samples to record.
        label : str
            Name of the take; simulated interfaces draw their noise from it.
        output : int
            Which of the session's loudspeakers plays (from 0), or the first of them.

        Raises
        ------
        InterfaceError
            If the device fails or stops; a new interface must then be opened.
        """
        ...

    def describe(self) -> dict[str, Any]:
        """Return what a reader of the data should know about the device."""
        ...

    def close(self) -> None:
        """Release the device; never hangs."""
        ...
