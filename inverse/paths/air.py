"""One speed of sound for every recording block.

Air that warms by half a kelvin between takes stretches all arrival times by 0.9 parts
in a thousand, more than 3 mm at the ends do after some metres. Rows are therefore
brought to one air before anything is fitted to them together: first by the logged
temperatures, then by what the fitted room says of each block.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.physics import speed_of_sound

__all__ = [
    "BlockAir",
    "at_one_temperature",
    "logged_temperature",
    "read_block_air",
    "speed_at",
    "stretched",
]

TAPS = 32
"""To each side of an interpolated sample: a windowed sinc flat to 0.9 of Nyquist."""
TEMPERATURES_C = (-40.0, 60.0)  # of rooms, cold stores and lofts included
A_KELVIN = 0.00173  # part of the speed of sound that a kelvin changes, near 20 degrees
LOGGED_SD, GUESSED_SD = 0.3 * A_KELVIN, 2.0 * A_KELVIN
"""Of a block's air: a good thermometer's, and a heated room's over a day (0063)."""
EDGES_HZ, TURNS = (1500.0, 5000.0), 3
"""Low-pass of a first and a finer reading, and steps of each: low sound tells large
changes without taking one wave for the next."""
LEAST_ROWS = 4  # of a block, for a scatter over rows
CLEAR = 3.0
"""Standard deviations by which one block at least must differ from no change."""


@dataclass(frozen=True, eq=False)
class BlockAir:
    """Hold how much faster sound was in each recording block than on average."""

    numbers: NDArray[np.int64]
    """Numbers of the blocks, ascending. Shape (blocks,)."""
    changes: FloatArray
    """Part of the mean speed of sound, beyond what logged temperatures tell. Shape
    (blocks,)."""
    sds: FloatArray
    """Their standard deviations. Shape (blocks,)."""

    @property
    def differs(self) -> bool:
        """Whether any block clearly differs from the mean."""
        return bool((np.abs(self.changes) > CLEAR * self.sds).any())

    def even(self, rows: FitSet, latency_s: float) -> FitSet:
        """Return rows as they would have been recorded in mean air."""
        changes = self.changes[np.searchsorted(self.numbers, rows.blocks)]
        return _brought(rows, 1 + changes, latency_s)


def at_one_temperature(rows: FitSet, latency_s: float = 0.0) -> FitSet:
    """Return rows brought to the mean of their logged temperatures.

    Rows without a temperature, and sets of one temperature, stay as they are.
    """
    if rows.temperatures is None:
        return rows
    known = np.isfinite(rows.temperatures)
    if not known.any() or np.ptp(rows.temperatures[known]) < 1e-3:
        return rows
    mean = float(rows.temperatures[known].mean())
    filled = np.where(known, rows.temperatures, mean)
    speeds = np.array([speed_of_sound(celsius) for celsius in filled])
    mean_speed = speed_of_sound(mean)
    rows = replace(rows, speed_of_sound=mean_speed)
    return _brought(rows, speeds / mean_speed, latency_s)


def logged_temperature(rows: FitSet) -> dict[str, float]:
    """Return the mean of the logged temperatures, degrees Celsius; none if unknown."""
    if rows.temperatures is None:
        return {}
    known = rows.temperatures[np.isfinite(rows.temperatures)]
    return {"temperature_c": float(known.mean())} if len(known) else {}


def read_block_air(
    rows: FitSet,
    predicted: FloatArray,
    latency_s: float,
    *,
    even: BlockAir | None = None,
) -> BlockAir:
    """Return each block's speed of sound over the mean.

    Parameters
    ----------
    rows : FitSet
        Measured rows, as far as paths are listed.
    predicted : ndarray, shape (rows, n_samples)
        What the room answers for them in mean air.
    latency_s : float
        Instant that times are stretched about.
    even : BlockAir, optional
        What is known already; the result holds it.

    Notes
    -----
    In faster air a response h(t) becomes h(t + e t): a single number a block, whose
    slope is t h'(t). Its standard deviation is from the scatter over rows, since a
    pose that is off pulls a whole row one way.
    """
    numbers = np.unique(rows.blocks)
    start = np.zeros(len(numbers)) if even is None else even.changes
    found = BlockAir(numbers, start, np.full(len(numbers), GUESSED_SD))
    if len(numbers) < 2:
        return replace(found, changes=np.zeros(len(numbers)))
    known = rows.temperatures is not None and np.isfinite(rows.temperatures).any()
    sigma = LOGGED_SD if known else GUESSED_SD
    for edge in EDGES_HZ:
        model, slope = _sloped(predicted, edge, rows.sample_rate, latency_s)
        for _ in range(TURNS):
            heard = _low(found.even(rows, latency_s).responses, edge, rows.sample_rate)
            found = _stepped(found, rows.blocks, heard - model, slope, sigma)
    return found


