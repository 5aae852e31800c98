"""Training losses on waveforms, with the target as the norm.

The six terms are those of AVR (energy, angle, amplitude, spectrum, time,
multi-resolution STFT). Where that form breaks down it is mended: the spectral
convergence is divided by the target, angles are compared as unit phasors, and
decay curves have a floor relative to their own start.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

__all__ = [
    "LossWeights",
    "decay_levels",
    "multiscale_log_loss",
    "spectral_distance",
    "waveform_loss",
]

PHASOR_FLOOR = 1e-3  # 60 dB below a direct sound at a metre: no phase is known there
DECAY_FLOOR = 1e-6  # 60 dB below all energy: the decay that T60 names
MAGNITUDE_FLOOR = 1e-3  # keeps the modulus smooth at zero, as in the metric's floor


@dataclass(frozen=True)
class LossWeights:
    """Weigh the terms of :func:`waveform_loss`."""

    time: float = 10.0
    spectrum: float = 0.0
    amplitude: float = 1.0
    angle: float = 0.0
    energy: float = 1.0
    stft: float = 1.0


def waveform_loss(
    prediction: Tensor,
    target: Tensor,
    weights: LossWeights,
    resolutions: tuple[int, ...] = (512, 256, 64),
) -> Tensor:
    """Return the mean loss of a batch, a scalar.

    Parameters
    ----------
    prediction, target : Tensor
        Shape (batch, n_samples).
    weights : LossWeights
        Weight of each term; a term of weight 0 costs nothing.
    resolutions : tuple of int
        FFT lengths of the STFT term.
    """
    loss = prediction.new_zeros(())
    if weights.time:
        loss = loss + weights.time * (prediction - target).abs().mean()
    if weights.spectrum or weights.amplitude or weights.angle:
        loss = loss + _spectrum_terms(prediction, target, weights)
    if weights.energy:
        difference = decay_levels(prediction) - decay_levels(target)
        loss = loss + weights.energy * difference.abs().mean()
    if weights.stft:
        distance = spectral_distance(prediction, target, resolutions)
        loss = loss + weights.stft * distance
    return loss


def _spectrum_terms(prediction: Tensor, target: Tensor, weights: LossWeights) -> Tensor:
    ours, theirs = torch.fft.rfft(prediction), torch.fft.rfft(target)
    loss = prediction.new_zeros(())
    if weights.spectrum:
        difference = torch.view_as_real(ours - theirs).abs()
        loss = loss + weights.spectrum * 2 * difference.mean()
    size, true_size = _modulus(ours, 1e-12), _modulus(theirs, 1e-12)
    if weights.amplitude:
        loss = loss + weights.amplitude * (size - true_size).abs().mean()
    if weights.angle:
        floor = PHASOR_FLOOR
        phasor = ours / size.clamp_min(floor) - theirs / true_size.clamp_min(floor)
        loss = loss + weights.angle * 2 * torch.view_as_real(phasor).abs().mean()
    return loss


def _modulus(spectrum: Tensor, floor: float) -> Tensor:
    return (spectrum.real.square() + spectrum.imag.square() + floor).sqrt()


def decay_levels(samples: Tensor) -> Tensor:
    """Return log10 of the backward-integrated energy, with a relative floor.

    The absolute level stays in, so that a prediction cannot hide a gain error;
    the floor lies 60 dB below the start.
    """
    energy = samples.square().flip(-1).cumsum(-1).flip(-1)
    floor = DECAY_FLOOR * energy[..., :1].detach() + 1e-12
    return torch.log10(energy + floor)


def spectral_distance(
    prediction: Tensor, target: Tensor, resolutions: tuple[int, ...]
) -> Tensor:
    """Return spectral convergence + log + linear magnitude distance, a scalar."""
    usable = [size for size in resolutions if size <= prediction.shape[-1]]
    total = prediction.new_zeros(())
    for size in usable or [_largest_power(prediction.shape[-1])]:
        ours, theirs = _magnitudes(prediction, size), _magnitudes(target, size)
        total = total + _convergence(ours, theirs)
        total = total + (ours.log() - theirs.log()).abs().mean()
        total = total + (ours - theirs).abs().mean()
    return total / max(len(usable), 1)


def multiscale_log_loss(prediction: Tensor, target: Tensor) -> Tensor:
    """Return DiffRIR's loss: log and linear magnitudes over four FFT lengths."""
    longest = _largest_power(prediction.shape[-1])
    total = prediction.new_zeros(())
    for size in (256, 512, 1024, 2048):
        ours, theirs = (
            _magnitudes(one, min(size, longest)) for one in (prediction, target)
        )
        total = total + (ours.log() - theirs.log()).abs().mean()
        total = total + (ours - theirs).abs().mean()
    return total


def _convergence(ours: Tensor, theirs: Tensor) -> Tensor:
    difference = torch.linalg.vector_norm(ours - theirs)
    return difference / torch.linalg.vector_norm(theirs).clamp_min(1e-6)


def _magnitudes(samples: Tensor, size: int) -> Tensor:
    window = torch.hann_window(size, device=samples.device, dtype=samples.dtype)
    spectrum = torch.stft(
        samples,
        size,
        size // 4,
        window=window,
        return_complex=True,
        pad_mode="constant",
    )
    return _modulus(spectrum, MAGNITUDE_FLOOR**2)


def _largest_power(count: int) -> int:
    return 1 << max(count.bit_length() - 1, 2)
