"""Octaves and third octaves: averages over realisations against their truth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.scatter import TIME_SCATTER
from hard_cases.decays import Decay
from hard_cases.score import Score, judge_value
from rir.arrays import FloatArray
from rir.bands import Band, bands_of

__all__ = ["OCTAVES", "THIRDS", "BandCase", "score_bands"]

OCTAVES = (63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
"""Octaves of ISO 3382-1 and one more at either end [Hz]."""
THIRDS = (100.0, 160.0, 250.0, 400.0, 630.0, 1000.0, 1600.0, 2500.0, 4000.0)
"""Every second third octave, which halves the work [Hz]."""
REALISATIONS = 16
"""Draws of each case: their mean scatters a quarter as much as one."""

BandAnalyser = Callable[[FloatArray, float, Sequence[float]], Any]


@dataclass(frozen=True)
class BandCase:
    """A white decay in white noise, with or without a direct sound.

    Parameters
    ----------
    time : float
        Reverberation time [s].
    floor_db : float or None
        Noise re the initial level of the decay [dB].
    direct_db : float or None
        Direct sound re the rest [dB].
    """

    time: float
    floor_db: float | None = -60.0
    direct_db: float | None = None

    def samples(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Return clean and noisy realisations."""
        decay = Decay((self.time,), carrier="gauss", direct_db=self.direct_db)
        count = int(max(1.6 * self.time, 0.5) * decay.rate)
        clean = np.array([decay.samples(count, rng) for _ in range(REALISATIONS)])
        if self.floor_db is None:
            return clean, clean
        rms = 10.0 ** (self.floor_db / 20)
        return clean, clean + rms * rng.standard_normal(clean.shape)


CASES = (
    BandCase(0.05, None),
    BandCase(0.1),
    BandCase(0.2),
    BandCase(0.3),
    BandCase(0.3, -60.0, 10.0),
    BandCase(0.5, -50.0),
    BandCase(1.0),
    BandCase(1.0, -60.0, 5.0),
    BandCase(2.0, -55.0),
)


def gated_clarity(clean: FloatArray, band: Band, split: float, rate: float) -> float:
    """Return early-to-late energy of a response cut first and filtered afterwards."""
    from scipy.fft import rfft

    length = 2 ** int(np.log2(len(clean) + 4.0 / band.width * rate) + 1.0)
    frequencies = np.arange(1.0, length // 2 + 1.0) * (rate / length)
    power = band.power(frequencies)
    cut = int(split * rate + 0.5)
    early, late = clean.copy(), clean.copy()
    early[cut:], late[:cut] = 0.0, 0.0
    energies = [
        np.sum(power * np.abs(np.asarray(rfft(part, length)))[1:] ** 2)
        for part in (early, late)
    ]
    return float(10.0 * np.log10(energies[0] / energies[1]))


def score_bands(
    analyse: BandAnalyser,
    centers: Sequence[float],
    rng: np.random.Generator,
    cases: Sequence[BandCase] = CASES,
) -> Score:
    """Return the score of `analyse(samples, sample_rate, centers)` over band cases.

    Times are judged by their mean over 16 realisations, allowed 3 standard
    deviations of it; below a bandwidth-time product of 8 a time is nonsense, between
    8 and 16 it may be refused. C50 is judged against gating before filtering.
    """
    score = Score()
    bands = bands_of(centers, None, zero_phase=False)
    for case in cases:
        clean, noisy = case.samples(rng)
        answer = analyse(noisy, 48000.0, centers)
        for number, band in enumerate(bands):
            _judge_times(case, band, answer, number, score)
            _judge_clarity(case, band, clean, answer, number, score)
    return score


def _judge_times(
    case: BandCase, band: Band, answer: Any, number: int, score: Score
) -> None:
    product = band.width * case.time
    for name in ("T20", "T30"):
        values = np.asarray(answer[name])[..., number]
        known = values[np.isfinite(values)]
        mean = float(known.mean()) if len(known) > len(values) // 2 else np.nan
        if product < 8.0:
            verdict = "tight" if np.isnan(mean) else "false"
        elif np.isnan(mean):
            verdict = "tight" if product < 16.0 else "missing"
        else:
            spread = TIME_SCATTER[name] / np.sqrt(product)
            # A line through a scattering curve is longer by its variance.
            bias = mean / case.time - 1.0 - spread**2
            tight = max(0.02, 3.0 * spread / np.sqrt(REALISATIONS))
            near = max(0.05, 2.0 * tight)
            verdict = "jnd" if abs(bias) <= near else "wrong"
            verdict = "tight" if abs(bias) <= tight else verdict
        score.verdicts[verdict] += 1
        if verdict != "tight":
            score.remarks.append(
                f"{case} {band.center:.0f} Hz {name} {mean}: {verdict}"
            )


def _judge_clarity(
    case: BandCase,
    band: Band,
    clean: FloatArray,
    answer: Any,
    number: int,
    score: Score,
) -> None:
    truth = np.array([gated_clarity(row, band, 0.05, 48000.0) for row in clean])
    values = np.asarray(answer["C50"])[..., number]
    optional = band.width * case.time < 16.0 or float(np.mean(truth)) > 30.0
    error = float(np.nanmean(values - truth)) if np.isfinite(values).any() else np.nan
    verdict = judge_value("C50", 0.0, error, noisy=True, optional=optional)
    score.verdicts[verdict] += 1
    if verdict != "tight":
        score.remarks.append(f"{case} {band.center:.0f} Hz C50 off {error}: {verdict}")
