"""What a Grbl board is and how it is set up, read from the board itself."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigs.grbl.link import GrblLink
from rigs.grbl.options import GrblOptions
from rir.errors import RigError


@dataclass(frozen=True, eq=False)
class BoardFacts:
    """Firmware, settings and travel of one board."""

    family: str
    version: str
    build: tuple[str, ...]
    settings: dict[int, float]
    low: np.ndarray
    high: np.ndarray

    @property
    def homing(self) -> bool:
        """Whether a homing cycle is configured."""
        return bool(int(self.settings.get(22, 0)) & 1)

    @property
    def homed(self) -> np.ndarray:
        """Where each axis stands after homing, by the direction mask ($23), mm."""
        pull = self.settings.get(27, 0.0)
        mask = int(self.settings.get(23, 0))
        down = np.array([bool(mask >> k & 1) for k in range(len(self.low))])
        return np.where(down, pull - self.rates(130), -pull)

    def rates(self, first: int) -> np.ndarray:
        """Return the per-axis settings from a number on."""
        return np.array([self.settings[first + k] for k in range(len(self.low))])

    def homing_seconds(self) -> float:
        """Return the time homing may take, generously."""
        seek = max(self.settings.get(25, 500.0), 1.0) / 60.0
        locate = max(self.settings.get(24, 25.0), 1.0) / 60.0
        travel = float(np.max(self.rates(130)))
        pull = self.settings.get(27, 1.0)
        cycle = 1.5 * travel / seek + 10 * pull / locate
        return 20.0 + 2.0 * len(self.low) * cycle

    def limits_along(self, way: np.ndarray) -> tuple[float, float]:
        """Return the speed (mm/s) and acceleration (mm/s²) limit along a direction."""
        share = np.maximum(np.abs(way) / np.linalg.norm(way), 1e-12)
        speed = float(np.min(self.rates(110) / share)) / 60.0
        return speed, float(np.min(self.rates(120) / share))

    def offset(self, link: GrblLink, name: str) -> float:
        """Ask for the X part of an offset, mm."""
        for text in link.feedback("$#"):
            if match := re.fullmatch(rf"{name}:(-?\d+\.\d+),.*", text):
                return float(match[1])
        return float("nan")

    def g92(self, link: GrblLink) -> float:
        """Ask for the X part of the G92 offset, mm."""
        return self.offset(link, "G92")

    def g54(self, link: GrblLink) -> float:
        """Ask for the X part of the G54 offset, mm."""
        return self.offset(link, "G54")

    def describe(self) -> dict[str, Any]:
        """Return the facts a data set remembers."""
        text = repr(sorted(self.settings.items())).encode()
        return {
            "firmware": f"{self.family} {self.version}".strip(),
            "build": list(self.build),
            "settings_hash": hashlib.sha256(text).hexdigest()[:16],
            "low_mm": self.low.tolist(),
            "high_mm": self.high.tolist(),
        }


def read_board(link: GrblLink, axes: Sequence[str], options: GrblOptions) -> BoardFacts:
    """Ask a board for everything a driver must know.

    Raises
    ------
    RigError
        With all reasons why it cannot be used as the rig file describes it.
    """
    build = tuple(link.feedback("$I"))
    settings = link.settings()
    family = "GrblHAL" if any("grblHAL" in text for text in build) else "Grbl"
    version = next((t[4:].strip(":") for t in build if t.startswith("VER:")), "")
    wrong = list(_mistakes(version, settings, options))
    if wrong:
        raise RigError("the board does not fit the rig file: " + "; ".join(wrong))
    low, high = _travel(settings, len(axes), options)
    return BoardFacts(family, version, build, settings, low, high)


def _mistakes(version: str, settings: dict[int, float], options: GrblOptions):
    if not version.startswith("1.1"):
        yield f"it runs Grbl {version or '(unknown)'}, this driver needs 1.1"
    if settings.get(13, 0):
        yield "it reports inches ($13=1), set $13=0"
    for number, wanted in options.expect.items():
        found = settings.get(number)
        if found is None or abs(found - wanted) > 1e-6:
            yield f"${number} is {found}, the rig file expects {wanted:g}"
    missing = [n for n in (110, 120, 130) if n not in settings]
    if missing:
        yield f"it did not report {', '.join(f'${n}' for n in missing)}"


def _travel(
    settings: dict[int, float], count: int, options: GrblOptions
) -> tuple[np.ndarray, np.ndarray]:
    """Return the travel of the homed machine, cut to what the rig file allows.

    Grbl's machine space is negative: 0 is at the switches, the pull-off before them.
    """
    pull = settings.get(27, 0.0)
    high = np.full(count, -pull)
    low = np.array([-settings[130 + k] + pull for k in range(count)])
    if options.low_mm is not None:
        low = np.maximum(low, options.low_mm)
    if options.high_mm is not None:
        high = np.minimum(high, options.high_mm)
    return low, high
