"""Time as the rigs see it: real, simulated, or real but faster."""

import time
from dataclasses import dataclass
from typing import Protocol, runtime_checkable


@runtime_checkable
class Clock(Protocol):
    """What anything that waits is given instead of the wall clock."""

    def now(self) -> float:
        """Return the time in seconds since an arbitrary start."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let the given time in seconds pass."""
        ...


class SystemClock:
    """Pass real time."""

    def now(self) -> float:
        """Return seconds of the monotonic clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait the given seconds."""
        time.sleep(max(0.0, seconds))


@dataclass
class VirtualClock:
    """Pass simulated time at once.

    Examples
    --------
    >>> clock = VirtualClock()
    >>> clock.sleep(3600.0)
    >>> clock.now()
    3600.0
    """

    time: float = 0.0

    def now(self) -> float:
        """Return the simulated seconds passed so far."""
        return self.time

    def sleep(self, seconds: float) -> None:
        """Advance the simulated time."""
        self.time += max(0.0, seconds)


@dataclass(frozen=True)
class FastClock:
    """Pass real time multiplied by a rate, so that simulators need not crawl."""

    rate: float = 100.0

    def now(self) -> float:
        """Return the accelerated seconds."""
        return time.monotonic() * self.rate

    def sleep(self, seconds: float) -> None:
        """Wait the given accelerated seconds."""
        time.sleep(max(0.0, seconds) / self.rate)
