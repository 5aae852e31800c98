"""Third octaves of a spectrum as slow envelopes, and noise shaped like them."""

from dataclasses import dataclass

import numpy as np

from rir.arrays import ComplexArray, FloatArray

__all__ = [
    "Bands",
    "ThirdOctave",
    "noise_density",
    "padded_size",
    "smoothed",
    "third_octaves",
]

LOWEST = 125.0
"""Centre of the lowest band [Hz]; it takes in all below."""
MARGIN_SECONDS = 0.05
"""Silence appended, so that nothing wraps around."""
CLEAR_OF_NOISE = 3.0
"""Power over the noise that noise alone, smoothed as it is, seldom reaches."""
SHORTEST_SECONDS = 0.0003
"""Bands from 5 kHz on are smoothed alike, over 1.5 periods of 5 kHz [s]."""
COLOUR_SHARE = 0.02
"""Spectra are smoothed over this share of the frequency to either side."""


@dataclass(frozen=True)
class ThirdOctave:
    """Bins of one band and its power-complementary weights.

    Parameters
    ----------
    center : float
        Centre [Hz].
    first : int
        Bin of the first weight.
    weights, probe : ndarray, shape (bins,)
        Weights, and those by which the power over time is judged: without corners, so
        that loud parts do not ring into quiet ones.
    """

    center: float
    first: int
    weights: FloatArray
    probe: FloatArray

    @property
    def bins(self) -> slice:
        """Bins of the spectrum that the weights stand for."""
        return slice(self.first, self.first + len(self.weights))


def padded_size(count: int, sample_rate: int) -> int:
    """Return a fast length of the transform of some samples and a margin."""
    from scipy.fft import next_fast_len

    longest = count + round(MARGIN_SECONDS * sample_rate)
    return int(next_fast_len(longest, real=True) or 0)


def third_octaves(sample_rate: int, size: int) -> list[ThirdOctave]:
    """Return bands whose squared weights add up to one at every bin.

    The lowest reaches down to 0 Hz, the highest up to half the sample rate.

    Parameters
    ----------
    sample_rate : int
        Samples per second [Hz].
    size : int
        Length of the real transform.

    Examples
    --------
    >>> total = np.zeros(501)
    >>> for band in third_octaves(8000, 1000):
    ...     total[band.bins] += band.weights**2
    >>> bool(np.allclose(total, 1))
    True
    """
    frequency = np.fft.rfftfreq(size, 1 / sample_rate)
    place = 3 * np.log2(np.maximum(frequency, 1e-9) / LOWEST)
    count = max(1, int(np.ceil(3 * np.log2(0.8 * sample_rate / 2 / LOWEST))))
    place = np.clip(place, 0, count - 1)
    ends = np.minimum(frequency / LOWEST, (frequency[-1] - frequency) / frequency[-1])
    soft = np.sin(np.pi / 2 * np.minimum(1.0, 5 * ends)) ** 2
    bands = []
    for k in range(count):
        away = np.abs(place - k)
        inside = np.flatnonzero(away < 1)
        if len(inside):
            bins = slice(inside[0], inside[-1] + 1)
            weights = np.cos(np.pi / 2 * away[bins])
            center = LOWEST * 2 ** (k / 3)
            probe = weights**2 * soft[bins]
            bands.append(ThirdOctave(center, int(inside[0]), weights, probe))
    return bands


def noise_density(quiet: FloatArray, bins: int) -> FloatArray:
    """Return the power density of noise, its mean over bins the power, shape (bins,).

    Parameters
    ----------
    quiet : ndarray, shape (k,)
        Noise alone.
    bins : int
        Bins from 0 Hz to half the sample rate.
    """
    from scipy.fft import rfft
    from scipy.signal import windows

    taper = windows.blackmanharris(len(quiet), sym=False)
    power = np.abs(np.asarray(rfft(quiet * taper))) ** 2 / np.sum(taper**2)
    return np.interp(np.linspace(0, 1, bins), np.linspace(0, 1, len(power)), power)