def speed_at(temperature_c: float) -> float:
    """Return the speed of sound at a temperature asked for, metres per second.

    Raises
    ------
    SignalError
        If it is no temperature of a room.
    """
    coldest, hottest = TEMPERATURES_C
    if not coldest <= temperature_c <= hottest:
        raise SignalError(
            f"air of {temperature_c} °C was asked for; rooms have {coldest:.0f} to "
            f"{hottest:.0f} °C: leave it out for the mean of the rows heard"
        )
    return speed_of_sound(temperature_c)


def stretched(
    responses: FloatArray, factor: float, latency_samples: float = 0.0
) -> FloatArray:
    """Return responses whose arrivals come `factor` times later.

    Parameters
    ----------
    responses : ndarray, shape (rows, n)
        Sampled sound.
    factor : float
        Near 1.
    latency_samples : float
        The instant that stays, samples.
    """
    n = responses.shape[1]
    at = latency_samples + (np.arange(n) - latency_samples) / factor
    first = np.floor(at).astype(np.int64)
    out = np.zeros_like(responses)
    padded = np.pad(responses, ((0, 0), (TAPS, TAPS)))
    for tap in range(1 - TAPS, TAPS + 1):
        place = first + tap
        gap = place - at
        weight = np.sinc(gap) * np.cos(0.5 * np.pi * gap / (TAPS + 1)) ** 2
        inside = (place >= -TAPS) & (place < n + TAPS)
        out += padded[:, np.clip(place + TAPS, 0, n + 2 * TAPS - 1)] * (weight * inside)
    return out


def _brought(rows: FitSet, factors: FloatArray, latency_s: float) -> FitSet:
    """Return rows recorded in air so many times as fast as the mean, in mean air."""
    responses = rows.responses.copy()
    latency = latency_s * rows.sample_rate
    for factor in np.unique(np.round(factors, 9)):
        mine = np.round(factors, 9) == factor
        if abs(factor - 1) > 1e-9:
            responses[mine] = stretched(rows.responses[mine], factor, latency)
    return replace(rows, responses=responses)


def _low(responses: FloatArray, edge: float, sample_rate: float) -> FloatArray:
    n = responses.shape[1]
    hertz = np.fft.rfftfreq(2 * n, 1 / sample_rate)
    gain = np.exp(-0.5 * (hertz / edge) ** 4)
    return np.fft.irfft(np.fft.rfft(responses, 2 * n) * gain, 2 * n)[:, :n]


def _sloped(
    predicted: FloatArray, edge: float, sample_rate: float, latency_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return a low part of responses and how it follows slower air."""
    low = _low(predicted, edge, sample_rate)
    times = np.arange(low.shape[1]) / sample_rate - latency_s
    return low, times * np.gradient(low, 1 / sample_rate, axis=1)


def _stepped(
    found: BlockAir,
    blocks: NDArray[np.int64],
    gap: FloatArray,
    slope: FloatArray,
    sigma: float,
) -> BlockAir:
    """Move every block's speed by what is left, towards no change by its prior."""
    power = np.maximum((slope**2).sum(axis=1), 1e-300)
    # loud rows are near ones, which say little of the air
    weight = 1 / (power + 0.1 * np.median(power))
    pull = weight * (slope * gap).sum(axis=1)
    weight = weight * power
    changes, sds = found.changes.copy(), found.sds.copy()
    for k, number in enumerate(found.numbers):
        mine = blocks == number
        if mine.sum() < LEAST_ROWS:
            continue
        total = weight[mine].sum()
        step = pull[mine].sum() / total
        apart = pull[mine] - weight[mine] * step
        spread = (apart**2).sum() * mine.sum() / (mine.sum() - 1) / total**2
        share = sigma**2 / (sigma**2 + spread)
        changes[k] = share * (changes[k] + step)
        sds[k] = np.sqrt(share * spread)
    held = np.array([(blocks == number).sum() for number in found.numbers])
    changes -= (held * changes).sum() / held.sum()
    return BlockAir(found.numbers, changes, sds)
