"""The simulated world with the devices of a session in it."""

import hashlib
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from capture.config import SessionConfig
from capture.devices.mounting import mounted
from capture.signal.randomness import take_rng
from rir import Pose

__all__ = ["PlacedWorld"]


@runtime_checkable
class VariableAir(Protocol):
    """A world whose air can change."""

    def set_air(self, *, temperature_c: float) -> None:
        """Change the air."""
        ...


class PlacedWorld:
    """Place what two carriers carry into a world, with the carriers' own errors.

    Parameters
    ----------
    world : Any
        The room: ``place_emitter``, ``place_listener``, ``responses``.
    config : SessionConfig
        Where loudspeakers and microphones sit on their carriers, and how far off a
        placing may be.
    """

    def __init__(self, world: Any, config: SessionConfig) -> None:
        self.world = world
        self._config = config
        self._emitter: Pose | None = None

    def place_emitter(self, pose: Pose) -> None:
        """Put the loudspeakers' carrier at a pose."""
        self._emitter = self._off("emitter", pose)

    def place_listener(self, pose: Pose) -> None:
        """Put the microphones' carrier at a pose."""
        offsets = self._config.channels.microphone_offsets_m
        for index, place in enumerate(mounted(self._off("listener", pose), offsets)):
            self.world.place_listener(place, index)

    def responses(self, output: int = 0) -> NDArray[np.float64]:
        """Return the responses of one loudspeaker at all microphones."""
        if self._emitter is not None:
            offset = self._config.channels.loudspeaker_offsets_m[output]
            self.world.place_emitter(mounted(self._emitter, [offset])[0])
        return self.world.responses()

    def set_air(self, temperature_c: float) -> None:
        """Change the air, if the world has air that can change."""
        if isinstance(self.world, VariableAir):
            self.world.set_air(temperature_c=temperature_c)

    def _off(self, carrier: str, pose: Pose) -> Pose:
        """Return where a carrier really stands, the same whenever it comes back."""
        simulation = self._config.simulation
        sigma = simulation.placement_mm if simulation else 0.0
        if not sigma:
            return pose
        spot = hashlib.sha256(pose.position.tobytes()).hexdigest()
        rng = take_rng(self._config.seed, f"{carrier} {spot}")
        return Pose(pose.position + rng.normal(0.0, sigma / 1000, 3), pose.orientation)
