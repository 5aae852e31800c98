"""What loudspeaker, microphone and converters add to a room's response."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = ["DeviceResponse", "Hardware"]


@dataclass(frozen=True, eq=False)
class DeviceResponse:
    """Magnitude response of a device, made causal with minimum phase.

    Examples
    --------
    >>> flat = DeviceResponse([100, 10000], [-6, -6])
    >>> float(flat.filtered(np.eye(1, 64), 16000)[0, 0].round(3))
    0.501
    """

    frequencies: FloatArray
    """Ascending frequencies [Hz]. Shape (n,)."""
    levels_db: FloatArray
    """Level at each [dB]; held beyond the ends. Shape (n,)."""

    def __post_init__(self) -> None:
        f, level = (np.asarray(v, float) for v in (self.frequencies, self.levels_db))
        if f.ndim != 1 or f.shape != level.shape or len(f) < 1 or np.any(f <= 0):
            raise SignalError("a device response needs as many levels as frequencies")
        if np.any(np.diff(f) <= 0) or not np.isfinite(level).all():
            raise SignalError("a device response needs ascending frequencies, levels")
        object.__setattr__(self, "frequencies", f)
        object.__setattr__(self, "levels_db", level)

    def filtered(self, samples: FloatArray, sample_rate: int) -> FloatArray:
        """Return samples, shape (..., n), heard through the device."""
        n = samples.shape[-1]
        length = int(2 ** np.ceil(np.log2(4 * max(n, 64))))
        f = np.maximum(np.fft.rfftfreq(length, 1 / sample_rate), 1e-3)
        level = np.interp(np.log(f), np.log(self.frequencies), self.levels_db)
        transfer = _minimum_phase(10 ** (level / 20), length)
        spectrum = np.fft.rfft(samples, length, axis=-1) * transfer
        return np.fft.irfft(spectrum, length, axis=-1)[..., :n]


def _minimum_phase(magnitude: FloatArray, length: int) -> NDArray[np.complex128]:
    """Return the minimum-phase transfer function of a magnitude, by the cepstrum."""
    cepstrum = np.fft.irfft(np.log(np.maximum(magnitude, 1e-8)), length)
    fold = np.zeros(length)
    fold[0] = fold[length // 2] = 1.0
    fold[1 : length // 2] = 2.0
    return np.exp(np.fft.rfft(cepstrum * fold))


@dataclass(frozen=True, eq=False)
class Hardware:
    """A measuring chain, as an optional part of a scene.

    Parameters
    ----------
    loudspeaker, microphone : DeviceResponse, optional
        Responses on the axis; patterns are part of the scene.
    noise_db : float
        Level of white noise per sample, re a response of 1; -inf for none.
    drift_ppm : float
        Error of the recording clock: positive means that it runs fast.
    """

    loudspeaker: DeviceResponse | None = None
    microphone: DeviceResponse | None = None
    noise_db: float = field(default=float("-inf"))
    drift_ppm: float = 0.0

    def heard(
        self,
        responses: ArrayLike,
        sample_rate: int,
        rng: np.random.Generator | Iterable[np.random.Generator],
    ) -> FloatArray:
        """Return responses, shape (..., n), as the chain would deliver them.

        One generator draws all noise, or each of several that of one response.
        """
        out = np.asarray(responses, dtype=float)
        for device in (self.loudspeaker, self.microphone):
            out = out if device is None else device.filtered(out, sample_rate)
        if self.drift_ppm:
            out = _stretched(out, 1 / (1 + 1e-6 * self.drift_ppm))
        if np.isfinite(self.noise_db):
            if isinstance(rng, np.random.Generator):
                noise = rng.standard_normal(out.shape)
            else:
                noise = np.stack([one.standard_normal(out.shape[-1]) for one in rng])
            out = out + 10 ** (self.noise_db / 20) * noise
        return out


def _stretched(samples: FloatArray, step: float) -> FloatArray:
    """Read samples at multiples of a step close to 1, band-limited.

    A Kaiser-windowed sinc of 64 taps; exact to -90 dB up to 0.9 Nyquist.
    """
    n, half = samples.shape[-1], 32
    at = np.arange(n) * step
    base = np.floor(at).astype(np.int64)
    taps = np.arange(1 - half, half + 1)
    offset = taps - (at - base)[:, None]
    window = np.i0(9.0 * np.sqrt(np.clip(1 - (offset / half) ** 2, 0, None)))
    kernel = np.sinc(offset) * window / np.i0(9.0)
    padding = [(0, 0)] * (samples.ndim - 1) + [(half, half + 2)]
    padded = np.pad(samples, padding)
    index = np.minimum(base[:, None] + taps + half, padded.shape[-1] - 1)
    # taken, not indexed: rows lie alike in memory, one or many, and sum alike
    return np.einsum("...nt,nt->...n", np.take(padded, index, axis=-1), kernel)
