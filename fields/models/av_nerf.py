"""AV-NeRF-style field: poses and what the devices see, to a waveform.

The variant for impulse responses was never published, so its heads are a
choice. Views are rendered by our own ray caster from the room's mesh, or from its
walls and furniture: a panorama of depth and of surface absorption, in the device's
frame. They are read by a small network, or by a frozen ResNet-18; a folder of
photographs may stand in their place.
"""

from dataclasses import replace
from pathlib import Path
from typing import Literal

import torch
from pydantic import NonNegativeFloat, NonNegativeInt
from torch import Tensor, nn

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.images import read_photos
from fields.layers.encoding import Octaves, Sinusoids
from fields.layers.perceptron import ResidualPerceptron, quiet_head
from fields.layers.query import Query
from fields.layers.resnet import find_weights
from fields.layers.sights import SEEN, LearnedSight, PhotoSight, ResnetSight
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.training.loop import fit_network
from fields.training.losses import LossWeights, waveform_loss
from fields.training.network import NetworkField, load_network
from rir.errors import ConfigError

__all__ = ["PRESETS", "AvNerf", "Config", "fit", "load"]


@settings
class Config:
    """Sizes of the AV-NeRF-style field."""

    octaves: Octaves = 4
    "frequencies of the position encoding (original: 10)"
    relative: bool = True
    "tell the offset of the ends as well"
    view_rows: Count = 8
    "rows of the panorama"
    view_columns: Count = 16
    "columns of the panorama"
    both_views: bool = True
    "also look from the emitter, which the original does not"
    view_noise: NonNegativeFloat = 0.1
    "noise on the view features in training"
    features: Literal["learned", "resnet18"] = "learned"
    "of the views: learned, or resnet18 (frozen, torchvision's weights; original)"
    weights: str = ""
    "file of those weights; looked for in torch's cache when empty"
    photos: str = ""
    "folder of photographs with poses.csv, seen in place of rendered views"
    photo_count: NonNegativeInt = 0
    "photographs in the folder; counted when it is read"
    width: Count = 256
    "width of the hidden layers (original: 128)"
    depth: Count = 4
    "layers of the mixing network"


PRESETS = {
    "cpu": Config(),
    "paper": Config(
        octaves=10, relative=False, view_rows=64, view_columns=64, both_views=False
    ),
}


class AvNerf(nn.Module):
    """Mix pose encodings and view features, decode samples."""

    name = "av-nerf"
    batch_size = 64

    def __init__(self, frame: SceneFrame, config: Config) -> None:
        super().__init__()
        self.config = config
        self.reach = frame.reach
        self.register_buffer("center", torch.tensor(frame.center, dtype=torch.float32))
        self.sight = _sight(frame, config)
        self.encode = Sinusoids(config.octaves)
        inputs = 2 * self.encode.width + 12 + SEEN * (2 if config.both_views else 1)
        inputs += self.encode.width + 1 if config.relative else 0
        self.mix = ResidualPerceptron(inputs, config.width, config.depth)
        self.head = quiet_head(config.width, frame.n_samples)

    center: Tensor

    def observe(self, data: FieldData) -> None:  # noqa: ARG002
        """Read photographs or frozen weights, where they are asked for."""
        if isinstance(self.sight, PhotoSight):
            self.sight.look(self.config.photos, self.config.weights)
        elif isinstance(self.sight, ResnetSight):
            self.sight.network.read(find_weights(self.config.weights))

    def forward(self, query: Query, random: torch.Generator | None = None) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        parts = [
            self.encode((query.emitter - self.center) / self.reach),
            self.encode((query.listener - self.center) / self.reach),
            query.emitter_axes[..., 0],
            query.emitter_axes[..., 2],
            query.listener_axes[..., 0],
            query.listener_axes[..., 2],
            self._seen(query.listener, query.listener_axes, random),
        ]
        if self.config.both_views:
            parts.append(self._seen(query.emitter, query.emitter_axes, random))
        if self.config.relative:
            parts.append(self.encode((query.emitter - query.listener) / self.reach))
            parts.append(query.distance[:, None] / self.reach)
        return self.head(self.mix(torch.cat(parts, dim=-1))).float()

    def _seen(
        self, position: Tensor, axes: Tensor, random: torch.Generator | None
    ) -> Tensor:
        return self.sight(position, axes, self.config.view_noise, random)

    def training_loss(
        self, query: Query, target: Tensor, random: torch.Generator
    ) -> Tensor:
        """Return the waveform loss of a batch."""
        return waveform_loss(self(query, random), target, LossWeights())

    def render(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        return self(query)


def _sight(frame: SceneFrame, config: Config) -> nn.Module:
    if config.photos:
        return PhotoSight(config.photo_count)
    if config.features == "resnet18":
        return ResnetSight(frame, config.view_rows, config.view_columns)
    return LearnedSight(frame, config.view_rows, config.view_columns)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NetworkField:
    """Train an AV-NeRF-style field.

    Raises
    ------
    ConfigError
        If the kind of features is unknown.
    MissingPartError
        If frozen features are asked for and their weights are not there.
    DatasetError
        If the folder of photographs cannot be read.
    """
    if config.features not in ("learned", "resnet18"):
        raise ConfigError(f"no features {config.features!r}; known: learned, resnet18")
    if config.photos:
        count = len(read_photos(config.photos, size=1).poses)
        config = replace(config, photo_count=count)
    return fit_network(AvNerf, data, config, plan)


def load(path: Path) -> NetworkField:
    """Open a stored AV-NeRF-style field."""
    return load_network(path, AvNerf, Config)
