"""Poses of both ends as tensors."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from rir import Poses
from rir.pose import rotate

__all__ = ["Query"]


@dataclass(frozen=True, eq=False)
class Query:
    """Hold a batch of emitter and listener poses.

    Parameters
    ----------
    emitter, listener : Tensor
        Positions, shape (batch, 3), metres.
    emitter_axes, listener_axes : Tensor
        Device axes in the room, shape (batch, 3, 3): column 0 points forward,
        1 left, 2 up; ``axes.T @ direction`` is the direction in the device
        frame.
    """

    emitter: Tensor
    emitter_axes: Tensor
    listener: Tensor
    listener_axes: Tensor

    def __len__(self) -> int:
        return len(self.emitter)

    @classmethod
    def of(
        cls, emitters: Poses, listeners: Poses, device: torch.device | str = "cpu"
    ) -> "Query":
        """Convert poses, on the way from float64 to float32."""
        return cls(
            _tensor(emitters.positions, device),
            _tensor(_axes(emitters), device),
            _tensor(listeners.positions, device),
            _tensor(_axes(listeners), device),
        )

    def __getitem__(self, index: Tensor | slice) -> "Query":
        return Query(
            self.emitter[index],
            self.emitter_axes[index],
            self.listener[index],
            self.listener_axes[index],
        )

    def swapped(self, mode: str = "pose") -> "Query":
        """Return the query with both ends exchanged, or only their positions."""
        if mode == "position":
            return Query(
                self.listener, self.emitter_axes, self.emitter, self.listener_axes
            )
        return Query(self.listener, self.listener_axes, self.emitter, self.emitter_axes)

    def swapped_where(self, coins: Tensor, mode: str = "pose") -> "Query":
        """Return the query with the ends exchanged where ``coins`` is true."""
        other = self.swapped(mode)
        near, wide = coins[:, None], coins[:, None, None]
        return Query(
            torch.where(near, other.emitter, self.emitter),
            torch.where(wide, other.emitter_axes, self.emitter_axes),
            torch.where(near, other.listener, self.listener),
            torch.where(wide, other.listener_axes, self.listener_axes),
        )

    def joined(self, other: "Query") -> "Query":
        """Return this batch followed by another."""
        return Query(
            torch.cat([self.emitter, other.emitter]),
            torch.cat([self.emitter_axes, other.emitter_axes]),
            torch.cat([self.listener, other.listener]),
            torch.cat([self.listener_axes, other.listener_axes]),
        )

    @property
    def distance(self) -> Tensor:
        """Distance between the ends, shape (batch,), metres; safe to derive at 0."""
        offset = self.emitter - self.listener
        return (offset.square().sum(-1) + 1e-12).sqrt()


def _tensor(values: np.ndarray, device: torch.device | str) -> Tensor:
    return torch.as_tensor(np.ascontiguousarray(values), dtype=torch.float32).to(device)


def _axes(poses: Poses) -> np.ndarray:
    columns = [rotate(poses.orientations, axis) for axis in np.eye(3)]
    return np.stack(columns, axis=-1)
