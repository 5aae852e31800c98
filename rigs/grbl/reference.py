"""Lost steps, found by feeling for the reference switches again."""

from dataclasses import dataclass, field

import numpy as np

from rigs.controller import State
from rigs.faults import StrayError
from rigs.grbl.link import GrblLink

RESOLUTION = 0.02
"""Step at which the search for a switching point ends, mm."""
CREEP = 600.0
"""Feed of the search, mm/min."""
ORDER = (2, 0, 1)
"""Up first, as homing does."""
SWITCHES = "XYZ"


@dataclass
class SwitchReference:
    """The switching points of one board, felt right after homing.

    Parameters
    ----------
    link
        The dialogue with the board.
    pull_off
        Distance of the homed position from the switches, mm.
    axes
        Number of axes.
    """

    link: GrblLink
    pull_off: float
    axes: int
    points: np.ndarray = field(init=False)
    """Machine position at which each switch closes, NaN where it does not."""

    def __post_init__(self) -> None:
        self.points = np.full(self.axes, np.nan)

    def learn(self) -> None:
        """Feel for all switches; the board has just homed."""
        for k in self._order():
            self.points[k] = self._feel(k)

    def drift(self) -> np.ndarray:
        """Return true minus counted position of each axis, mm.

        NaN where the switch does not close within the travel.

        Raises
        ------
        StrayError
            If a switch that closed after homing does not close any more.
        """
        for k in self._order():
            self._creep(k, -self.pull_off)
        drift = np.full(self.axes, np.nan)
        for k in self._order():
            if np.isfinite(self.points[k]):
                felt = self._feel(k)
                if not np.isfinite(felt):
                    raise StrayError(
                        f"the {SWITCHES[k]} switch no longer closes at "
                        f"{self.points[k]:.3f} mm: steps were lost; home it"
                    )
                drift[k] = self.points[k] - felt
        return drift

    def _order(self) -> list[int]:
        return [k for k in ORDER if k < self.axes]

    def _creep(self, k: int, place: float) -> bool:
        """Jog one axis to a place and return whether its switch is closed there."""
        self.link.command(f"$J=G53 G90 G21 {SWITCHES[k]}{place + 0.0:.3f} F{CREEP:g}")
        arrived = 0
        for _ in range(3000):
            status = self.link.status()
            here = self.link.machine_position(status)
            there = here is not None and abs(here[k] - place) < 0.01
            arrived = arrived + 1 if there and status.state == State.IDLE else 0
            if arrived == 2:
                return SWITCHES[k] in status.pins
            self.link.clock.sleep(0.05)
        raise StrayError(f"a creep of {SWITCHES[k]} to {place:.3f} mm did not arrive")

    def _feel(self, k: int) -> float:
        """Return where a switch closes, NaN if not within the travel."""
        low, high = -self.pull_off, 0.0
        if self._creep(k, low):
            closed = low
        elif not self._creep(k, high):
            closed = np.nan
        else:
            while high - low > RESOLUTION:
                middle = (low + high) / 2
                low, high = (low, middle) if self._creep(k, middle) else (middle, high)
            closed = high
        self._creep(k, -self.pull_off)
        return closed
