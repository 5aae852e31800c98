"""INRAS-style field: features of both ends and of bounce points to a waveform.

The original is known here only by description, so every size is a choice. Two
towers (or one, tied, which makes the field exactly reciprocal) turn each end
into features; their symmetric products and what both ends share are decoded
straight to samples.
"""

from pathlib import Path
from typing import Literal

import numpy as np
import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.layers.encoding import Octaves, Sinusoids, shoulder
from fields.layers.perceptron import ResidualPerceptron, quiet_head
from fields.layers.query import Query
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.training.loop import fit_network
from fields.training.losses import LossWeights, waveform_loss
from fields.training.network import NetworkField, load_network

__all__ = ["PRESETS", "Config", "Inras", "fit", "load"]


@settings
class Config:
    """Sizes of the INRAS-style field."""

    bounce_points: Count = 64
    "surface points whose distances each end is told (paper: 1024)"
    distance_octaves: Octaves = 0
    "frequencies of the encoding of those distances"
    octaves: Octaves = 4
    "frequencies of the position encoding"
    width: Count = 256
    "width of every hidden layer"
    depth: Count = 3
    "residual layers of each tower and of the decoder"
    relative: bool = True
    "tell the decoder offset and distance between the ends"
    tied: Literal["auto", True, False] = "auto"
    "one tower for both ends: exactly reciprocal, blind to unequal patterns"
    # auto: where both devices are known to have one pattern, and relative is on.
    aligned: bool = True
    "shift the decoded waveform to the arrival of the direct sound"
    oriented: bool = True
    "tell each tower its device's axes"


PRESETS = {
    "cpu": Config(),
    "paper": Config(
        bounce_points=1024, octaves=10, relative=False, aligned=False, depth=4
    ),
}


class Inras(nn.Module):
    """Decode waveforms from two towers over bounce-point distances."""

    name = "inras"
    batch_size = 64

    def __init__(self, frame: SceneFrame, config: Config) -> None:
        super().__init__()
        self.config = config
        self.n_samples = frame.n_samples
        self.samples_a_metre = frame.sample_rate / frame.speed_of_sound
        self.reach = frame.reach
        self.encode = Sinusoids(config.octaves)
        self.encode_offset = Sinusoids(config.octaves, 4)
        self.register_buffer("center", _row(frame.center))
        points = frame.surface_points[: config.bounce_points]
        self.register_buffer("points", _row(points))
        self.encode_distances = Sinusoids(config.distance_octaves, len(points))
        inputs = self.encode.width + self.encode_distances.width
        inputs += 6 if config.oriented else 0
        self.tied = _is_tied(frame, config)
        self.listener_tower = ResidualPerceptron(inputs, config.width, config.depth)
        self.emitter_tower = (
            self.listener_tower
            if self.tied
            else ResidualPerceptron(inputs, config.width, config.depth)
        )
        shared = self._shared_width()
        self.decoder = ResidualPerceptron(
            2 * config.width + shared, config.width, config.depth
        )
        self.head = quiet_head(config.width, frame.n_samples)

    center: Tensor
    points: Tensor

    def _shared_width(self) -> int:
        if not self.config.relative:
            return 0
        offset = 4 if self.tied else self.encode_offset.width
        return offset + 1

    def observe(self, data: FieldData) -> None:
        """Need nothing from the data beforehand."""

    def forward(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        first = self.emitter_tower(self._end(query.emitter, query.emitter_axes))
        second = self.listener_tower(self._end(query.listener, query.listener_axes))
        parts = [first * second, first + second]
        if self.config.relative:
            parts.append(self._shared(query))
        decoded = self.head(self.decoder(torch.cat(parts, dim=-1))).float()
        if not self.config.aligned:
            return decoded
        near = shoulder(query.distance, 0.1)[:, None]
        return near * _delayed(decoded, query.distance * self.samples_a_metre)

    def _end(self, position: Tensor, axes: Tensor) -> Tensor:
        local = (position - self.center) / self.reach
        gaps = position[:, None] - self.points
        distances = (gaps.square().sum(-1) + 1e-12).sqrt() / self.reach
        parts = [self.encode(local), self.encode_distances(distances)]
        if self.config.oriented:
            parts += [axes[..., 0], axes[..., 2]]
        return torch.cat(parts, dim=-1)

    def _shared(self, query: Query) -> Tensor:
        offset = (query.emitter - query.listener) / self.reach
        distance = query.distance[:, None] / self.reach
        near = shoulder(distance, 0.05)
        if self.tied:
            # Only even functions of the offset keep the field reciprocal.
            return torch.cat([offset.abs(), distance, near], dim=-1)
        return torch.cat(
            [self.encode_offset(torch.cat([offset, distance], dim=-1)), near], dim=-1
        )

    def training_loss(
        self,
        query: Query,
        target: Tensor,
        random: torch.Generator,  # noqa: ARG002
    ) -> Tensor:
        """Return the waveform loss of a batch."""
        return waveform_loss(self(query), target, LossWeights())

    def render(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        return self(query)


def _is_tied(frame: SceneFrame, config: Config) -> bool:
    if config.tied != "auto":
        return config.tied
    known = frame.emitter_gain is not None
    return config.relative and known and frame.emitter_gain == frame.listener_gain


def _row(values: np.ndarray) -> Tensor:
    return torch.as_tensor(values, dtype=torch.float32)


def _delayed(samples: Tensor, delay: Tensor) -> Tensor:
    """Shift samples right by a fraction of samples, without wrap-around."""
    count = samples.shape[-1]
    length = 2 * count
    bins = torch.arange(length // 2 + 1, device=samples.device)
    turns = delay.clamp(0, count)[:, None] * bins / length
    phase = torch.polar(torch.ones_like(turns), -2 * torch.pi * turns)
    return torch.fft.irfft(torch.fft.rfft(samples, length) * phase, length)[:, :count]


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NetworkField:
    """Train an INRAS-style field."""
    return fit_network(Inras, data, config, plan)


def load(path: Path) -> NetworkField:
    """Open a stored INRAS-style field."""
    return load_network(path, Inras, Config)
