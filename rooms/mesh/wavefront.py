"""Read OBJ files: corners, polygons and the names of their materials."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.errors import SceneError
from rooms.mesh.polygon import cut_face

__all__ = ["read_wavefront"]


def read_wavefront(
    path: Path,
) -> tuple[FloatArray, NDArray[np.int64], list[str]]:
    """Return vertices (V, 3), triangles (F, 3) and the material of each triangle.

    Polygons may have any number of corners and need not be convex. Faces before any
    ``usemtl`` take the name of their group or object, or "all".

    Raises
    ------
    SceneError
        If a line cannot be understood; names it.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    names: list[str] = []
    material, part = "", "all"
    text = path.read_text(encoding="utf-8", errors="replace")
    for number, line in enumerate(text.splitlines(), start=1):
        word, *rest = line.split("#", maxsplit=1)[0].split() or [""]
        try:
            if word == "v":
                vertices.append([float(value) for value in rest[:3]])
            elif word == "usemtl":
                material = " ".join(rest)
            elif word in ("o", "g") and rest:
                part = " ".join(rest)
            elif word == "f":
                corners = [_index(item, len(vertices)) for item in rest]
                triangles = cut_face(vertices, corners)
                faces += triangles
                names += [material or part] * len(triangles)
        except (ValueError, IndexError) as error:
            raise SceneError(f"{path.name}, line {number}: {error}") from error
    return np.array(vertices), np.array(faces, np.int64).reshape(-1, 3), names


def _index(item: str, count: int) -> int:
    place = int(item.split("/", maxsplit=1)[0])
    found = place - 1 if place > 0 else count + place
    if not 0 <= found < count:
        raise IndexError(f"there is no vertex {place}")
    return found
