"""AV-NeRF-style field: poses and what the devices see, to a waveform.

The variant for impulse responses was never published, so its heads are a
choice. Views are rendered by our own ray caster from the room's walls and
furniture: a panorama of depth and of surface absorption at the listener, in its
own frame. Feature vectors of real images (ResNet-18 or any other) may be given
instead, as a table over positions.
"""

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.layers.encoding import Sinusoids
from fields.layers.perceptron import ResidualPerceptron, perceptron, quiet_head
from fields.layers.views import BoxViews, panorama_directions
from fields.plan import TrainingPlan
from fields.training.loop import fit_network
from fields.training.losses import LossWeights, waveform_loss
from fields.training.network import NetworkField, load_network
from fields.training.query import Query

__all__ = ["PRESETS", "AvNerf", "Config", "fit", "load"]


@dataclass(frozen=True)
class Config:
    """Sizes of the AV-NeRF-style field."""

    octaves: int = 4
    "frequencies of the position encoding (original: 10)"
    relative: bool = True
    "tell the offset of the ends as well"
    view_rows: int = 8
    "rows of the panorama"
    view_columns: int = 16
    "columns of the panorama"
    both_views: bool = True
    "also look from the emitter, which the original does not"
    view_noise: float = 0.1
    "noise on the view features in training"
    width: int = 256
    "width of the hidden layers (original: 128)"
    depth: int = 4
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
        rays = panorama_directions(config.view_rows, config.view_columns)
        self.register_buffer("rays", rays, persistent=False)
        self.views = BoxViews(frame)
        self.encode = Sinusoids(config.octaves)
        self.view_features = perceptron([2 * len(rays), 256, 128, 64])
        inputs = 2 * self.encode.width + 12 + 64 * (2 if config.both_views else 1)
        inputs += self.encode.width + 1 if config.relative else 0
        self.mix = ResidualPerceptron(inputs, config.width, config.depth)
        self.head = quiet_head(config.width, frame.n_samples)

    center: Tensor
    rays: Tensor

    def observe(self, data: FieldData) -> None:
        """Need nothing from the data beforehand."""

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
        directions = torch.einsum("bij,rj->bri", axes, self.rays)
        depth, shade = self.views(position, directions)
        features = torch.cat([depth / self.reach, shade], dim=-1)
        if random is not None and self.config.view_noise:
            noise = torch.randn(features.shape, generator=random)
            features = features + self.config.view_noise * noise.to(features.device)
        return self.view_features(features)

    def training_loss(
        self, query: Query, target: Tensor, random: torch.Generator
    ) -> Tensor:
        """Return the waveform loss of a batch."""
        return waveform_loss(self(query, random), target, LossWeights())

    def render(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        return self(query)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NetworkField:
    """Train an AV-NeRF-style field."""
    return fit_network(AvNerf, data, config, plan)


def load(path: Path) -> NetworkField:
    """Open a stored AV-NeRF-style field."""
    return load_network(path, AvNerf, Config)
