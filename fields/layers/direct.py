"""The direct sound, written out: delay, distance, patterns, source response."""

import math

import torch
from torch import Tensor, nn

from fields.layers.harmonics import harmonics
from fields.layers.query import Query

__all__ = ["DirectPath"]

ORDER = 4
"""Degree of patterns in networks, 25 coefficients: a loudspeaker below some kHz."""
# The pattern starts from a fit to the direct sounds, which is better than what
# the waveform loss makes of it: let it move slowly.
PATTERN_PACE = 0.1
TAPS = 33
NEAREST_M = 0.1


class DirectPath(nn.Module):
    """Render the straight path with a learned emitter pattern.

    Parameters
    ----------
    n_samples : int
        Length of a response.
    samples_a_metre : float
        Sample rate over speed of sound.
    """

    def __init__(self, n_samples: int, samples_a_metre: float) -> None:
        super().__init__()
        self.n_samples = n_samples
        self.samples_a_metre = samples_a_metre
        omni = torch.zeros((ORDER + 1) ** 2)
        omni[0] = math.sqrt(4 * math.pi)
        self.slow_pattern = nn.Parameter(omni / PATTERN_PACE)
        impulse = torch.zeros(TAPS)
        impulse[TAPS // 2] = 1.0
        self.source = nn.Parameter(impulse)

    @property
    def pattern(self) -> Tensor:
        """Coefficients of the emitter's pattern, shape (25,), device frame."""
        return PATTERN_PACE * self.slow_pattern

    def set_pattern(self, coefficients: Tensor) -> None:
        """Start from a pattern fitted elsewhere."""
        with torch.no_grad():
            self.slow_pattern.copy_(coefficients / PATTERN_PACE)

    def gain(self, query: Query, source: Tensor | None = None) -> Tensor:
        """Return the emitter's gain towards the listener, shape (batch,)."""
        pattern = self.pattern if source is None else source
        return harmonics(departure(query), ORDER) @ pattern

    def forward(
        self, query: Query, listener_gain: Tensor, source: Tensor | None = None
    ) -> Tensor:
        """Return the direct sound, shape (batch, n_samples).

        Parameters
        ----------
        query : Query
            Poses.
        listener_gain : Tensor
            The listener's gain towards the emitter, and whatever else the direct
            sound is multiplied by, shape (batch,).
        source : Tensor, optional
            Pattern of another emitter in this one's place, shape (25,).
        """
        near = query.distance.clamp_min(NEAREST_M)
        level = self.gain(query, source) * listener_gain / near
        length = 2 * self.n_samples
        bins = torch.arange(length // 2 + 1, device=level.device) / length
        delay = query.distance * self.samples_a_metre - TAPS // 2
        phase = -2 * torch.pi * delay[:, None] * bins
        spectrum = torch.polar(torch.ones_like(phase), phase)
        # A direct sound beyond the end must not wrap round to the start.
        heard = (query.distance * self.samples_a_metre < self.n_samples).float()
        spectrum = spectrum * torch.fft.rfft(self.source, length)
        pulses = torch.fft.irfft(spectrum, length)[:, : self.n_samples]
        return (level * heard)[:, None] * pulses


def departure(query: Query) -> Tensor:
    """Return the direction emitter to listener in the emitter's frame, (batch, 3)."""
    return local_direction(query.listener - query.emitter, query.emitter_axes)


def arrival(query: Query) -> Tensor:
    """Return the direction listener to emitter in the listener's frame, (batch, 3)."""
    return local_direction(query.emitter - query.listener, query.listener_axes)


def local_direction(offset: Tensor, axes: Tensor) -> Tensor:
    """Return unit vectors of offsets (..., 3) in device frames (batch, 3, 3)."""
    length = (offset.square().sum(-1, keepdim=True) + 1e-12).sqrt()
    return torch.einsum("b...i,bij->b...j", offset / length, axes)
