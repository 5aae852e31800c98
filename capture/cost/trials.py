"""The knobs of a session and the settings to try."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from capture.config import NYQUIST_SHARE, SessionConfig, SimulationConfig
from capture.plan import build_plan

__all__ = ["ASSUMED", "CostTrial", "imperfect", "trials_of"]

ASSUMED = {
    "noise_db": -40.0,
    "converter_noise_db": -100.0,
    "distortion_db": (-45.0, -55.0),
}
"""What the loudspeaker and the room lack, where the simulation says nothing."""
SHARES = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)  # doublings: 3 dB each way
REPEATS = (1, 2, 4, 8)  # doublings: 3 dB each
NARROWER = (2, 1, 0, -1)  # octaves taken off each end; -1 is wider
LOWEST_HZ = 10.0  # below it no loudspeaker of this kind sounds
WORDS = {"16 bit": 16, "24 bit": 24, "float32": 32, "float64": 64}


@dataclass(frozen=True)
class CostTrial:
    """One setting of one knob."""

    name: str
    """As a person would write it."""
    config: SessionConfig
    """The session with that setting."""
    takes: int = 1
    """Takes that are averaged."""
    word: int = 64
    """Bits of a sample: 16 and 24 are those of the file, 32 and 64 those of the
    arithmetic too."""

    @property
    def seconds(self) -> float:
        """How long one direction is measured, moves left out."""
        return self.takes * build_plan(self.config).take_s


def imperfect(config: SessionConfig) -> SessionConfig:
    """Return a session in simulation, with noise and distortion.

    What its own simulation sets stays; for the rest `ASSUMED` stands in.
    """
    chosen = config.simulation or SimulationConfig()
    missing = {k: v for k, v in ASSUMED.items() if getattr(chosen, k) is None}
    change: dict[str, Any] = {
        "simulation": chosen.model_copy(update=missing),
        "interface": "simulated",
        "rig": "simulated",
        "thermometer": None,
        "overlap": False,
    }
    return config.model_copy(update=change)


def trials_of(config: SessionConfig) -> dict[str, list[CostTrial]]:
    """Return the knobs of a session, each with the settings to try.

    Sweep length; takes averaged; band, at the same seconds per octave; float width.
    """
    return {
        "sweep length": list(_lengths(config)),
        "repeats": [CostTrial(f"{takes}", config, takes) for takes in REPEATS],
        "band": list(_bands(config)),
        "float width": [
            CostTrial(name, config, word=word) for name, word in WORDS.items()
        ],
    }


def _lengths(config: SessionConfig) -> Iterator[CostTrial]:
    for share in SHARES:
        changed = _swept(config, share)
        yield CostTrial(f"{changed.sweep.seconds:.3g} s", changed)


def _bands(config: SessionConfig) -> Iterator[CostTrial]:
    low, high = config.sweep.band_hz
    for octaves in NARROWER:
        bottom = max(low * 2.0**octaves, LOWEST_HZ)
        top = min(high / 2.0**octaves, NYQUIST_SHARE * config.sample_rate)
        if top < 4 * bottom:
            continue
        share = float(np.log2(top / bottom) / np.log2(high / low))
        name = f"{bottom:.0f}–{top:.0f} Hz"
        yield CostTrial(name, _swept(config, share, band_hz=(bottom, top)))


def _swept(config: SessionConfig, share: float, **change: Any) -> SessionConfig:
    seconds = float(np.clip(share * config.sweep.seconds, 0.1, 120.0))
    sweep = config.sweep.model_copy(update={"seconds": seconds, **change})
    return config.model_copy(update={"sweep": sweep})
