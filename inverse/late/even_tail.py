"""A tail whose spectrogram is as even as a waveform's can be.

What cannot be predicted is best answered by its mean: a noise of its own would only
add its own chance to the truth's. Alternating projections between waveforms, flat
spectrograms of several windows and a flat envelope halve the swing of noise.
"""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from inverse.late.spectral_tilt import colored
from inverse.rows.tiles import Tiles

__all__ = ["EvenTail", "even_noise"]

WINDOWS_S = (
    (0.076, 0.0152),
    (0.038, 0.0076),
    (0.019, 0.0038),
    (0.0095, 0.0019),
    (0.0047, 0.0006),
)
"""Length and hop of each window: halved from 76 ms down to the 5 ms of a tile; a
waveform that is even in all is even in those between."""
STEPS = 60  # rounds of projections: 0.7 s for 0.3 s of noise (decision 0066)
MARGIN_S = 0.04  # half of the longest window: no end of the noise is seen by less
MIRRORED_S = 0.3
"""Longer noise goes back and forth over so much: it stays even and costs no more."""


@dataclass(frozen=True, eq=False)
class EvenTail:
    """Hold one even waveform that every pair gets after its direct sound.

    The same at all places: symmetric and without jumps, but not spatial.
    """

    seed: int
    """Of the first noise."""
    samples_a_metre: float
    """Sample rate over speed of sound."""
    n_samples: int
    """Length of a response."""
    sample_rate: float
    """Hertz."""
    tint: np.ndarray = field(default_factory=lambda: np.ones(1))
    """Filter that gives the waveform the spectral shape of the room's late sound."""

    def brought(
        self, first: np.ndarray, second: np.ndarray, tiles: Tiles, energies: np.ndarray
    ) -> np.ndarray:
        """Return the sound with given energies of tiles, (pairs, bands, bins)."""
        onset = np.linalg.norm(first - second, axis=1) * self.samples_a_metre
        onset = np.minimum(np.ceil(onset), self.n_samples).astype(int)
        parts = tiles.split(self._wave[None])[0]
        sums = np.pad(np.cumsum(parts**2, axis=1), ((0, 0), (1, 0)))
        ends = np.minimum(np.arange(tiles.bins + 1) * tiles.bin_samples, self.n_samples)
        sounding = np.diff(sums[:, np.maximum(ends, onset[:, None])], axis=-1)
        sounding = sounding.transpose(1, 0, 2)
        # A bin that the direct sound cuts holds too little sound to be scaled.
        least = 0.5 * np.median(sounding, axis=-1, keepdims=True) + 1e-300
        gains = np.sqrt(energies / np.maximum(sounding, least))
        out = tiles.joined(parts, gains)
        return np.where(np.arange(self.n_samples) >= onset[:, None], out, 0.0)

    @cached_property
    def _wave(self) -> np.ndarray:
        noise = even_noise(self.n_samples, self.sample_rate, seed=self.seed)
        return colored(noise, self.tint)


def even_noise(n_samples: int, sample_rate: float, *, seed: int) -> np.ndarray:
    """Return noise of variance 1, even in spectrogram and envelope, (n_samples,)."""
    once = min(n_samples, max(round(MIRRORED_S * sample_rate), 2))
    noise = _evened(once, sample_rate, seed)
    # each end stands once
    period = np.concatenate([noise, noise[-2:0:-1]])
    return np.resize(period, n_samples)


@lru_cache(maxsize=8)
def _evened(n_samples: int, sample_rate: float, seed: int) -> np.ndarray:
    margin = round(MARGIN_S * sample_rate) + 64
    total = n_samples + 2 * margin
    noise = np.random.default_rng(seed).standard_normal(total)
    shapes = []
    for window_s, hop_s in WINDOWS_S:
        width = max(round(window_s * sample_rate), 4)
        hop = max(round(hop_s * sample_rate), 1)
        window = np.hanning(width + 2)[1:-1]
        places = np.arange(0, total - width + 1, hop)[:, None] + np.arange(width)
        each = np.tile(window**2, len(places))
        cover = np.bincount(places.ravel(), each, total)
        shapes.append((window, places, np.maximum(cover, 0.05)))
    for _ in range(STEPS):
        parts = [_flattened(noise, *shape) for shape in shapes]
        parts.append(_levelled(noise))
        joined = np.sum(parts, axis=0)
        noise = joined / joined.std()
    return noise[margin : margin + n_samples]


def _flattened(
    noise: np.ndarray, window: np.ndarray, places: np.ndarray, cover: np.ndarray
) -> np.ndarray:
    """Return the waveform nearest to a flat spectrogram of one window."""
    width = len(window)
    size = 2 * int(2 ** np.ceil(np.log2(width)))
    from scipy.fft import irfft, rfft

    spectra = np.asarray(rfft(noise[places] * window, size))
    level = np.sqrt((window**2).sum())
    flat = spectra * (level / (np.abs(spectra) + 1e-9))
    frames = np.asarray(irfft(flat, size))[:, :width] * window
    joined = np.bincount(places.ravel(), frames.ravel(), len(noise))
    return joined / cover


def _levelled(noise: np.ndarray) -> np.ndarray:
    """Return the waveform nearest to a flat envelope."""
    from scipy.fft import fft, ifft

    count = len(noise)
    turn = np.zeros(count)
    turn[0], turn[1 : (count + 1) // 2] = 1.0, 2.0
    if count % 2 == 0:
        turn[count // 2] = 1.0
    wave = np.asarray(ifft(np.asarray(fft(noise)) * turn))
    size = np.abs(wave)
    return np.real(wave) * np.sqrt((size**2).mean()) / (size + 1e-9)
