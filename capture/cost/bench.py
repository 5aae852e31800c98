"""One pair of a session, measured in any way, beside the truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks.finding import TakeLimits
from capture.checks.run import check_take
from capture.config import SessionConfig, SimulationConfig
from capture.cost.trials import CostTrial
from capture.devices.placement import PlacedWorld
from capture.devices.stage import build_world
from capture.interfaces import INTERFACES, InterfaceSurroundings
from capture.interfaces.loudspeaker import loudspeaker_gain
from capture.plan import build_plan
from capture.session.take_judge import TakeJudge
from capture.signal.reference import SweepReference, refer

__all__ = ["CostBench", "Outcome", "divide", "misalignment", "noise_ratio", "store"]

FloatArray = NDArray[np.float64]
LOWEST_HZ, HIGHEST_HZ = 125.0, 8000.0  # octaves in which rooms are judged
PEAK_DBFS = -9.0  # what `capture-pairs check` aims at


@dataclass(frozen=True)
class Outcome:
    """What a trial gave."""

    error: float
    """Misalignment inside the band of the trial."""
    noise: float
    """Noise over impulse in the worst octave, as the checks of a session find it."""
    cpu_s: float
    """Processor time of the dividing [s]."""


class CostBench:
    """The first pair of a session, its devices in place.

    Parameters
    ----------
    config : SessionConfig
        The session; all of it simulated.
    clock : callable
        Processor time [s].
    """

    def __init__(self, config: SessionConfig, clock: Callable[[], float]) -> None:
        self._config = config
        self._clock = clock
        self._world = PlacedWorld(build_world(config), config)
        move = build_plan(config).moves[0]
        self._world.place_emitter(move.emitter)
        self._world.place_listener(move.listener)
        simulation = config.simulation or SimulationConfig()
        self._truth = self._world.responses()[0]
        if simulation.loudspeaker_response:
            self._truth = _heard_through(self._truth, config.sample_rate)

    def run(self, trial: CostTrial, rng: np.random.Generator) -> Outcome:
        """Record the takes of a trial and deconvolve their mean."""
        judge = TakeJudge(trial.config)
        recorded = self._record(judge, trial, int(rng.integers(2**31)))
        samples = store(recorded, trial.word)
        begin = self._clock()
        grid = judge.grid(samples.shape[-1])
        reference = refer(grid, samples[-1].astype(float))
        response = divide(samples[0], reference, trial.word)
        spent = self._clock() - begin
        found = check_take(samples[:1], reference, None, None, TakeLimits())
        error = misalignment(
            response,
            np.pad(self._truth, (judge.pre, 0)),
            trial.config.sample_rate,
            trial.config.sweep.band_hz,
        )
        return Outcome(error, noise_ratio(found.figures["inr_db"]), spent)

    def _record(self, judge: TakeJudge, trial: CostTrial, seed: int) -> FloatArray:
        seeded = trial.config.model_copy(update={"seed": seed})
        interface = INTERFACES["simulated"].open(
            seeded, InterfaceSurroundings(self._world)
        )
        n = judge.signal.shape[-1]
        takes = [
            interface.play_record(judge.signal, n, label=f"cost_{number}").samples
            for number in range(trial.takes)
        ]
        interface.close()
        return np.mean(takes, axis=0)


def _heard_through(response: FloatArray, sample_rate: int) -> FloatArray:
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * response.size, real=True)
    gain = loudspeaker_gain(fft.rfftfreq(n, 1 / sample_rate))
    return fft.irfft(fft.rfft(response, n) * gain, n)[: response.size]


def store(samples: FloatArray, word: int) -> NDArray[Any]:
    """Return samples as a file or the arithmetic of a word length holds them.

    A converter's range is used as a person would: each channel peaks at -9 dBFS.

    Examples
    --------
    >>> kept = store(np.array([[1.0, 0.100001]]), 16)
    >>> bool(abs(kept - [[1.0, 0.100001]]).max() < 2**-14)
    True
    """
    if word > 24:
        return samples.astype(f"f{word // 8}")
    step = np.abs(samples).max(axis=-1, keepdims=True) / 10 ** (PEAK_DBFS / 20)
    step *= 2.0 ** (1 - word)
    return np.rint(samples / step) * step


def divide(samples: NDArray[Any], reference: SweepReference, word: int) -> FloatArray:
    """Deconvolve one channel with transforms of a word length, no checks made."""
    fft: Any = import_module("scipy.fft")
    grid = reference.excitation
    kind = np.complex64 if word == 32 else np.complex128
    spectrum = fft.rfft(samples - samples.mean(dtype=samples.dtype), grid.n)
    spectrum *= reference.reciprocal.astype(kind, copy=False)
    lags = fft.irfft(spectrum, grid.n, overwrite_x=True)
    first = lags[lags.size - grid.pre :]
    return np.concatenate((first, lags[: grid.length])).astype(float)


def misalignment(
    response: FloatArray,
    truth: FloatArray,
    sample_rate: float,
    band: tuple[float, float],
) -> float:
    """Return the norm of the difference over that of the truth, inside a band.

    One gain is taken out: a loudspeaker that bends plays a little louder or softer.

    Examples
    --------
    >>> truth = np.array([0.0, 1.0, 0.0, 0.0])
    >>> off = np.array([0.0, 3.0, 0.0, 0.03])
    >>> round(misalignment(off, truth, 48000, (100, 20000)), 2)
    0.01
    """
    n = 2 * max(response.size, truth.size)
    f = np.fft.rfftfreq(n, 1 / sample_rate)
    inside = (f >= band[0]) & (f <= band[1])
    wanted = np.fft.rfft(truth, n)[inside]
    heard = np.fft.rfft(response, n)[inside]
    gain = np.vdot(wanted, heard).real / np.vdot(wanted, wanted).real
    off = heard / gain - wanted
    return float(np.linalg.norm(off) / np.linalg.norm(wanted))


def noise_ratio(ranges_db: Mapping[str, list[float | None]]) -> float:
    """Return noise over impulse of the worst octave, as a ratio of amplitudes.

    Parameters
    ----------
    ranges_db : mapping
        Octave [Hz] -> impulse-to-noise ratio of each channel [dB].

    Examples
    --------
    >>> noise_ratio({"63": [10.0], "500": [40.0], "1000": [60.0]})
    0.01
    """
    known = [
        value
        for center, values in ranges_db.items()
        for value in values
        if LOWEST_HZ <= float(center) <= HIGHEST_HZ and value is not None
    ]
    return float(10 ** (-min(known) / 20)) if known else float("nan")
