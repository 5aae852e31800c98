"""Hear a field through a head: head-related responses put on the listener."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from rir.errors import TrainingError
from rir.harmonics import evaluate_harmonics
from rir.optional import require

__all__ = ["Hrtf", "hear_binaural", "read_hrtf"]

RIDGE = 1e-3


@dataclass(frozen=True, eq=False)
class Hrtf:
    """Hold head-related impulse responses.

    Parameters
    ----------
    directions : numpy.ndarray
        Unit vectors in the head's frame (x forward, y left, z up), shape (M, 3).
    responses : numpy.ndarray
        Shape (M, ears, taps).
    sample_rate : float
        Hertz.
    """

    directions: np.ndarray
    responses: np.ndarray
    sample_rate: float

    def harmonics(self, order: int, sample_rate: float) -> np.ndarray:
        """Fit each tap over the sphere, shape (harmonics, ears, taps).

        A small ridge keeps sets that leave out directions from below tame.
        """
        samples = _resampled(self.responses, self.sample_rate, sample_rate)
        basis = evaluate_harmonics(self.directions, order)
        square = basis.T @ basis + RIDGE * len(basis) * np.eye(basis.shape[1])
        flat = samples.reshape(len(samples), -1)
        fitted = np.linalg.solve(square, basis.T @ flat)
        return fitted.reshape(basis.shape[1], *samples.shape[1:])


def read_hrtf(path: str | Path) -> Hrtf:
    """Read a SOFA file of head-related impulse responses.

    Raises
    ------
    MissingPartError
        If sofar is not installed.
    TrainingError
        If the file holds no impulse responses.
    """
    sofar = require("sofar", why="reading SOFA files")
    file = sofar.read_sofa(str(path), verify=False, verbose=False)
    samples = getattr(file, "Data_IR", None)
    if samples is None:
        raise TrainingError(f"{path} holds no impulse responses (Data.IR)")
    places = np.asarray(file.SourcePosition, dtype=np.float64)
    if str(file.SourcePosition_Type).lower() == "spherical":
        places = _cartesian(places)
    lengths = np.linalg.norm(places, axis=1, keepdims=True)
    rate = float(np.ravel(file.Data_SamplingRate)[0])
    return Hrtf(places / lengths, np.asarray(samples, dtype=np.float64), rate)


def hear_binaural(
    field: Any, emitters: Any, listeners: Any, hrtf: Hrtf, order: int = 4
) -> np.ndarray:
    """Answer what each ear hears, shape (queries, ears, n_samples), float32.

    Parameters
    ----------
    field : DirectionalField
        A field that answers ``harmonic_responses``.
    emitters, listeners : Poses
        The listener's orientation is that of the head.
    hrtf : Hrtf
        The head.
    order : int
        Spherical-harmonic order; the rays of a small field carry about 4.
    """
    parts = field.harmonic_responses(emitters, listeners, order).astype(np.float64)
    rate = field.frame.sample_rate
    ears = hrtf.harmonics(order, rate)
    length = parts.shape[-1] + ears.shape[-1] - 1
    spectra = np.fft.rfft(parts, length), np.fft.rfft(ears, length)
    heard = np.fft.irfft(np.einsum("qkf,kef->qef", *spectra), length)
    return heard[..., : parts.shape[-1]].astype(np.float32)


def _cartesian(spherical: np.ndarray) -> np.ndarray:
    azimuth, elevation = np.radians(spherical[:, 0]), np.radians(spherical[:, 1])
    flat = np.cos(elevation)
    return np.column_stack(
        [flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)]
    )


def _resampled(samples: np.ndarray, before: float, after: float) -> np.ndarray:
    if before == after:
        return samples
    from scipy.signal import resample_poly

    factor = Fraction(after / before).limit_denominator(4096)
    up, down = factor.numerator, factor.denominator
    return resample_poly(samples, up, down, axis=-1) * (down / up)
