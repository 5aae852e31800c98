"""Where the decay meets the noise: one response's decay and noise, fitted."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.decay import blocks
from analysis.decay.model import NOTHING, PARAMETERS, crossing, improve, level_at
from rir.arrays import FloatArray

__all__ = ["NoiseFit", "fit_decay"]

BLOCKS = 96
"""Blocks of the window that holds the decay and as much noise again."""
MOST_EVENTS = 6
"""More outlying blocks than this are a pattern (flutter), not events."""
FEW_PULSES = 3
"""So many falling outliers within the decay are its own."""
CLEAR_GAIN = 10.0
"""Gain in deviance, in units of its scatter, that a second slope must bring."""
MOST_BEYOND = 3.0
"""Blocks behind the window so many times over a decay without noise show noise."""
LEAST_BLOCKS = 8
"""Fewer blocks than this cannot be fitted."""
FEW_BLOCKS = 14
"""To have this many, blocks of a narrow band may hold fewer degrees of freedom."""
LEAST_FREEDOM = 8.0
"""Degrees of freedom that a block of a narrow band must hold."""
WITH_NOISE, WITHOUT_NOISE = np.arange(3), np.arange(1, 3)


@dataclass
class NoiseFit:
    """Decays and noise fitted to block energies; times in blocks of `width` samples."""

    count: int
    """Number of blocks."""
    density: float = 1.0
    """Degrees of freedom of the squares per sample: 1 of a white response."""
    width: int = 1
    first: int = 1
    noise: float = 0.0
    knee: int = 0
    decays: bool = False
    wide_width: int = 1
    wide_count: int = 0
    means: FloatArray = field(init=False)
    wide: FloatArray = field(init=False)
    ratio: FloatArray = field(init=False)
    used: NDArray[np.bool_] = field(init=False)
    theta: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        rows = np.zeros((3, max(self.count, LEAST_BLOCKS)))
        self.means, self.wide, self.ratio = rows
        self.used = np.ones(max(self.count, LEAST_BLOCKS), dtype=np.bool_)
        self.theta = np.full(PARAMETERS, NOTHING)

    @property
    def narrowest(self) -> float:
        """Samples that a block must hold at least."""
        return narrowest_block(self.density)

    @property
    def events(self) -> int:
        """Number of blocks left out because something else sounds in them."""
        return int(np.count_nonzero(~self.used[: self.count]))

    @property
    def noise_level(self) -> float:
        """Mean square of the noise."""
        return math.exp(self.theta[0]) if self.decays else self.noise

    def without_second(self) -> FloatArray:
        """Return the fit if what falls slower than the first decay were noise."""
        theta = self.theta.copy()
        slow = math.exp(theta[3] - math.exp(theta[4]) * 0.5 * self.count)
        theta[0] = math.log(math.exp(theta[0]) + slow)
        theta[3:] = NOTHING
        self._improve(theta, WITH_NOISE)
        return theta

    def run(
        self, energy: FloatArray, start: int, stop: int, *, whole: bool = False
    ) -> bool:
        """Fit; return False if the blocks are too narrow for what is in them.

        The blocks zoom in on the decay, or cover the whole response.
        """
        least = float(stop) if whole else self.narrowest
        self.width, self.knee, self.noise, empty = blocks.zoom(
            energy, start, stop, self.count, least, self.means, self.wide
        )
        self.wide_width = max((stop - start) // self.count, 1)
        self.wide_count = self.count
        if self.count > LEAST_BLOCKS and empty > 1:
            return False
        self._trim_end()
        self.first, self.decays = blocks.begin(
            self.means, self.used, self.count, self.knee, self.noise, self.theta
        )
        if self.decays:
            self._fit()
        return self.count <= 16 or not (self.events > MOST_EVENTS or self._flutters())

    def _flutters(self) -> bool:
        """Return whether the outliers in the decay are a train of falling pulses."""
        if not self.decays or self.events < FEW_PULSES:
            return False
        end = int(crossing(self.theta, float(self.count)))
        out = np.flatnonzero(~self.used[:end])
        runs = np.split(out, np.flatnonzero(np.diff(out) > 1) + 1)
        peaks = np.array([self.means[run].max() for run in runs if len(run)])
        return len(peaks) >= FEW_PULSES and bool(np.all(np.diff(peaks) < 0.0))

    def _trim_end(self) -> None:
        means = self.means
        while self.knee >= self.count - 2 and self.count > 12:
            if means[self.count - 1] >= 0.1 * self.noise:
                break
            self.count -= 1
        if self.noise <= 0.0:
            self.noise = 1e-3 * float(means[means > 0.0].min(initial=1e-27))
        self.knee = min(self.knee, self.count)

    def _fit(self) -> None:
        free, best = self._drop_noise(self._improve(self.theta, WITH_NOISE))
        spread, patterned, found = self._judge()
        for _ in range(2):
            if found:
                best = self._improve(self.theta, free)
                spread, patterned, found = self._judge()
        if patterned and self.count - self.first >= 20:
            self._add_slope(free[0], spread, best)
            if self.theta[3] > NOTHING:
                free = np.arange(int(self.theta[0] == NOTHING), PARAMETERS)
                self.used[self.first : self.count] = True
                found = self._judge()[2]
        for _ in range(2):
            if found:
                self._improve(self.theta, free)
                found = self._judge()[2]

    def _improve(self, theta: FloatArray, free: NDArray[np.int64]) -> float:
        return improve(theta, self.means, self.used, self.first, self.count, free)

    def _judge(self) -> tuple[float, bool, int]:
        return blocks.judge(
            self.theta,
            self.means,
            self.used,
            self.first,
            self.count,
            self.width * self.density,
            self.ratio,
        )

    def holds_on(self) -> bool:
        """Return whether a decay that goes on behind the window is heard there."""
        if not self.decays or self.wide_width == self.width:
            return True
        end = level_at(self.theta, float(self.count))
        return end <= self.noise_level or self._reaches_on(self.theta)

    def _reaches_on(self, theta: FloatArray) -> bool:
        """Return whether decays without noise hold behind the window as well."""
        first = math.ceil(self.count * self.width / self.wide_width)
        beyond = self.wide[first : self.wide_count]
        if len(beyond) < 3:
            return True
        middle = 0.5 * (first + self.wide_count) * self.wide_width / self.width
        return float(np.median(beyond)) < MOST_BEYOND * level_at(theta, middle)

    def _drop_noise(self, best: float) -> tuple[NDArray[np.int64], float]:
        """Leave the noise out where the blocks do not ask for it."""
        if level_at(self.theta, float(self.count)) < 0.2 * math.exp(self.theta[0]):
            return WITH_NOISE, best
        trial = self.theta.copy()
        trial[0] = NOTHING
        value = self._improve(trial, WITHOUT_NOISE)
        worse = value > best + 8.0 / (self.width * self.density)
        if worse or not self._reaches_on(trial):
            return WITH_NOISE, best
        self.theta = trial
        return WITHOUT_NOISE, value

    def _two_slopes(self) -> list[FloatArray]:
        """Return first guesses: the decay found and a slower, or a faster one."""
        theta = self.theta
        end = level_at(theta, float(self.count)) + math.exp(theta[0])
        guesses = []
        for ratio in (2.5, 6.0):
            trial = theta.copy()
            trial[2] = theta[2] + 0.1
            trial[4] = theta[2] - math.log(ratio)
            trial[3] = math.log(0.5 * end) + math.exp(trial[4]) * 0.5 * self.count
            trial[0] = theta[0] + math.log(0.7)
            guesses.append(trial)
        trial = theta.copy()
        trial[3:] = theta[1:3]
        trial[2] = theta[2] + math.log(3.0)
        start = math.log(self.means[self.first] + 1e-300)
        trial[1] = start + math.exp(trial[2]) * (self.first + 0.5)
        return [*guesses, trial]

    def _add_slope(self, lowest: int, spread: float, best: float) -> None:
        """Add a second decay where it explains the blocks clearly better."""
        free = np.arange(lowest, PARAMETERS)
        kept, chosen = self.theta, best
        # Slow swings of coloured noise look like a slope: ask for more there.
        steps = np.abs(np.diff(self.ratio[self.first : self.count]))
        scatter = (1.4826 * float(np.median(steps))) ** 2 / 2.0
        colour = 0.5 * scatter * self.width * self.density
        needed = CLEAR_GAIN * spread * spread * max(colour, 1.0)
        for trial in self._two_slopes():
            value = self._improve(trial, free)
            if trial[4] > trial[2]:
                trial[[1, 2, 3, 4]] = trial[[3, 4, 1, 2]]
            seen = math.exp(trial[4]) * (self.count - self.first) > 1.0
            apart = trial[2] - trial[4] > 0.25
            if seen and apart and value < chosen - needed:
                kept, chosen = trial, value
        if kept is not self.theta and lowest == 0:
            kept = self._drop_noise_of(kept, chosen)
        self.theta = kept

    def _drop_noise_of(self, theta: FloatArray, best: float) -> FloatArray:
        """Leave the noise out of two slopes where the blocks do not ask for it."""
        if level_at(theta, float(self.count)) < 0.2 * math.exp(theta[0]):
            return theta
        trial = theta.copy()
        trial[0] = NOTHING
        value = self._improve(trial, np.arange(1, PARAMETERS))
        worse = value > best + 8.0 / (self.width * self.density)
        return theta if worse or not self._reaches_on(trial) else trial


def narrowest_block(density: float) -> float:
    """Return how many samples a block must hold at least."""
    return 2.0 if density == 1.0 else LEAST_FREEDOM / density


def fit_decay(
    energy: FloatArray, start: int, stop: int, density: float = 1.0
) -> NoiseFit:
    """Fit decays and noise to squared samples from the direct sound on.

    Blocks are widened until they are neither empty nor alternate, as those of a
    flutter echo do.
    """
    count = int((stop - start) / narrowest_block(density))
    if count < FEW_BLOCKS:
        count = min(FEW_BLOCKS, int((stop - start) * density / 3.0))
    count = min(BLOCKS, count)
    fit = NoiseFit(count, density)
    while count >= LEAST_BLOCKS:
        if fit.run(energy, start, stop):
            return fit if fit.holds_on() else _fit_whole(fit, energy, start, stop)
        count = max(count // 2, LEAST_BLOCKS) if count > LEAST_BLOCKS else 0
        fit = NoiseFit(count, density)
    return fit


def _fit_whole(zoomed: NoiseFit, energy: FloatArray, start: int, stop: int) -> NoiseFit:
    """Fit the whole response where what follows the window contradicts it."""
    fit = NoiseFit(zoomed.wide_count, zoomed.density)
    return fit if fit.run(energy, start, stop, whole=True) else zoomed
