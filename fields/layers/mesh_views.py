"""What a device would see in a room of any shape, cast by our own ray tracer."""

import numpy as np
import torch
from torch import Tensor, nn

from fields.shape import Shape

__all__ = ["FAR_M", "MeshViews"]

FAR_M = 100.0  # depth of what is open: beyond any room
OPEN_SHADE = 1.0  # an open window absorbs all


class MeshViews(nn.Module):
    """Cast rays into a mesh.

    Parameters
    ----------
    shape : Shape
        Triangles and their shades.
    """

    def __init__(self, shape: Shape) -> None:
        super().__init__()
        from rooms.mesh import MeshGeometry

        shades, surface = np.unique(shape.shades, return_inverse=True)
        count = len(shape.triangles)
        mesh = MeshGeometry.from_arrays(
            shape.triangles.reshape(-1, 3),
            np.arange(3 * count).reshape(-1, 3),
            surface.reshape(-1).tolist(),
        )
        self._shades = shades[mesh.face_surface]
        self._mesh = mesh

    @torch.no_grad()
    def forward(self, origins: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        """Return distance and shade of what each ray meets, as ``BoxViews`` does.

        What is open is 100 m away and black.
        """
        from fields.layers.view_kernel import cast

        starts = self._mesh.localised(origins.cpu().double().numpy())
        ways = np.ascontiguousarray(directions.cpu().double().numpy())
        depth, met = cast(self._mesh.hierarchy.arrays, starts, ways, FAR_M)
        shade = np.where(met >= 0, self._shades[np.maximum(met, 0)], OPEN_SHADE)
        return _tensor(depth, origins), _tensor(shade, origins)


def _tensor(values: np.ndarray, like: Tensor) -> Tensor:
    return torch.tensor(values, dtype=torch.float32, device=like.device)
