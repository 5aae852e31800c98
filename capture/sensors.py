"""The air during a take, as far as somebody measures it."""

from typing import Any, Protocol, runtime_checkable

from capture.randomness import take_rng
from rir import Environment

__all__ = ["AirSensor", "NoSensor", "SimulatedAir"]


@runtime_checkable
class AirSensor(Protocol):
    """Anything that reads temperature, humidity and pressure."""

    def read(self, take: str) -> Environment:
        """Return the state of the air for a take, NaN for what is not measured."""
        ...


class NoSensor:
    """Nobody measures the air.

    Examples
    --------
    >>> NoSensor().read("P01_AB_1").temperature_c
    nan
    """

    def read(self, take: str) -> Environment:
        """Return NaN for everything."""
        del take
        return Environment()


class SimulatedAir:
    """Let the air of a simulated world change from take to take, and read it.

    Parameters
    ----------
    world : Any
        The world; one with ``set_air`` also hears the change.
    mean : Environment
        The air on average.
    sigma_c : float
        Standard deviation of the temperature from take to take [K].
    seed : int
        With the name of a take, the source of its temperature.
    """

    def __init__(
        self, world: Any, mean: Environment, *, sigma_c: float = 0.0, seed: int = 0
    ) -> None:
        self._world = world
        self._mean = mean
        self._sigma = sigma_c
        self._seed = seed

    def read(self, take: str) -> Environment:
        """Return the air of a take, the same whenever the take is repeated."""
        mean = self._mean
        if not self._sigma:
            return mean
        change = take_rng(self._seed, f"air {take}").normal(0.0, self._sigma)
        temperature = mean.temperature_c + change
        self._world.set_air(temperature_c=temperature)
        return Environment(temperature, mean.humidity_percent, mean.pressure_kpa)
