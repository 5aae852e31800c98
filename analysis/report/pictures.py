"""What the page draws of each pair when it is clicked: bytes, packed as text."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.decay import remaining_energy

__all__ = ["decay_bytes", "packed_pair", "packed_response", "spectrogram_bytes"]

WAVE_SECONDS = 0.1
"""Direct sound and early reflections fill the drawing."""
WAVE_POINTS = 4800
"""Every sample at 48 kHz, the largest of several at higher rates."""
DECAY_POINTS = 240
"""A drawing is some 320 pixels wide, and a decay curve smooth."""
SPECTROGRAM_SHAPE = (64, 80)
"""Bands and times, as page.js has them; 5 kB a response."""
DECIBELS_PER_STEP = 0.4
"""As page.js has it; a byte then reaches 102 dB, of which 80 are drawn."""


def _text(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")


def packed_response(
    samples: FloatArray, sample_rate: int, scale: float
) -> dict[str, str]:
    """Pack the drawings of one response.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Response.
    sample_rate : int
        Samples per second [Hz].
    scale : float
        Amplitude that fills the waveform drawing; the same for both directions.
    """
    count = min(len(samples), round(WAVE_SECONDS * sample_rate))
    step = max(1, count // WAVE_POINTS)
    wave = samples[: count // step * step].reshape(-1, step)
    wave = np.take_along_axis(wave, np.abs(wave).argmax(1)[:, None], 1)[:, 0]
    return {
        "wave": _text(np.rint(127 * np.clip(wave / scale, -1, 1)).astype(np.int8)),
        "decay": _text(decay_bytes(samples)),
        "spectrogram": _text(spectrogram_bytes(samples)),
    }


def packed_pair(
    forward: FloatArray, reverse: FloatArray, sample_rate: int
) -> dict[str, Any]:
    """Pack both directions of a pair on common scales."""
    scale = max(float(np.max(np.abs(h))) for h in (forward, reverse)) or 1.0
    return {
        "forward": packed_response(forward, sample_rate, scale),
        "reverse": packed_response(reverse, sample_rate, scale),
    }


def decay_bytes(samples: FloatArray) -> NDArray[np.uint8]:
    """Return the energy decay curve at 240 instants, in steps of -0.4 dB."""
    energy = remaining_energy(samples**2)
    at = np.linspace(0, len(samples) - 1, DECAY_POINTS).astype(int)
    return _levels(energy[at], energy[0])


def spectrogram_bytes(samples: FloatArray) -> NDArray[np.uint8]:
    """Return band powers over time, (64, 80) flattened, in steps of -0.4 dB."""
    from scipy.fft import rfft

    bands, frames = SPECTROGRAM_SHAPE
    size = max(128, len(samples) // frames)
    starts = np.linspace(0, max(0, len(samples) - size), frames).astype(int)
    padded = np.pad(samples, (0, max(0, size - len(samples))))
    blocks = padded[starts[:, None] + np.arange(size)] * np.hanning(size)
    power = np.abs(np.asarray(rfft(blocks, axis=-1))) ** 2
    edges = np.linspace(0, power.shape[1], bands + 1).astype(int)
    summed = np.add.reduceat(power, edges[:-1], axis=1) / np.diff(edges)
    return _levels(summed.T.ravel(), float(summed.max()))


def _levels(power: FloatArray, reference: float) -> NDArray[np.uint8]:
    ratio = np.maximum(power / (reference or 1.0), 1e-11)
    return np.clip(-10 * np.log10(ratio) / DECIBELS_PER_STEP, 0, 255).astype(np.uint8)
