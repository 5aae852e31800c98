"""Bands of several responses at once: one transform, narrow envelopes, gated splits."""

import math
from dataclasses import dataclass

import numpy as np

from analysis.decay import words
from analysis.decay.answer import (
    C50,
    C80,
    D50,
    DRR,
    EDT,
    LATE,
    ONSET,
    T20,
    T30,
    TS,
    Answer,
    Answers,
)
from analysis.decay.curve import direct_end
from analysis.decay.lines import LEAST_RANGE, DecayCurve, read_ratio, read_times
from analysis.decay.noise import fit_decay
from analysis.decay.response import DIRECT_REACH, find_decay, prepare, sample_at
from analysis.decay.scan import find_stop, largest, locate
from analysis.envelopes import EnvelopeLayout, band_envelopes, fast_length, transform
from analysis.gates import RINGING, Gates, gated_energies
from rir.arrays import FloatArray
from rir.bands import Band

__all__ = ["analyse_bands"]

SAFE_PRODUCT = 16.0
"""Below this bandwidth times reverberation time, times are doubtful and flagged."""
LEAST_PRODUCT = 12.5
"""Below this, found on a value that scatters itself, the filter decays slower."""
LEAD = 0.6
"""The band's energy is summed from this many 1/B before the direct sound."""
WINDOW_FLOOR = 3e-8
"""Below this share of the peak, an envelope shows the window's own ripple."""
CHUNK = 4
"""Responses transformed at once; more leave the cache."""
CURVE_POINTS = 640
"""Points of a band's curve; its own scatter is wider than their steps."""
CLEARANCE = 5.0
"""A band's late energy must exceed what lies behind the crossing so many times."""
LEAST_LATE = 1e-5
"""Less late than this share of the early energy drowns in the window's ripple."""
SPLIT_NAMES = (C50, C80, DRR)


@dataclass(frozen=True)
class Located:
    """A response from its direct sound to its end, or why there is none."""

    samples: FloatArray
    """From the direct sound on, offset removed, re the peak; empty if refused. Shape
    (n,)."""
    direct: int
    """End of the direct sound [samples]."""
    late_time: float
    """Reverberation time of the full band's end [s]."""
    answers: Answers
    """One row: the flags of the full band, and the reasons if refused."""


def analyse_bands(
    rows: FloatArray, rate: float, bands: tuple[Band, ...], answers: Answers
) -> None:
    """Fill the answers on every band of every response, bands last."""
    energy = np.empty(rows.shape[-1])
    for first in range(0, len(rows), CHUNK):
        located = [locate_response(row, rate, energy) for row in rows[first:][:CHUNK]]
        _copy_flags(located, first, len(bands), answers)
        known = [k for k, place in enumerate(located) if len(place.samples)]
        if known:
            targets = [
                [answers.row((first + k) * len(bands) + b) for b in range(len(bands))]
                for k in known
            ]
            analyse_chunk([located[k] for k in known], rate, bands, targets)


def locate_response(samples: FloatArray, rate: float, energy: FloatArray) -> Located:
    """Return a response from its direct sound on."""
    nothing = np.empty(0)
    answers = Answers.empty(1)
    answer = answers.row(0)
    scale = prepare(samples, energy, answer)
    if scale is None:
        return Located(nothing, 0, np.nan, answers)
    onset, stop, _pulses = locate(energy)
    onset, fit = find_decay(energy, onset, stop, rate, answer)
    answer.facts[ONSET] = onset / rate
    if not fit.decays:
        answer.refuse(words.UNDER_NOISE, words.NO_DECAY)
        return Located(nothing, 0, np.nan, answers)
    samples, offset, peak = scale
    kept = (samples[onset:stop] - offset) / peak
    direct = direct_end(energy, onset, stop, sample_at(DIRECT_REACH, rate)) - onset
    slow = fit.theta[2] if fit.theta[4] == -np.inf else fit.theta[4]
    late = 6.0 * math.log(10.0) / math.exp(slow) * fit.width / rate
    return Located(kept, direct, late, answers)


def _copy_flags(
    located: list[Located], first: int, n_bands: int, answers: Answers
) -> None:
    for k, place in enumerate(located):
        rows = slice((first + k) * n_bands, (first + k + 1) * n_bands)
        answers.flags[rows] = place.answers.flags[0]
        answers.reasons[rows] = place.answers.reasons[0]
        answers.facts[rows, ONSET] = place.answers.facts[0, ONSET]


