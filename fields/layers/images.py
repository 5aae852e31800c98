"""Mirror images of a box: which walls a path meets and how often."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import torch
from torch import Tensor, nn

from fields.frame import SceneFrame
from fields.surfaces import HULL_MARGIN_M

__all__ = ["BoxImages", "ImagePaths"]

NEAREST_M = 0.1  # nearer than this, 1/distance says more of the fit than of sound


@dataclass(frozen=True, eq=False)
class ImagePaths:
    """Hold the paths of a batch.

    Parameters
    ----------
    distances : Tensor
        Length of each path, shape (batch, paths), metres, at least 0.1.
    departures, arrivals : Tensor
        Directions away from each end, room frame, shape (batch, paths, 3).
    """

    distances: Tensor
    departures: Tensor
    arrivals: Tensor


class BoxImages(nn.Module):
    """Trace reflections between the six walls of a box.

    Parameters
    ----------
    frame : SceneFrame
        Gives the room's walls; without a room the box round all poses, widened
        by half a metre, stands for them.
    order : int
        Most reflections of any path.
    axial_order : int
        Most reflections of a path between two opposite walls.
    """

    def __init__(self, frame: SceneFrame, order: int, axial_order: int) -> None:
        super().__init__()
        low, high = _walls(frame)
        numbers = _numbers(order, axial_order)
        self.register_buffer("low", torch.tensor(low, dtype=torch.float32))
        self.register_buffer("size", torch.tensor(high - low, dtype=torch.float32))
        self.register_buffer("numbers", torch.tensor(numbers))
        # Number k: |k| reflections; the low wall is met first when k < 0.
        below = np.where(numbers < 0, (-numbers + 1) // 2, numbers // 2)
        above = np.abs(numbers) - below
        counts = np.stack([below, above], axis=-1).reshape(len(numbers), 6)
        self.register_buffer("counts", torch.tensor(counts, dtype=torch.float32))

    low: Tensor
    size: Tensor
    numbers: Tensor
    counts: Tensor

    def forward(self, emitter: Tensor, listener: Tensor) -> ImagePaths:
        """Return the paths between positions of shape (batch, 3), metres."""
        source = emitter - self.low
        place = listener - self.low
        odd = (self.numbers % 2 != 0).float()
        sign = 1 - 2 * odd
        # Even k: k/2 rooms away, same way round; odd k: mirrored.
        shift = (self.numbers.float() + odd) * self.size
        offset = sign * source[:, None] + shift - place[:, None]
        distance = (offset.square().sum(-1) + 1e-12).sqrt()
        arrivals = offset / distance[..., None]
        departures = -sign * arrivals
        return ImagePaths(distance.clamp_min(NEAREST_M), departures, arrivals)


def _walls(frame: SceneFrame) -> tuple[np.ndarray, np.ndarray]:
    if frame.room is not None and frame.room.mesh is None:
        return np.zeros(3), np.asarray(frame.room.size_m, dtype=np.float64)
    return frame.low - HULL_MARGIN_M, frame.high + HULL_MARGIN_M


def _numbers(order: int, axial_order: int) -> np.ndarray:
    span = range(-order, order + 1)
    inner = {k for k in product(span, repeat=3) if sum(map(abs, k)) <= order}
    for axis, k in product(range(3), range(-axial_order, axial_order + 1)):
        inner.add(tuple(k if one == axis else 0 for one in range(3)))
    return np.array(sorted(inner, key=lambda k: (sum(map(abs, k)), k)))
