"""The compensated curve of one response and the times and ratios read from it."""

import math
from dataclasses import dataclass

import numpy as np

from analysis.decay import words
from analysis.decay.answer import (
    CROSSING,
    CURVATURE,
    EDT,
    LATE,
    NOISE,
    RANGE,
    T20,
    T30,
    XI20,
    Answer,
)
from analysis.decay.curve import close_curve, energy_after, fit_lines, step_at
from analysis.decay.model import NOTHING, tail_after
from analysis.decay.noise import NoiseFit
from analysis.decay.trust import Swings, is_doubtful, level_error
from rir.arrays import FloatArray

__all__ = ["DecayCurve", "read_ratio", "read_times"]

FITS = ((0.0, 10.0), (5.0, 25.0), (5.0, 35.0))
"""Ranges of the lines of EDT, T20 and T30 [dB] (ISO 3382-1, 3.2 and A.2.2)."""
LIMITS = np.array(FITS)
POINTS = 2048
"""Points of the curve; short decays have one per sample."""
MARGIN = 3.0
"""How far below a line's end the crossing must lie on the curve [dB]."""
SHORTEST_EARLY = 0.015
"""An EDT below this, of a longer decay, only measures the direct sound [s]."""
SAFE_RANGE = 55.0
"""With more range than this, swings of the noise do not reach the lines [dB]."""
MOST_DOUBT = 0.02
"""Standard deviation by the noise's swings above which a time is refused [1]."""
LOW_RANGE = 45.0
"""Less range than this is flagged: T30 and 10 dB (ISO 3382-1, 5.3.2) [dB]."""
LEAST_RANGE = 10.0
"""With less range than this nothing is said [dB]."""


@dataclass(frozen=True)
class DecayCurve:
    """Energy left after each moment, freed from noise, closed behind the crossing."""

    energy: FloatArray
    onset: int
    start: int
    stop: int
    end: int
    noise: float
    tail: float
    values: FloatArray
    steps: int
    width: int
    first: float
    fit: NoiseFit

    @classmethod
    def of(
        cls,
        energy: FloatArray,
        onset: int,
        start: int,
        stop: int,
        fit: NoiseFit,
        points: int = POINTS,
        theta: FloatArray | None = None,
    ) -> "DecayCurve":
        """Return the curve from `start`, by a fit whose time 0 is `onset`."""
        theta = fit.theta if theta is None else theta
        values = np.empty(2 * points + 2)
        end, noise, tail, steps, width, first = close_curve(
            energy, onset, start, stop, theta, fit.width, points, values
        )
        return cls(
            energy,
            onset,
            start,
            stop,
            end,
            noise,
            tail,
            values,
            steps,
            width,
            first,
            fit,
        )

    @property
    def total(self) -> float:
        """Energy of the whole decay."""
        return float(self.values[0])

    @property
    def floor(self) -> float:
        """Level of the curve at the crossing [dB]."""
        if self.end - self.start < 4 or not 0.0 < self.tail < self.total:
            return 0.0
        return 10.0 * math.log10(self.tail / self.total)

    @property
    def late_rate(self) -> float:
        """Decay of the energy at the end, per sample."""
        slow = 2 if self.fit.theta[3] == NOTHING else 4
        return math.exp(self.fit.theta[slow]) / self.fit.width

    def after(self, sample: int, onset: int) -> float:
        """Return the energy from a sample on, by the model behind the crossing."""
        if sample < self.end:
            return energy_after(
                self.energy, self.start, sample, self.noise, self.values, self.width
            )
        block = self.fit.width
        return tail_after(self.fit.theta, (sample - onset) / block) * block

    def centre(self, onset: int) -> float:
        """Return the centre time, counted from the onset [samples]."""
        first = self.first + self.tail * (self.end - self.start + 1.0 / self.late_rate)
        return first / self.total + self.start - onset