def analyse_chunk(
    located: list[Located],
    rate: float,
    bands: tuple[Band, ...],
    targets: list[list[Answer]],
) -> None:
    """Fill the answers on the bands of a few located responses."""
    narrowest = min(band.width for band in bands)
    lead = int(RINGING / narrowest * rate) + 1
    longest = max(len(place.samples) for place in located)
    length = fast_length(longest + 6 * lead)
    layout = EnvelopeLayout(rate, lead, length)
    padded = np.zeros((len(located), length), dtype=np.float32)
    for row, place in zip(padded, located, strict=True):
        row[lead : lead + len(place.samples)] = place.samples
    spectra = transform(padded)
    gates = gated_energies(
        [place.samples for place in located],
        [place.direct for place in located],
        rate,
        bands,
    )
    for number, band in enumerate(bands):
        if band.upper > 0.5 * rate:
            for target in targets:
                target[number].refuse(words.BAND_OUTSIDE)
            continue
        envelopes = band_envelopes(spectra, band, layout)
        for row, place in enumerate(located):
            target = targets[row][number]
            curve = read_band(envelopes[row], place, band, layout, target)
            if curve is not None:
                read_splits(curve, gates, row, number, band, layout, target)


def read_band(
    energy: FloatArray,
    place: Located,
    band: Band,
    layout: EnvelopeLayout,
    answer: Answer,
) -> DecayCurve | None:
    """Fill times and centre time of one band of one response; return its curve."""
    slower = len(energy) / layout.length
    rate = layout.rate * slower
    exact = layout.lead * slower
    onset = int(exact + 0.5)
    lead = LEAD / band.width * rate
    stop = int((layout.lead + len(place.samples)) * slower - 0.5 * lead)
    stop = find_stop(energy[:stop], WINDOW_FLOOR * largest(energy, 0, stop))
    fit = fit_decay(energy, onset, stop, 2.0 * band.width / rate)
    if not fit.decays:
        answer.refuse(words.UNDER_NOISE, words.NO_DECAY)
        if place.late_time * band.width < SAFE_PRODUCT:
            answer.refuse(words.BANDWIDTH_SHORT, words.SHORT_BT)
        return None
    start = max(int(exact - lead), 0)
    curve = DecayCurve.of(energy, onset, start, stop, fit, CURVE_POINTS)
    if curve.floor > -LEAST_RANGE:
        answer.refuse(words.RANGE_SHORT, words.LOW_RANGE)
        return None
    skipped = (exact - curve.start, exact - curve.start + lead)
    read_times(curve, rate, answer, skipped)
    _refuse_short(band, answer)
    answer.values[TS] = (curve.centre(onset) + onset - exact) / rate
    return curve


def _refuse_short(band: Band, answer: Answer) -> None:
    times = answer.values[EDT : T30 + 1]
    product = band.width * _longest_known(answer)
    if product < SAFE_PRODUCT:
        answer.flag(words.SHORT_BT)
    if product < LEAST_PRODUCT:
        times[:] = np.nan
        answer.reasons[EDT : T30 + 1] = words.BANDWIDTH_SHORT
    elif times[0] * band.width < LEAST_PRODUCT:
        times[0] = np.nan
        answer.reasons[EDT] = words.BANDWIDTH_SHORT


def read_splits(
    curve: DecayCurve,
    gates: Gates,
    row: int,
    number: int,
    band: Band,
    layout: EnvelopeLayout,
    answer: Answer,
) -> None:
    """Fill the ratios of gated energies, freed from the noise."""
    slower = len(curve.energy) / layout.length
    onset = int(layout.lead * slower + 0.5)
    lengths = gates.lengths[row].tolist()
    hiss = curve.noise * gates.reach * slower
    doubt = hiss / math.sqrt(gates.reach / layout.rate * band.width)
    sides = zip(gates.early[row, :, number], gates.late[row, :, number], strict=True)
    for name, cut, (before, behind) in zip(SPLIT_NAMES, lengths, sides, strict=True):
        early = float(before) - curve.noise * cut * slower
        end = int((layout.lead + cut + gates.reach) * slower)
        late = float(behind) - hiss
        if end < curve.end:
            late += curve.after(end, onset)
        elif late > 6.0 * doubt:
            late /= 1.0 - _share_left(answer, gates.reach / layout.rate)
        else:
            late = curve.after(int((layout.lead + cut) * slower + 0.5), onset)
        if early <= 0.0 or late < LEAST_LATE * early:
            answer.reasons[name] = words.LATE_BURIED
            continue
        if early > 30.0 * late and answer.reasons[T30] == words.BANDWIDTH_SHORT:
            answer.reasons[name] = words.BANDWIDTH_SHORT
            continue
        read_ratio(early + late, late, CLEARANCE * curve.tail, name, answer)
        if name == C50:
            answer.values[D50] = min(max(early / (early + late), 0.0), 1.0)


def _share_left(answer: Answer, time: float) -> float:
    """Return the share of energy that a decay keeps after a time [s]."""
    return 10.0 ** (-6.0 * time / _longest_known(answer))


def _longest_known(answer: Answer) -> float:
    """Return T30, else T20, else the time of the curve's end [s]."""
    for time in (answer.values[T30], answer.values[T20]):
        if time > 0.0:
            return float(time)
    return float(answer.facts[LATE])
