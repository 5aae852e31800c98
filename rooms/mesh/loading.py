"""Read mesh files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.errors import SceneError
from rir.optional import require
from rooms.mesh.stanford import read_stanford
from rooms.mesh.wavefront import read_wavefront

__all__ = ["LoadedMesh", "load_mesh"]

_FORMATS = (".obj", ".ply", ".glb", ".gltf", ".stl")
_SINGLE = (".glb", ".gltf", ".stl")
"""Formats that usually store single precision."""


@dataclass(frozen=True, eq=False)
class LoadedMesh:
    """Triangles of a file with the name of the material of each.

    Parameters
    ----------
    vertices, faces : ndarray, shape (V, 3), (F, 3)
        Corners [m] and vertex indices.
    names : list of str
        Material of each triangle.
    resolution : float
        Step of the coordinates stored in the file [m].
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    names: list[str]
    resolution: float


def load_mesh(path: str | Path) -> LoadedMesh:
    """Read an OBJ, PLY, GLB or STL file.

    Raises
    ------
    SceneError
        If the file is missing, of another kind, or holds no triangles.
    MissingPartError
        If trimesh, which reads all but OBJ and PLY files, is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in _FORMATS:
        known = ", ".join(_FORMATS)
        raise SceneError(f"{path.name} is no mesh file; known endings: {known}")
    if not path.is_file():
        raise SceneError(f"there is no mesh file {path}")
    if path.suffix.lower() == ".obj":
        vertices, faces, names = read_wavefront(path)
        if len(faces) == 0:
            raise SceneError(f"{path.name} holds no triangles")
        return LoadedMesh(vertices, faces, names, 0.0)
    if path.suffix.lower() == ".ply":
        vertices, faces, names, single = read_stanford(path)
        if len(faces) == 0:
            raise SceneError(f"{path.name} holds no triangles")
        step = _resolution(vertices) if single else 0.0
        return LoadedMesh(vertices, faces, names, step)
    trimesh = require("trimesh", why="reading meshes")
    try:
        scene = trimesh.load_scene(path, process=False, skip_materials=False)
        parts = scene.dump(concatenate=False)
    # the parsers raise whatever their formats make them raise
    except Exception as error:
        raise SceneError(f"{path.name} cannot be read as a mesh: {error}") from error
    parts = [part for part in parts if len(getattr(part, "faces", ())) > 0]
    if not parts:
        raise SceneError(f"{path.name} holds no triangles")
    return _joined(parts, path)


def _joined(parts: list[Any], path: Path) -> LoadedMesh:
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([np.asarray(part.vertices, float) for part in parts])
    faces = np.concatenate(
        [
            np.asarray(p.faces, np.int64) + o
            for p, o in zip(parts, offsets, strict=False)
        ]
    )
    names = [name for part in parts for name in [_material(part)] * len(part.faces)]
    resolution = _resolution(vertices) if path.suffix.lower() in _SINGLE else 0.0
    return LoadedMesh(vertices, faces, names, resolution)


def _resolution(vertices: NDArray[np.float64]) -> float:
    """Return the step of coordinates in single precision [m]."""
    return 4 * float(np.finfo(np.float32).eps) * float(np.abs(vertices).max())


def _material(part: Any) -> str:
    material = getattr(part.visual, "material", None)
    return str(getattr(material, "name", None) or "all")