class Bands:
    """A spectrum that is taken apart and put together again in bands.

    Parameters
    ----------
    spectrum : ndarray, shape (size // 2 + 1,)
        Transform of a real signal.
    size : int
        Length of that signal.
    sample_rate : int
        Samples per second [Hz].
    noise : ndarray, shape (size // 2 + 1,)
        Power density of the noise in it.
    """

    def __init__(
        self,
        spectrum: ComplexArray,
        size: int,
        sample_rate: int,
        noise: FloatArray,
    ) -> None:
        self._spectrum = spectrum
        self._size = size
        self._rate = sample_rate
        self.frequency = np.fft.rfftfreq(size, 1 / sample_rate)
        self.table = third_octaves(sample_rate, size)
        self._noise = noise
        power = smoothed(np.abs(spectrum) ** 2)
        self._colour = np.maximum(power - noise * size, 0.0)

    def signal(self, band: ThirdOctave) -> tuple[ComplexArray, FloatArray]:
        """Return what a band holds above noise, and its smoothed power.

        Parameters
        ----------
        band : ThirdOctave

        Returns
        -------
        signal : ndarray, shape (k,), complex
            Envelope, weighted by the signal's share of the power.
        power : ndarray, shape (k,)
            Power of the signal.
        """
        own, colour = self._spectrum[band.bins], self._colour[band.bins]
        power, floor = self.power(band, max(SHORTEST_SECONDS, 1.5 / band.center))
        above = np.where(power > CLEAR_OF_NOISE * floor, power - floor, 0.0)
        share = np.divide(above, power, out=np.zeros_like(power), where=power > 0)
        part = float(np.sum(band.probe**2 * colour))
        whole = float(np.sum(band.weights**2 * colour))
        above *= whole / part if part > 0 else 0.0
        return self._envelope(own * band.weights) * share, above

    def power(self, band: ThirdOctave, spread: float) -> tuple[FloatArray, float]:
        """Return the smoothed power of a band over time, and that of its noise.

        Parameters
        ----------
        band : ThirdOctave
        spread : float
            Standard deviation of the smoothing [s].
        """
        from scipy.ndimage import gaussian_filter1d

        seen = np.abs(self._envelope(self._spectrum[band.bins] * band.probe)) ** 2
        slow = spread * self._rate * len(seen) / self._size
        floor = np.sum(band.probe**2 * self._noise[band.bins]) / self._size
        return gaussian_filter1d(seen, slow, mode="constant"), float(floor)

    def add(
        self,
        spectrum: ComplexArray,
        band: ThirdOctave,
        envelope: ComplexArray,
        response: FloatArray,
    ) -> None:
        """Add the envelope of a band, filtered by a real response, to a spectrum."""
        from scipy.fft import fft

        scale = self._size / len(envelope)
        own = np.asarray(fft(envelope))[: len(band.weights)] * scale
        spectrum[band.bins] += own * band.weights * response[band.bins]

    def add_noise(
        self,
        spectrum: ComplexArray,
        band: ThirdOctave,
        power: FloatArray,
        response: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        """Add noise with the band's colour and the given power over time.

        The noise is filtered before it is shaped in time, so that nothing sounds
        before or after the power does.
        """
        from scipy.fft import fft

        shape = band.weights**2 * self._colour[band.bins]
        total = float(np.sum(shape))
        draws = rng.standard_normal((2, len(shape)))
        if total <= 0:
            return
        bins = (draws[0] + 1j * draws[1]) * np.sqrt(shape / (2 * total)) * self._size
        steady = self._envelope(bins * response[band.bins])
        scale = self._size / len(steady)
        whole = np.asarray(fft(steady * np.sqrt(power))) * scale
        spectrum[band.bins] += whole[: len(shape)]

    def _envelope(self, bins: ComplexArray) -> ComplexArray:
        """Return the slow envelope of some bins, twice as fast as they need."""
        from scipy.fft import ifft, next_fast_len

        count = int(next_fast_len(2 * len(bins)) or 0)
        values = np.asarray(ifft(bins, count), dtype=np.complex128)
        return values * (count / self._size)


def smoothed(power: FloatArray) -> FloatArray:
    """Return a power spectrum averaged over a share of each frequency."""
    running = np.concatenate([[0.0], np.cumsum(power)])
    index = np.arange(len(power))
    reach = np.maximum(8, (COLOUR_SHARE * index).astype(int))
    low = np.maximum(index - reach, 0)
    high = np.minimum(index + reach + 1, len(power))
    return (running[high] - running[low]) / (high - low)
