"""Wait until a rig is quiet, judged by the microphones themselves."""

from collections.abc import Callable
from dataclasses import dataclass

from rigs.clock import Clock, SystemClock
from rir.errors import RigError

RISE_DB = 2.0
"""Accepted rise of the background over its baseline, dB."""


@dataclass(frozen=True)
class Settling:
    """How a rig came to rest: background levels heard, and the time it took."""

    levels_db: tuple[float, ...]
    seconds: float


def await_quiet(
    listen: Callable[[], float],
    baseline_db: float,
    *,
    rise_db: float = RISE_DB,
    timeout: float = 30.0,
    pause: float = 0.2,
    clock: Clock | None = None,
) -> Settling:
    """Listen again and again until the background is as quiet as it can be.

    Parameters
    ----------
    listen
        Records a short piece of background and returns its level in dB, in the band
        that matters.
    baseline_db
        Level with the rig at rest and silent, dB.
    rise_db
        How far above the baseline is quiet enough, dB.
    timeout
        Seconds after which to give up.
    pause
        Seconds between two attempts.
    clock
        Time.

    Raises
    ------
    RigError
        If it does not become quiet in time.

    Examples
    --------
    >>> from rigs.clock import VirtualClock
    >>> levels = iter([-40.0, -52.0, -59.5])
    >>> await_quiet(lambda: next(levels), -60.0, clock=VirtualClock())
    Settling(levels_db=(-40.0, -52.0, -59.5), seconds=0.4)
    """
    clock = clock or SystemClock()
    began = clock.now()
    levels: list[float] = []
    while True:
        levels.append(float(listen()))
        seconds = clock.now() - began
        if levels[-1] <= baseline_db + rise_db:
            return Settling(tuple(levels), seconds)
        if seconds >= timeout:
            raise RigError(
                f"the background stays at {levels[-1]:.1f} dB for {seconds:.0f} s, "
                f"{levels[-1] - baseline_db:.1f} dB above its baseline; {rise_db:.1f} "
                "dB are accepted; look for a fan, a motor or a visitor"
            )
        clock.sleep(pause)
