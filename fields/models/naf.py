"""NAF: grid features and sinusoids of both ends to a log-magnitude spectrogram."""

from pathlib import Path
from typing import Annotated

import numpy as np
import torch
from pydantic import Field, NonNegativeFloat, NonNegativeInt
from torch import Tensor, nn

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.layers.encoding import Octaves, Sinusoids
from fields.layers.grid import FeatureGrid
from fields.layers.query import Query
from fields.layers.spectrogram import Spectrogram
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.training.loop import fit_network
from fields.training.network import NetworkField, load_network

__all__ = ["PRESETS", "Config", "Naf", "fit", "load"]

SPREAD_FLOOR = 0.1
"""Least spread of a log magnitude, 0.9 dB: silent pixels must not fill the loss."""
OBSERVED_ROWS = 1024
"""Rows mean and spread are taken of: a mean of 1024 is known to 3 % of the spread."""


@settings
class Config:
    """Sizes of the neural acoustic field."""

    octaves: Octaves = 4
    "frequencies of the position encoding (original: 10)"
    relative: bool = True
    "tell the offset of the ends as well, which the original does not"
    grid: bool = True
    "learned feature grid, read at both ends"
    grid_spacing: Annotated[float, Field(ge=0.01)] = 0.5
    "distance of the grid points, metres (original: 0.25)"
    grid_features: Count = 32
    "features a point (original: 64)"
    width: Count = 256
    "width of the trunk (original: 512)"
    depth: Count = 5
    "layers of the trunk (original: 7)"
    pixels: NonNegativeInt = 0
    "time-frequency points drawn per response and step; 0 decodes whole frames"
    symmetric: bool = False
    "feed sums and products of the two ends, which no swap can change"
    oriented: bool = True
    "tell the axes of both devices"
    jitter_m: NonNegativeFloat = 0.0
    "noise on both positions in training, metres (original: 0.1)"
    griffin_lim_steps: NonNegativeInt = 32
    "phase refinements in synthesis; 0 is the original's random phase"


PRESETS = {
    "cpu": Config(),
    "paper": Config(
        octaves=10,
        relative=False,
        grid_spacing=0.25,
        grid_features=64,
        width=512,
        depth=7,
        pixels=2000,
        jitter_m=0.1,
        griffin_lim_steps=0,
    ),
}


