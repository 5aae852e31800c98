"""Frequency responses from a few bands."""

import numpy as np
import torch
from torch import Tensor

__all__ = ["band_matrix", "minimum_phase_log"]


def band_matrix(centers: np.ndarray, sample_rate: float, length: int) -> Tensor:
    """Return the linear interpolation from bands to FFT bins, (bands, bins)."""
    frequencies = np.fft.rfftfreq(length, 1 / sample_rate)
    rows = [np.interp(frequencies, centers, row) for row in np.eye(len(centers))]
    return torch.tensor(np.array(rows), dtype=torch.float32)


def minimum_phase_log(log_magnitude: Tensor) -> Tensor:
    """Return the complex logarithm of the minimum-phase response.

    Folding the real cepstrum onto its causal half gives the phase that belongs
    to a magnitude; logarithms of several filters in a row simply add.

    Parameters
    ----------
    log_magnitude : Tensor
        Natural logarithm at the bins of a real FFT, shape (..., bins).
    """
    length = 2 * (log_magnitude.shape[-1] - 1)
    cepstrum = torch.fft.irfft(log_magnitude.to(torch.complex64), length)
    fold = torch.zeros(length, device=log_magnitude.device)
    fold[0] = fold[length // 2] = 1.0
    fold[1 : length // 2] = 2.0
    return torch.fft.rfft(cepstrum * fold, length)
