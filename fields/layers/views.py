"""What a device would see: depth and surface along rays, cast by ourselves."""

import numpy as np
import torch
from torch import Tensor, nn

from fields.frame import SceneFrame
from fields.layers.mesh_views import FAR_M, MeshViews
from fields.surfaces import HULL_MARGIN_M

__all__ = ["BoxViews", "panorama_directions", "room_views"]


def room_views(frame: SceneFrame) -> nn.Module:
    """Return what casts rays in a frame's room: its mesh, or boxes."""
    return BoxViews(frame) if frame.shape is None else MeshViews(frame.shape)


def panorama_directions(rows: int, columns: int) -> Tensor:
    """Return unit directions of a panorama, shape (rows * columns, 3).

    Rows go from down to up in equal steps of height, columns round the device;
    x is forward.
    """
    heights = (torch.arange(rows) + 0.5) / rows * 2 - 1
    angles = (torch.arange(columns) + 0.5) / columns * 2 * torch.pi
    flat = (1 - heights.square()).sqrt()
    return torch.stack(
        [
            flat[:, None] * angles.cos(),
            flat[:, None] * angles.sin(),
            heights[:, None].expand(-1, columns),
        ],
        dim=-1,
    ).reshape(-1, 3)


class BoxViews(nn.Module):
    """Cast rays in a room of axis-aligned boxes.

    The room's walls are one box seen from inside, furniture is seen from
    outside. Without a room description the box round all poses, widened by
    half a metre, stands for the walls.

    Parameters
    ----------
    frame : SceneFrame
        Gives the room or the box.
    """

    def __init__(self, frame: SceneFrame) -> None:
        super().__init__()
        walls, things, shades = _boxes(frame)
        self.register_buffer("walls", torch.tensor(walls, dtype=torch.float32))
        self.register_buffer("things", torch.tensor(things, dtype=torch.float32))
        self.register_buffer("shades", torch.tensor(shades, dtype=torch.float32))

    walls: Tensor
    things: Tensor
    shades: Tensor

    @torch.no_grad()
    def forward(self, origins: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Return distance and shade of what each ray meets.

        Parameters
        ----------
        origins : Tensor
            Shape (batch, 3), metres.
        directions : Tensor
            Unit vectors, shape (batch, rays, 3).

        Returns
        -------
        tuple of Tensor
            Distance in metres and absorption of the surface, (batch, rays).
        """
        starts = origins[:, None, None, :]
        speeds = torch.where(directions.abs() < 1e-9, 1e-9, directions)[:, :, None, :]
        _, leave = _slabs(starts, speeds, self.walls)
        depth, side = leave.clamp(0.0, FAR_M).min(dim=-1)
        upward = torch.gather(directions, 2, side[:, :, 0, None])[..., 0] > 0
        shade = self.shades[(2 * side[:, :, 0] + upward).long()]
        depth = depth[:, :, 0]
        if len(self.things):
            enter, leave = _slabs(starts, speeds, self.things)
            first, last = enter.max(dim=-1).values, leave.min(dim=-1).values
            hit = (first <= last) & (first > 0)
            nearest, thing = torch.where(hit, first, FAR_M).min(dim=-1)
            shade = torch.where(nearest < depth, self.shades[6 + thing], shade)
            depth = torch.minimum(depth, nearest)
        return depth, shade


def _slabs(starts: Tensor, speeds: Tensor, boxes: Tensor) -> tuple[Tensor, Tensor]:
    low = (boxes[:, 0] - starts) / speeds
    high = (boxes[:, 1] - starts) / speeds
    return torch.minimum(low, high), torch.maximum(low, high)


def _boxes(frame: SceneFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    room = frame.room
    if room is None:
        hull = np.stack([frame.low - HULL_MARGIN_M, frame.high + HULL_MARGIN_M])
        return hull[None], np.zeros((0, 2, 3)), np.full(6, 0.5)
    walls = np.stack([np.zeros(3), np.asarray(room.size_m)])[None]
    things = np.array([[box.low, box.high] for box in room.furniture])
    shades = np.concatenate(
        [room.absorption.mean(axis=1), np.full(len(room.furniture), 0.5)]
    )
    return walls, things.reshape(-1, 2, 3), shades
