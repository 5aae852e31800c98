"""One response, from samples to parameters."""

import numpy as np

from analysis.decay import words
from analysis.decay.answer import C50, C80, D50, DRR, EDT, ONSET, TS, Answer, Answers
from analysis.decay.curve import direct_end, soften
from analysis.decay.drift import drift_of, may_drift
from analysis.decay.lines import LEAST_RANGE, DecayCurve, read_ratio, read_times
from analysis.decay.model import level_at
from analysis.decay.noise import LEAST_BLOCKS, NoiseFit, fit_decay
from analysis.decay.scan import find_first, inspect, largest, locate, skip_click, square
from rir.arrays import FloatArray

__all__ = ["analyse_responses", "prepare", "sample_at"]

FEW_PULSES = 16
"""Fewer samples than this are pulses, not a decay."""
DIRECT_REACH = 0.0025
"""The direct sound lasts this long behind its peak [s]."""
SPLITS = ((C50, 0.05), (C80, 0.08))
"""Place and time of the early-to-late splits [s] (ISO 3382-1, A.2.3)."""


def sample_at(time: float, rate: float) -> int:
    """Return the sample nearest to a time."""
    return int(time * rate + 0.5)


def analyse_responses(rows: FloatArray, rate: float, answers: Answers) -> None:
    """Fill the answers on every response of (rows, n)."""
    energy = np.empty(rows.shape[-1])
    for index, samples in enumerate(rows):
        analyse_response(samples, rate, energy, answers.row(index))


def analyse_response(
    samples: FloatArray, rate: float, energy: FloatArray, answer: Answer
) -> None:
    """Fill the answer on one response; `energy` is room for its squares."""
    if prepare(samples, energy, answer) is None:
        return
    onset, stop, pulses = locate(energy)
    if pulses < FEW_PULSES and (pulses == 1 or stop - onset >= 2 * pulses):
        _read_pulses(energy[onset:stop], rate, pulses, answer)
        return
    onset, fit = find_decay(energy, onset, stop, rate, answer)
    answer.facts[ONSET] = onset / rate
    if not fit.decays:
        reason = words.SHORT_RECORD if fit.count < LEAST_BLOCKS else words.UNDER_NOISE
        answer.refuse(reason, words.NO_DECAY)
        return
    soften_events(energy, onset, stop, fit, answer)
    curve = DecayCurve.of(energy, onset, onset, stop, fit)
    if curve.floor > -LEAST_RANGE:
        answer.refuse(words.RANGE_SHORT, words.LOW_RANGE)
        return
    read_times(curve, rate, answer)
    _read_energies(curve, onset, stop, rate, answer)


def prepare(
    samples: FloatArray, energy: FloatArray, answer: Answer
) -> tuple[FloatArray, float, float] | None:
    """Fill `energy` with squares re the peak, offset removed.

    Returns samples without drift, offset and peak, or None if there is nothing to
    analyse.
    """
    finite, low, high, clipped, offset = inspect(samples)
    if not finite:
        answer.refuse(words.NOT_FINITE, words.NON_FINITE)
        return None
    if low == 0.0 and high == 0.0:
        answer.refuse(words.ALL_ZERO, words.SILENT)
        return None
    if clipped:
        answer.flag(words.CLIPPED)
    if may_drift(samples):
        drift = drift_of(samples)
        if drift is not None:
            answer.flag(words.DC_OFFSET)
            samples = samples - drift
            low, high, offset = float(samples.min()), float(samples.max()), 0.0
    peak = max(high - offset, offset - low)
    if offset != 0.0:
        answer.flag(words.DC_OFFSET)
        if peak <= 1e-9 * max(high, -low):
            answer.refuse(words.ALL_CONSTANT, words.SILENT)
            return None
    square(samples, offset, peak, energy)
    return samples, offset, peak


def find_decay(
    energy: FloatArray, onset: int, stop: int, rate: float, answer: Answer
) -> tuple[int, NoiseFit]:
    """Return the direct sound, corrected by the noise and for clicks, and the fit."""
    fit = fit_decay(energy, onset, stop)
    level = min(max(0.01, 30.0 * fit.noise_level), 0.25)
    moved = find_first(energy, 0, level)
    for _ in range(4):
        behind = skip_click(energy, moved, stop, rate, fit.noise_level, level)
        if behind == moved:
            break
        moved = behind
        answer.flag(words.EARLY_CLICK)
    if moved != onset:
        fit = fit_decay(energy, moved, stop)
    return moved, fit


def soften_events(
    energy: FloatArray, onset: int, stop: int, fit: NoiseFit, answer: Answer
) -> None:
    """Bring foreign events down to the fitted decay, and flag them."""
    beyond = onset + fit.count * fit.width
    usual = fit.noise_level + level_at(fit.theta, float(fit.count))
    if beyond < 0.9 * stop and largest(energy, beyond, stop) > 70.0 * usual:
        answer.flag(words.TAIL_EVENT)
    for k in np.flatnonzero(~fit.used[: fit.count]):
        answer.flag(words.TAIL_EVENT)
        start = onset + int(k) * fit.width
        if k >= fit.first:
            wanted = level_at(fit.theta, k + 0.5) + fit.noise_level
        else:
            wanted = float(fit.means[k - 1])
        soften(energy, start, min(start + fit.width, stop), wanted)


def _read_energies(
    curve: DecayCurve, onset: int, stop: int, rate: float, answer: Answer
) -> None:
    total = curve.total
    for place, time in SPLITS:
        late = curve.after(onset + sample_at(time, rate), onset)
        read_ratio(total, late, curve.tail, place, answer)
        if place == C50:
            answer.values[D50] = min(max(1.0 - late / total, 0.0), 1.0)
    end = direct_end(curve.energy, onset, stop, sample_at(DIRECT_REACH, rate))
    read_ratio(total, curve.after(end, onset), curve.tail, DRR, answer)
    answer.values[TS] = curve.centre(onset) / rate


def _read_pulses(energy: FloatArray, rate: float, pulses: int, answer: Answer) -> None:
    """Fill the energy parameters of single pulses; their times have no meaning."""
    if pulses == 1:
        answer.refuse(words.ONE_PULSE, words.NO_DECAY)
        return
    answer.flag(words.NO_DECAY)
    answer.reasons[EDT : EDT + 3] = words.PULSES
    total = float(energy.sum())
    splits = dict(SPLITS) | {DRR: DIRECT_REACH + 1.0 / rate}
    for place, time in splits.items():
        late = float(energy[sample_at(time, rate) :].sum())
        read_ratio(total, late, 0.0, place, answer)
        if place == C50:
            answer.values[D50] = 1.0 - late / total
    answer.values[TS] = float(energy @ np.arange(len(energy))) / total / rate
