"""The shape of a room as triangles with the shade of their surfaces."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rir import Dataset
from rir.errors import ResoundingError

if TYPE_CHECKING:
    from rooms import Scene

__all__ = ["Shape", "known_shape"]


@dataclass(frozen=True, eq=False)
class Shape:
    """Hold the surfaces of a room that is no box."""

    triangles: np.ndarray
    """Corners, shape (triangles, 3, 3), metres."""
    shades: np.ndarray
    """Mean absorption of each triangle's surface, shape (triangles,)."""

    @classmethod
    def of_scene(cls, scene: "Scene") -> "Shape | None":
        """Return the shape of a simulated scene; None for a box."""
        from rooms.mesh import MeshGeometry

        mesh = scene.geometry
        if not isinstance(mesh, MeshGeometry):
            return None
        shades = scene.absorption.mean(axis=1)[mesh.face_surface]
        return cls(mesh.corners + mesh.origin, shades)

    def points(self, count: int, *, rng: np.random.Generator) -> np.ndarray:
        """Draw points evenly over the surfaces, shape (count, 3)."""
        first = self.triangles[:, 0]
        sides = self.triangles[:, 1:] - first[:, None]
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        owner = rng.choice(len(areas), size=count, p=areas / areas.sum())
        shares = rng.random((count, 2))
        # Points of the parallelogram's far half are turned back into the triangle.
        shares = np.where(shares.sum(axis=1, keepdims=True) > 1, 1 - shares, shares)
        return first[owner] + (shares[:, :, None] * sides[owner]).sum(axis=1)

    def as_dict(self) -> dict[str, Any]:
        """Return plain lists, for a file."""
        return {"triangles": self.triangles.tolist(), "shades": self.shades.tolist()}

    @classmethod
    def from_dict(cls, plain: dict[str, Any] | None) -> "Shape | None":
        """Rebuild a shape from what :meth:`as_dict` wrote."""
        if plain is None:
            return None
        return cls(np.array(plain["triangles"]), np.array(plain["shades"]))


def known_shape(dataset: Dataset) -> Shape | None:
    """Return the shape of the room a data set was taken in, if it is no box.

    It is known where the room's description names a mesh that is there, and where
    the data set was simulated in a built-in scene.
    """
    from rooms.builtin import SCENES, load_scene

    rooms = [room for room in dataset.rooms if room is not None]
    if len(rooms) == 1 and rooms[0].mesh is not None:
        return _shape_of(str(rooms[0].mesh)) if Path(rooms[0].mesh).exists() else None
    names = {str(one.get("recipe", {}).get("scene", "")) for one in dataset.sessions}
    name = names.pop() if len(names) == 1 else ""
    if name in SCENES:
        return Shape.of_scene(load_scene(name))
    return _shape_of(name) if name and Path(name).exists() else None


def _shape_of(path: str) -> Shape | None:
    from rooms.builtin import load_scene

    try:
        return Shape.of_scene(load_scene(path))
    # A mesh that cannot be read is as good as none: the box stands for it.
    except ResoundingError:
        return None
