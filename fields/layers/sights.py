"""What a device sees as features: learned, by a frozen ResNet, or photographs."""

import torch
from torch import Tensor, nn

from fields.frame import SceneFrame
from fields.images import read_photos
from fields.layers.perceptron import perceptron
from fields.layers.query import Query
from fields.layers.resnet import FEATURES, ResNet18, find_weights
from fields.layers.views import panorama_directions, room_views

__all__ = ["SEEN", "LearnedSight", "PhotoSight", "ResnetSight"]

Random = torch.Generator | None
SEEN = 64  # features of a view: a quarter of the hidden width they are mixed in
TURN_M = 1.0  # metres that a photograph turned by 90 degrees counts as being away


class Panorama(nn.Module):
    """What stands round a device: rays turned with it, cast into the room."""

    def __init__(self, frame: SceneFrame, rows: int, columns: int) -> None:
        super().__init__()
        self.reach = frame.reach
        rays = panorama_directions(rows, columns)
        self.register_buffer("rays", rays, persistent=False)
        self.views = room_views(frame)

    rays: Tensor

    def cast(self, position: Tensor, axes: Tensor) -> tuple[Tensor, Tensor]:
        """Return depth in metres and shade along the rays, shape (batch, rays)."""
        directions = torch.einsum("bij,rj->bri", axes, self.rays)
        return self.views(position, directions)


class LearnedSight(Panorama):
    """A small network over the depth and shade of a panorama."""

    def __init__(self, frame: SceneFrame, rows: int, columns: int) -> None:
        super().__init__(frame, rows, columns)
        self.narrow = perceptron([2 * len(self.rays), 256, 128, SEEN])

    def forward(
        self, position: Tensor, axes: Tensor, noise: float, random: Random
    ) -> Tensor:
        """Return features of what is seen, shape (batch, 64)."""
        depth, shade = self.cast(position, axes)
        features = torch.cat([depth / self.reach, shade], dim=-1)
        return self.narrow(_noisy(features, noise, random))


class ResnetSight(Panorama):
    """Frozen ResNet-18 features of a rendered panorama, one of shade, one of depth."""

    def __init__(self, frame: SceneFrame, rows: int, columns: int) -> None:
        super().__init__(frame, rows, columns)
        self.size = rows, columns
        self.network = ResNet18()
        self.narrow = perceptron([2 * FEATURES, 128, SEEN])

    def forward(
        self, position: Tensor, axes: Tensor, noise: float, random: Random
    ) -> Tensor:
        """Return features of what is seen, shape (batch, 64)."""
        depth, shade = self.cast(position, axes)
        fog = torch.exp(-depth / (2 * self.reach))
        pictures = torch.cat([(1 - shade) * fog, fog])
        # Rows go from down to up; pictures from top to bottom.
        pictures = pictures.reshape(-1, 1, *self.size).flip(2).expand(-1, 3, -1, -1)
        features = torch.cat(self.network(pictures).chunk(2), dim=-1)
        return self.narrow(_noisy(features, noise, random))


class PhotoSight(nn.Module):
    """Frozen ResNet-18 features of the photograph taken nearest to a pose."""

    def __init__(self, count: int) -> None:
        super().__init__()
        self.register_buffer("places", torch.zeros(count, 3))
        self.register_buffer("axes", torch.zeros(count, 3, 3))
        self.register_buffer("features", torch.zeros(count, FEATURES))
        self.narrow = perceptron([FEATURES + 3, 128, SEEN])

    places: Tensor
    axes: Tensor
    features: Tensor

    def forward(
        self, position: Tensor, axes: Tensor, noise: float, random: Random
    ) -> Tensor:
        """Return features of what is seen, shape (batch, 64)."""
        offset = position[:, None] - self.places
        turned = (axes[:, None, :, 0] - self.axes[:, :, 0]).square().sum(-1)
        # Half about is as bad as two metres away.
        nearest = (offset.square().sum(-1) + TURN_M**2 * turned).argmin(dim=1)
        rows = torch.arange(len(position), device=position.device)
        seen = torch.cat([self.features[nearest], offset[rows, nearest]], dim=-1)
        return self.narrow(_noisy(seen, noise, random))

    def look(self, folder: str, weights: str) -> None:
        """Read the photographs and keep their features."""
        network = ResNet18()
        network.read(find_weights(weights))
        photos = read_photos(folder)
        query = Query.of(photos.poses, photos.poses)
        parts = torch.from_numpy(photos.images).split(32)
        self.places.copy_(query.emitter)
        self.axes.copy_(query.emitter_axes)
        self.features.copy_(torch.cat([network(part) for part in parts]))


def _noisy(values: Tensor, noise: float, random: Random) -> Tensor:
    if random is None or not noise:
        return values
    drawn = torch.randn(values.shape, generator=random)
    return values + noise * drawn.to(values.device)
