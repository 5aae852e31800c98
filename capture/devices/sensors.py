"""The air during a take, as far as somebody measures it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from capture.signal.randomness import take_rng
from rir import Environment

__all__ = ["AirSensor", "AskedAir", "FileSensor", "NoSensor", "SimulatedAir"]


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


class FileSensor:
    """Read the air from a file that a logger keeps up to date.

    The last line holds temperature [°C] and, if known, relative humidity [%] and
    pressure [kPa], with blanks or commas between.

    Parameters
    ----------
    path : Path
        The file.
    tell : callable
        Told when the file cannot be read; the take then has no temperature.
    """

    def __init__(self, path: Path, tell: Callable[[str], None]) -> None:
        self._path = path
        self._tell = tell

    def read(self, take: str) -> Environment:
        """Return what the last line says, NaN for what it does not."""
        try:
            lines = self._path.read_text().split("\n")
            last = [line for line in lines if line.strip()][-1]
            return parse_air(last)
        except (OSError, IndexError, ValueError) as error:
            self._tell(f"{take} has no temperature: {self._path}: {error}")
            return Environment()


class AskedAir:
    """Ask the operator for the temperature, once for each pair.

    Parameters
    ----------
    ask : callable
        Shows a text, waits for a line and returns it.
    """

    def __init__(self, ask: Callable[[str], str]) -> None:
        self._ask = ask
        self._pair = ""
        self._air = Environment()

    def read(self, take: str) -> Environment:
        """Return the air of the take's pair; an empty answer means not measured."""
        pair = take.split("_", maxsplit=1)[0]
        if pair != self._pair:
            self._pair, self._air = pair, self._answer()
        return self._air

    def _answer(self) -> Environment:
        while True:
            answer = self._ask("temperature [°C], humidity [%] (empty: not measured):")
            if not answer.strip():
                return Environment()
            try:
                return parse_air(answer)
            except ValueError:
                continue


def parse_air(text: str) -> Environment:
    """Return the air from up to three numbers.

    Raises
    ------
    ValueError
        If there is no number, or one that cannot be.

    Examples
    --------
    >>> parse_air("21.4, 45").humidity_percent
    45.0
    """
    numbers = [float(word) for word in text.replace(",", " ").split()[:3]]
    if not numbers or not -50 <= numbers[0] <= 60:
        raise ValueError(f"no temperature in {text.strip()!r}")
    return Environment(*numbers)