def read_times(
    curve: DecayCurve,
    rate: float,
    answer: Answer,
    skipped: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Fill EDT, T20, T30, the quality of their lines, and facts of the curve.

    `skipped` samples at the start are left out of EDT's line, and of the others'.
    """
    floor = curve.floor
    answer.facts[RANGE], answer.facts[NOISE] = -floor, curve.noise
    answer.facts[CROSSING] = (curve.end - curve.start) / rate
    answer.facts[LATE] = 6.0 * math.log(10.0) / curve.late_rate / rate
    if floor > -LOW_RANGE:
        answer.flag(words.LOW_RANGE)
    lines = np.empty((3, 5))
    begin, later = (math.ceil(count / curve.width) for count in skipped)
    fit_lines(curve.values, begin, later, curve.steps, curve.width, LIMITS, lines)
    doubts = Doubts(curve, begin, later) if floor > -SAFE_RANGE else None
    for place, (upper, lower) in enumerate(FITS):
        line = lines[place]
        if floor > -lower - MARGIN:
            answer.reasons[place] = words.RANGE_SHORT
            continue
        answer.reasons[place] = _judge(place, line, lower - upper)
        if doubts and not answer.reasons[place] and doubts.spoil(place, line):
            answer.reasons[place] = words.NOISE_SWINGS
            answer.flag(words.UNSTEADY_NOISE)
        if not answer.reasons[place]:
            answer.values[place] = -60.0 / line[0] / rate
            if place != EDT:
                answer.facts[XI20 + place - T20] = 1000.0 * (1.0 - line[1] ** 2)
    early = answer.values[EDT]
    if early < SHORTEST_EARLY and 5.0 * early < answer.facts[LATE]:
        answer.values[EDT] = np.nan
        answer.reasons[EDT] = words.NO_POINTS
    _read_curvature(answer)


class Doubts:
    """How far swings of the noise may bend the lines of a curve."""

    def __init__(self, curve: DecayCurve, begin: int, later: int) -> None:
        self.curve, self.begin, self.later = curve, begin, later
        self.swings = Swings.of(curve.fit, curve.end - curve.onset)
        self.rival = self._rival() if is_doubtful(curve.fit, self.swings) else None

    def spoil(self, place: int, line: FloatArray) -> bool:
        """Return whether a line's slope is doubtful by more than may be."""
        curve, (upper, lower) = self.curve, FITS[place]
        left = curve.total * 10.0 ** (-0.1 * lower)
        step = step_at(curve.values, curve.steps, left)
        stretch = max(curve.end - curve.start - step * curve.width, 0)
        error = level_error(left, stretch, curve.noise, curve.tail, self.swings)
        if error > MOST_DOUBT * (lower - upper):
            return True
        if self.rival is None:
            return False
        other = self.rival[place, 0]
        return not abs(other / line[0] - 1.0) < MOST_DOUBT

    def _rival(self) -> FloatArray:
        """Return the lines if the second slope were noise."""
        curve = self.curve
        other = DecayCurve.of(
            curve.energy,
            curve.onset,
            curve.start,
            curve.stop,
            curve.fit,
            theta=curve.fit.without_second(),
        )
        lines = np.zeros((3, 5))
        if other.total > 0.0:
            fit_lines(
                other.values,
                self.begin,
                self.later,
                other.steps,
                other.width,
                LIMITS,
                lines,
            )
        return lines


def _judge(place: int, line: FloatArray, span: float) -> int:
    if line[4] < 4 or line[2] < 0.3:
        return words.NO_POINTS
    if line[3] > 0.5 * span:
        return words.PULSES
    return words.NOT_STRAIGHT if line[1] > (-0.3 if place == EDT else -0.8) else 0


def _read_curvature(answer: Answer) -> None:
    t20, t30 = answer.values[T20], answer.values[T30]
    if t20 > 0.0 and t30 > 0.0:
        curvature = 100.0 * (t30 / t20 - 1.0)
        answer.facts[CURVATURE] = curvature
        if abs(curvature) > 10.0:
            answer.flag(words.CURVED)


def read_ratio(
    total: float, late: float, tail: float, place: int, answer: Answer
) -> None:
    """Fill 10 lg(early/late) if the late energy stands clear of the noise."""
    if late < 0.9 * tail:
        answer.reasons[place] = words.LATE_BURIED
    elif not 0.0 < late < total:
        answer.reasons[place] = words.NO_LATE
    else:
        answer.values[place] = 10.0 * math.log10((total - late) / late)
