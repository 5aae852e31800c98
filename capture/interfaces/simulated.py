"""An audio interface in a simulated room: no sound is made, and it says so."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.config import SessionConfig, SimulationConfig
from capture.faults import spoil
from capture.interfaces.loudspeaker import drive, loudspeaker_gain
from capture.interfaces.protocol import Recording
from capture.interfaces.table import (
    INTERFACES,
    InterfaceKind,
    InterfaceSurroundings,
    WorldView,
)
from capture.signal.randomness import take_rng
from capture.signal.resample import evaluate_stretched
from rir import InterfaceError
from rir.arrays import FloatArray

__all__ = ["SimulatedInterface"]


class SimulatedInterface:
    """Play into a simulated world and record what its listeners hear.

    The channels are the world's listeners, then the loopback. The electronics'
    latency, with its fraction, delays all of them alike.

    Parameters
    ----------
    world : WorldView
        The room; its emitter and listeners are placed by the rigs.
    simulation : SimulationConfig
        What is added to the world's own responses.
    sample_rate : int
        Rate [Hz]; the world's own.
    seed : int
        With the label of a take, the source of its noise.
    n_microphones : int
        How many listeners the world has.
    level : float
        Root mean square of the session's sweep; noise levels refer to it.
    """

    simulated = True

    def __init__(
        self,
        world: WorldView,
        simulation: SimulationConfig,
        *,
        sample_rate: int,
        seed: int = 0,
        n_microphones: int = 1,
        level: float = 1 / np.sqrt(2),
    ) -> None:
        self._level = level
        self.sample_rate = sample_rate
        self.loopback: int | None = n_microphones
        self.n_inputs = n_microphones + 1
        self._world = world
        self._simulation = simulation
        self._seed = seed
        self._driven: dict[int, _Driven] = {}

    def play_record(
        self, signal: FloatArray, n_samples: int, *, label: str, output: int = 0
    ) -> Recording:
        """Return what the listeners and the loopback record of a signal."""
        faults = [fault for fault in self._simulation.faults if fault.hits(label)]
        drift = sum(fault.amount for fault in faults if fault.kind == "drift")
        samples = np.zeros((self.n_inputs, n_samples))
        for number, part in enumerate(np.atleast_2d(signal)):
            responses = self._world.responses(output + number)
            driven = self._prepare(number, part, n_samples, responses.shape[-1])
            recorded = driven.record(responses, 1e-6 * drift)
            samples[:-1] += recorded[:-1]
            if number == 0:
                samples[-1] = recorded[-1]
        self._add_noise(samples, self._level, take_rng(self._seed, label))
        if faults:
            samples = spoil(
                samples,
                self._simulation.faults,
                take=label,
                seed=self._seed,
                sample_rate=self.sample_rate,
                played=self._driven[0].loopback,
                level=self._level,
            )
        if not self._simulation.exact:
            samples = samples.astype(np.float32).astype(np.float64)
        return Recording(samples, self.sample_rate, [], {"simulated": True})

    def _prepare(
        self, number: int, signal: FloatArray, n_samples: int, tail: int
    ) -> "_Driven":
        """Return the transformed signal; every take of a session shares it."""
        driven = self._driven.get(number)
        if driven is None or not driven.fits(signal, n_samples, tail):
            driven = _Driven(
                signal, n_samples, tail, self._simulation, self.sample_rate
            )
            self._driven[number] = driven
        return driven

    def _add_noise(
        self, samples: FloatArray, level: float, rng: np.random.Generator
    ) -> None:
        ambient = self._simulation.noise_db
        converter = self._simulation.converter_noise_db
        if ambient is not None:
            scale = level * 10 ** (ambient / 20)
            samples[:-1] += scale * rng.standard_normal(samples[:-1].shape)
        if converter is not None:
            samples += 10 ** (converter / 20) * rng.standard_normal(samples.shape)

    def describe(self) -> dict[str, Any]:
        """Return the name and every switch."""
        return {
            "name": "SIMULATED interface",
            "simulated": True,
            **self._simulation.model_dump(mode="json"),
        }

    def close(self) -> None:
        """Release nothing."""


class _Driven:
    """A signal as the loudspeaker and the loopback receive it, transformed once."""

    def __init__(
        self,
        signal: FloatArray,
        n_samples: int,
        tail: int,
        simulation: SimulationConfig,
        sample_rate: int,
    ) -> None:
        fft: Any = import_module("scipy.fft")

        self.signal, self.n_samples, self.tail = signal, n_samples, tail
        active = np.flatnonzero(signal)
        end = int(active[-1]) + 1 if active.size else 1
        latency = simulation.latency_samples
        room = end + int(np.ceil(latency)) + tail + GUARD
        self.n_fft = fft.next_fast_len(max(room, n_samples + GUARD), real=True)
        frequencies = fft.rfftfreq(self.n_fft)
        delay = np.exp(-2j * np.pi * frequencies * latency)
        self.plain = fft.rfft(signal, self.n_fft) * delay
        self.loopback = fft.irfft(self.plain, self.n_fft)[:n_samples]
        self.spectrum = self.plain
        if simulation.distortion_db is not None:
            bent = drive(signal[:end], simulation.distortion_db)
            self.spectrum = fft.rfft(bent, self.n_fft) * delay
        if simulation.loudspeaker_response:
            self.spectrum = self.spectrum * loudspeaker_gain(frequencies * sample_rate)

    def fits(self, signal: FloatArray, n_samples: int, tail: int) -> bool:
        """Tell whether this is the transform that a take needs."""
        same = self.signal is signal or np.array_equal(self.signal, signal)
        return same and (self.n_samples, self.tail) == (n_samples, tail)

    def record(self, responses: FloatArray, drift: float) -> FloatArray:
        """Return what every channel records, the loopback last.

        Parameters
        ----------
        responses : ndarray, shape (microphones, n)
            The room's answers.
        drift : float
            How much faster the recording clock's time runs, as a ratio.
        """
        fft: Any = import_module("scipy.fft")
        recorded = np.empty((len(responses) + 1, self.n_samples))
        for row, response in zip(recorded, responses, strict=False):
            heard = fft.rfft(response, self.n_fft) * self.spectrum
            row[:] = self._samples(heard, drift)
        recorded[-1] = self._samples(self.plain, drift) if drift else self.loopback
        return recorded

    def _samples(self, spectrum: NDArray[np.complex128], drift: float) -> FloatArray:
        if drift:
            return evaluate_stretched(spectrum, self.n_fft, self.n_samples, drift)
        fft: Any = import_module("scipy.fft")
        return fft.irfft(spectrum, self.n_fft)[: self.n_samples]


GUARD = 4096
"""Room for the ringing of a fractional delay, so that it does not wrap round."""


def _open(config: SessionConfig, around: InterfaceSurroundings) -> SimulatedInterface:
    if around.world is None or config.simulation is None:
        raise InterfaceError(
            "the simulated interface needs a simulated world; "
            "choose a room and a simulation section, or another --interface"
        )
    return SimulatedInterface(
        around.world,
        config.simulation,
        sample_rate=config.sample_rate,
        seed=config.seed,
        n_microphones=len(config.channels.microphones),
        level=10 ** (config.sweep.amplitude_dbfs / 20) / np.sqrt(2),
    )


INTERFACES.add("simulated")(
    InterfaceKind("computes what a room would answer; makes no sound", _open)
)