class Naf(nn.Module):
    """Predict normalised log magnitudes of a response's STFT."""

    name = "naf"
    batch_size = 64

    def __init__(self, frame: SceneFrame, config: Config) -> None:
        super().__init__()
        self.config = config
        self.picture = Spectrogram.for_rate(frame.sample_rate, frame.n_samples)
        bins, frames = self.picture.bins, self.picture.frames
        self.reach = frame.reach
        self.register_buffer("center", torch.tensor(frame.center, dtype=torch.float32))
        self.register_buffer("mean", torch.zeros(bins, frames))
        self.register_buffer("spread", torch.ones(bins, frames))
        self.encode = Sinusoids(config.octaves)
        self.grid = (
            FeatureGrid(
                frame.low, frame.high, config.grid_spacing, config.grid_features
            )
            if config.grid
            else None
        )
        self.encode_place = Sinusoids(10, 2)
        inputs = self._inputs()
        self.trunk = _SkipTrunk(inputs, config.width, config.depth)
        outputs = 1 if config.pixels else bins * frames
        self.head = nn.Linear(config.width, outputs)

    center: Tensor
    mean: Tensor
    spread: Tensor

    def _inputs(self) -> int:
        config = self.config
        end = self.encode.width + (config.grid_features if config.grid else 0)
        end += 6 if config.oriented else 0
        total = 2 * end
        if config.relative:
            total += (3 if config.symmetric else self.encode.width) + 1
        return total + (self.encode_place.width if config.pixels else 0)

    def observe(self, data: FieldData) -> None:
        """Learn mean and spread of the log magnitudes from some rows."""
        rows = np.linspace(0, len(data) - 1, min(len(data), OBSERVED_ROWS)).astype(int)
        samples = torch.as_tensor(np.array(data.responses[rows]))
        pictures = self.picture.log_magnitude(samples)
        self.mean.copy_(pictures.mean(0))
        self.spread.copy_(3 * (pictures.std(0, unbiased=False) + SPREAD_FLOOR))

    def features(self, query: Query) -> Tensor:
        """Return what the trunk is told of a query, shape (batch, inputs)."""
        first = self._end(query.emitter, query.emitter_axes)
        second = self._end(query.listener, query.listener_axes)
        parts = [first, second]
        if self.config.symmetric:
            parts = [first + second, first * second]
        if self.config.relative:
            offset = (query.emitter - query.listener) / self.reach
            parts.append(offset.abs() if self.config.symmetric else self.encode(offset))
            parts.append(query.distance[:, None] / self.reach)
        return torch.cat(parts, dim=-1)

    def _end(self, position: Tensor, axes: Tensor) -> Tensor:
        parts = [self.encode((position - self.center) / self.reach)]
        if self.grid is not None:
            parts.append(self.grid(position))
        if self.config.oriented:
            parts += [axes[..., 0], axes[..., 2]]
        return torch.cat(parts, dim=-1)

    def training_loss(
        self, query: Query, target: Tensor, random: torch.Generator
    ) -> Tensor:
        """Return the squared error of the normalised log magnitudes."""
        truth = self._normalised(target)
        if self.config.jitter_m:
            query = _jittered(query, self.config.jitter_m, random)
        features = self.features(query)
        if not self.config.pixels:
            return (self._frames(features) - truth).square().mean()
        bins, frames = self.picture.bins, self.picture.frames
        shape = (len(query), self.config.pixels)
        drawn = torch.randint(bins * frames, shape, generator=random)
        drawn = drawn.to(truth.device)
        wanted = truth.flatten(1).gather(1, drawn)
        return (self._pixels(features, drawn) - wanted).square().mean()

    def render(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        features = self.features(query)
        if self.config.pixels:
            bins, frames = self.picture.bins, self.picture.frames
            every = torch.arange(bins * frames, device=features.device)
            normal = torch.cat(
                [self._pixels(row[None], every[None]) for row in features]
            ).view(-1, bins, frames)
        else:
            normal = self._frames(features)
        picture = normal.float() * self.spread + self.mean
        return self.picture.samples(picture, self.config.griffin_lim_steps)

    def _normalised(self, target: Tensor) -> Tensor:
        return (self.picture.log_magnitude(target) - self.mean) / self.spread

    def _frames(self, features: Tensor) -> Tensor:
        shape = (-1, self.picture.bins, self.picture.frames)
        return self.head(self.trunk(features)).view(*shape)

    def _pixels(self, features: Tensor, index: Tensor) -> Tensor:
        frames = self.picture.frames
        row = 2.0 * (index // frames) / max(self.picture.bins - 1, 1) - 1
        column = 2.0 * (index % frames) / max(frames - 1, 1) - 1
        place = self.encode_place(torch.stack([row, column], dim=-1))
        wide = features[:, None].expand(-1, index.shape[1], -1)
        return self.head(self.trunk(torch.cat([wide, place], dim=-1)))[..., 0]


class _SkipTrunk(nn.Module):
    """Leaky layers with the input added again half way."""

    def __init__(self, inputs: int, width: int, depth: int) -> None:
        super().__init__()
        self.entry = nn.Linear(inputs, width)
        self.layers = nn.ModuleList(nn.Linear(width, width) for _ in range(depth - 1))
        self.again = nn.Sequential(
            nn.Linear(inputs, width), nn.LeakyReLU(0.1), nn.Linear(width, width)
        )
        self.activation = nn.LeakyReLU(0.1)

    def forward(self, values: Tensor) -> Tensor:
        hidden = self.activation(self.entry(values))
        for number, layer in enumerate(self.layers):
            hidden = self.activation(layer(hidden))
            if number == len(self.layers) // 2:
                hidden = hidden + self.again(values)
        return hidden


def _jittered(query: Query, spread: float, random: torch.Generator) -> Query:
    noise = spread * torch.randn(2, len(query), 3, generator=random)
    noise = noise.to(query.emitter.device)
    return Query(
        query.emitter + noise[0],
        query.emitter_axes,
        query.listener + noise[1],
        query.listener_axes,
    )


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NetworkField:
    """Train a neural acoustic field."""
    return fit_network(Naf, data, config, plan)


def load(path: Path) -> NetworkField:
    """Open a stored neural acoustic field."""
    return load_network(path, Naf, Config)
