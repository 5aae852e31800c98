"""STFT: multi-resolution error of short-time magnitude spectra."""

import numpy as np

from analysis.metrics.metric import RAF, Features, Flavour, Metric
from rir.arrays import FloatArray

__all__ = ["SPECTROGRAM", "magnitudes"]

RESOLUTIONS = ((512, 300, 60), (256, 150, 30), (128, 75, 8))
"""Transform length, window and hop [samples] of the paper's three resolutions."""
POWER_FLOOR = 1e-8
"""As in auraloss, which the evaluation of AVR calls."""


def magnitudes(samples: FloatArray, size: int, window: int, hop: int) -> FloatArray:
    """Return |STFT| of mirrored-edge frames, shape (..., frames, size // 2 + 1).

    The periodic Hann window stands in the middle of each transform, as in torch.
    """
    from scipy.fft import rfft

    edge = [(0, 0)] * (samples.ndim - 1) + [(size // 2, size // 2)]
    # A record shorter than the mirror has no defined reflection; it is zero there.
    mode = "reflect" if samples.shape[-1] > size // 2 else "constant"
    padded = np.pad(samples, edge, mode=mode)
    taper = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(window) / window)
    left = (size - window) // 2
    frames = np.lib.stride_tricks.sliding_window_view(padded, size, axis=-1)
    cut = frames[..., ::hop, left : left + window] * taper
    # Only the magnitude is used, and a shift inside the frame leaves it alone.
    return np.abs(np.asarray(rfft(cut, size, axis=-1)))


def paper_spectrograms(samples: FloatArray, _rate: int) -> Features:
    """Return the three floored magnitude spectrograms, each as (..., bins)."""
    lead = samples.shape[:-1]
    spectra = []
    for size, window, hop in RESOLUTIONS:
        power = np.maximum(magnitudes(samples, size, window, hop) ** 2, POWER_FLOOR)
        spectra.append(np.sqrt(power).reshape(*lead, -1))
    return tuple(spectra)


def compare_spectrograms(truth: Features, prediction: Features) -> FloatArray:
    """Average the three resolutions' errors, each relative to the prediction.

    The paper's code hands (truth, prediction) to a loss that divides the spectral
    convergence by its second argument; this flavour keeps that order.
    """
    from analysis.metrics.spectrogram_kernel import spectral_errors

    lead = np.broadcast_shapes(truth[0].shape[:-1], prediction[0].shape[:-1])
    total = np.zeros(lead)
    for a, b in zip(truth, prediction, strict=True):
        left = np.broadcast_to(a, (*lead, a.shape[-1])).reshape(-1, a.shape[-1])
        right = np.broadcast_to(b, (*lead, b.shape[-1])).reshape(-1, b.shape[-1])
        total += spectral_errors(left, right).reshape(lead)
    return total / len(truth)


def spectrogram_matrix(described: Features) -> FloatArray:
    """Return `compare_spectrograms` of all ordered pairs of responses."""
    from analysis.metrics.spectrogram_kernel import spectral_error_matrix

    total = sum(spectral_error_matrix(part) for part in described)
    return np.asarray(total / len(described))


def raf_spectrogram(samples: FloatArray, sample_rate: int) -> Features:
    """Return ln(|STFT| + 1e-3) of 1024/512/256 frames, half that under 44.1 kHz."""
    size = 1024 if sample_rate >= 44100 else 512
    spectrum = magnitudes(samples, size, size // 2, size // 4)
    return (np.log(spectrum + 1e-3).reshape(*samples.shape[:-1], -1),)


def compare_log_spectrograms(truth: Features, prediction: Features) -> FloatArray:
    """Average the absolute difference of the logarithms."""
    return np.asarray(np.mean(np.abs(truth[0] - prediction[0]), axis=-1))


def robust_spectrograms(samples: FloatArray, _rate: int) -> Features:
    """Return magnitude spectrograms of half-overlapping windows, each (..., bins)."""
    return tuple(
        magnitudes(samples, size, window, window // 2).reshape(*samples.shape[:-1], -1)
        for size, window, _ in RESOLUTIONS
    )


def compare_spectrograms_relatively(
    truth: Features, prediction: Features
) -> FloatArray:
    """Average the three resolutions' errors, each relative to the truth.

    The logarithm stops 60 dB under the truth's largest magnitude, and the linear
    term is relative to its mean, so that no term depends on the level.
    """
    total: FloatArray = np.zeros(())
    for a, b in zip(truth, prediction, strict=True):
        floor = 1e-3 * np.max(a, axis=-1, keepdims=True)
        step = a - b
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.maximum(a, floor) / np.maximum(b, floor)
            linear = np.mean(np.abs(step), axis=-1) / np.mean(a, axis=-1)
            size = np.sqrt(np.sum(a**2, axis=-1))
            convergence = np.sqrt(np.sum(step**2, axis=-1)) / size
            logarithm = np.mean(np.abs(np.log(ratio)), axis=-1)
        total = total + convergence + logarithm + linear
    return np.asarray(total / len(truth))


SPECTROGRAM = Metric(
    symbol="STFT",
    title="spectrogram",
    unit="1",
    formula=(
        "mean over 3 resolutions of ||A-A'|| / ||A'|| + mean |ln A - ln A'|"
        " + mean |A - A'|"
    ),
    flavours={
        "paper": Flavour(
            "paper-1",
            paper_spectrograms,
            compare_spectrograms,
            "Yamamoto et al. 2020, as evaluated with AVR (Lan et al. 2024)",
            spectrogram_matrix,
        ),
        "raf": Flavour("raf-1", raf_spectrogram, compare_log_spectrograms, RAF),
        "robust": Flavour(
            "robust-1",
            robust_spectrograms,
            compare_spectrograms_relatively,
            "ours: as paper-1 relative to the truth, floor at -60 dB",
        ),
    },
)
