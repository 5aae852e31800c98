"""Where the decay meets the noise: one response's decay and noise, fitted."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.decay import blocks
from analysis.decay.model import NOTHING, PARAMETERS, improve, level_at

__all__ = ["NoiseFit", "fit_decay"]

FloatArray = NDArray[np.float64]

BLOCKS = 96
"""Blocks of the window that holds the decay and as much noise again."""
MOST_EVENTS = 6
"""More outlying blocks than this are a pattern (flutter), not events."""
WITH_NOISE, WITHOUT_NOISE = np.arange(3), np.arange(1, 3)


@dataclass
class NoiseFit:
    """Decays and noise fitted to block energies; times in blocks of `width` samples.

    Parameters
    ----------
    count : int
        Number of blocks.
    """

    count: int
    width: int = 1
    first: int = 1
    noise: float = 0.0
    knee: int = 0
    decays: bool = False
    patterned: bool = False
    means: FloatArray = field(init=False)
    ratio: FloatArray = field(init=False)
    used: NDArray[np.bool_] = field(init=False)
    theta: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.means = np.empty(max(self.count, 8))
        self.ratio = np.zeros(max(self.count, 8))
        self.used = np.ones(max(self.count, 8), dtype=np.bool_)
        self.theta = np.full(PARAMETERS, NOTHING)

    @property
    def events(self) -> int:
        """Number of blocks left out because something else sounds in them."""
        return int(np.count_nonzero(~self.used[: self.count]))

    @property
    def noise_level(self) -> float:
        """Mean square of the noise."""
        return math.exp(self.theta[0]) if self.decays else self.noise

    def run(self, energy: FloatArray, start: int, stop: int) -> bool:
        """Fit; return False if the blocks are too narrow for what is in them."""
        self.width, self.knee, self.noise = blocks.zoom(
            energy, start, stop, self.count, self.means
        )
        if self.count > 8 and blocks.empty_blocks(self.means, self.count) > 1:
            return False
        self._trim_end()
        self.first = blocks.first_block(self.means, self.knee, self.noise)
        self.decays = blocks.guess(
            self.means, self.first, self.knee, self.noise, self.theta
        )
        if self.decays:
            blocks.mark_isolated(self.means, self.used, self.first, self.count)
            self._fit()
        return self.events <= MOST_EVENTS or self.count <= 16

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
        spread = self._judge()
        if self._mark(spread):
            best = self._improve(self.theta, free)
            spread = self._judge()
        if self.patterned and self.count - self.first >= 20:
            self._add_slope(free[0], spread, best)
            if self.theta[3] > NOTHING:
                free = np.arange(free[0], PARAMETERS)
                self.used[self.first : self.count] = True
                spread = self._judge()
        for _ in range(2):
            if not self._mark(spread):
                break
            self._improve(self.theta, free)
            spread = self._judge()

    def _improve(self, theta: FloatArray, free: NDArray[np.int64]) -> float:
        return improve(theta, self.means, self.used, self.first, self.count, free)

    def _judge(self) -> float:
        spread, self.patterned = blocks.residuals(
            self.theta,
            self.means,
            self.used,
            self.first,
            self.count,
            self.width,
            self.ratio,
        )
        return spread

    def _mark(self, spread: float) -> int:
        return blocks.mark_events(self.ratio, self.used, self.first, self.count, spread)

    def _drop_noise(self, best: float) -> tuple[NDArray[np.int64], float]:
        """Leave the noise out where the blocks do not ask for it."""
        if level_at(self.theta, float(self.count)) < 0.2 * math.exp(self.theta[0]):
            return WITH_NOISE, best
        trial = self.theta.copy()
        trial[0] = NOTHING
        value = self._improve(trial, WITHOUT_NOISE)
        if value > best + 8.0 / self.width:
            return WITH_NOISE, best
        self.theta = trial
        return WITHOUT_NOISE, value

    def _add_slope(self, lowest: int, spread: float, best: float) -> None:
        """Add a second decay where it explains the blocks clearly better."""
        theta, free = self.theta, np.arange(lowest, PARAMETERS)
        end = level_at(theta, float(self.count)) + math.exp(theta[0])
        kept, chosen = theta, best
        for ratio in (2.5, 6.0):
            trial = theta.copy()
            trial[2] = theta[2] + 0.1
            trial[4] = theta[2] - math.log(ratio)
            trial[3] = math.log(0.5 * end) + math.exp(trial[4]) * 0.5 * self.count
            trial[0] = theta[0] + math.log(0.7)
            value = self._improve(trial, free)
            if trial[4] > trial[2]:
                trial[[1, 2, 3, 4]] = trial[[3, 4, 1, 2]]
            seen = math.exp(trial[4]) * (self.count - self.first) > 1.0
            apart = trial[2] - trial[4] > 0.25
            if seen and apart and value < chosen - 15.0 * spread * spread:
                kept, chosen = trial, value
        self.theta = kept


def fit_decay(energy: FloatArray, start: int, stop: int) -> NoiseFit:
    """Fit decays and noise to squared samples from the direct sound on.

    Blocks are widened until they are neither empty nor alternate, as those of a
    flutter echo do.
    """
    count = min(BLOCKS, (stop - start) // 2)
    fit = NoiseFit(count)
    while count >= 8:
        fit = NoiseFit(count)
        if fit.run(energy, start, stop):
            return fit
        count = count // 2 if count > 8 else 0
        count = max(count, 8) if count else 0
    fit.decays = False
    return fit
