"""Building blocks of hard cases: carriers, decays, direct sounds, noises."""

from dataclasses import dataclass

import numpy as np

from hard_cases.case import HardCase
from hard_cases.truth import measured_truth, range_above_noise
from rir.arrays import FloatArray

__all__ = ["Decay", "pink_noise", "with_noise"]


@dataclass(frozen=True)
class Decay:
    """A decaying response, described.

    Parameters
    ----------
    times : tuple of float
        Reverberation time of each decay [s].
    levels : tuple of float
        Initial level of each decay [dB re the first].
    rate : float
        Samples per second [Hz].
    carrier : {"sign", "gauss"}
        ``"sign"``: exact energy envelope; ``"gauss"``: noise.
    direct_db : float or None
        Direct sound re the energy of the rest (its DRR, window aside) [dB].
    """

    times: tuple[float, ...] = (1.0,)
    levels: tuple[float, ...] = (0.0,)
    rate: float = 48000
    carrier: str = "sign"
    direct_db: float | None = None

    def envelope(self, count: int) -> FloatArray:
        """Return the root mean square over `count` samples."""
        time = np.arange(count) / self.rate
        square = sum(
            10.0 ** (level / 10 - 6.0 * time / t)
            for t, level in zip(self.times, self.levels, strict=True)
        )
        return np.sqrt(square)

    def length_to(self, depth_db: float) -> int:
        """Return the samples until the slowest decay has fallen by a depth [dB]."""
        return int(depth_db / 60.0 * max(self.times) * self.rate) + 2

    def samples(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return `count` samples of it."""
        wave = (
            rng.choice([-1.0, 1.0], count)
            if self.carrier == "sign"
            else rng.standard_normal(count)
        )
        wave *= self.envelope(count)
        if self.direct_db is not None:
            wave[0] = np.sqrt(np.sum(wave[1:] ** 2) * 10.0 ** (self.direct_db / 10))
        return wave

    def clean(self, rng: np.random.Generator, depth_db: float = 140.0) -> FloatArray:
        """Return the response down to a depth."""
        return self.samples(self.length_to(depth_db), rng)


def pink_noise(count: int, rng: np.random.Generator) -> FloatArray:
    """Return noise with 3 dB less per octave, of unit mean square."""
    from scipy.fft import irfft, rfft

    spectrum = np.asarray(rfft(rng.standard_normal(count)))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    noise = np.asarray(irfft(spectrum, count))
    return noise / np.sqrt(np.mean(noise**2))


def with_noise(
    name: str,
    decay: Decay,
    floor_db: float,
    rng: np.random.Generator,
    *,
    onset: int = 0,
    length: float | None = None,
    noise: FloatArray | None = None,
) -> HardCase:
    """Return a decay in noise, judged by the noise-free version of the same samples.

    A time is asked for when the curve falls 5 dB further than it needs before the
    noise, refused when it falls less than it needs, and optional between.
    """
    clean = decay.clean(rng)
    truth = measured_truth(clean, decay.rate, direct=decay.direct_db is not None)
    rms = 10.0 ** (floor_db / 20)
    depth = range_above_noise(clean, rms, decay.envelope(len(clean)))
    shortest = onset + int(
        1.6 * np.interp(floor_db, [-90, 0], [1.5, 0.3]) * max(decay.times) * decay.rate
    )
    count = (
        int(length * decay.rate) if length else max(shortest, onset + len(clean) // 3)
    )
    samples = np.zeros(count)
    kept = min(count - onset, len(clean))
    samples[onset : onset + kept] = clean[:kept]
    samples += rms * (rng.standard_normal(count) if noise is None else noise[:count])
    optional = _limit_to_range(truth, depth)
    warns = None if depth > 40 else True
    return HardCase(
        name,
        samples,
        decay.rate,
        truth,
        True,
        frozenset(optional),
        warns=False if depth > 55 and len(decay.times) == 1 else warns,
    )


def _limit_to_range(truth: dict[str, float], depth: float) -> set[str]:
    optional = set()
    for name, needed in {"EDT": 10.0, "T20": 25.0, "T30": 35.0}.items():
        if depth < needed:
            truth[name] = float("nan")
        elif depth < needed + 5.0 or np.isnan(truth[name]):
            optional.add(name)
    for name in ("C50", "C80", "DRR"):
        if name in truth and truth[name] > depth - 3.0:
            optional.add(name)
            if truth[name] > depth + 3.0:
                del truth[name]
    return optional
