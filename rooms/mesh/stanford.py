"""Read PLY files: corners, polygons, and the layers that faces belong to."""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rooms.mesh.polygon import cut_face

__all__ = ["read_stanford"]

_KINDS = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")
_LAYERS = ("layer_id", "layer", "material_id", "material_index", "material")
"""Properties of a face that say which layer or material it belongs to."""


@dataclass
class _Element:
    """What the head of a file says of one kind of rows."""

    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)
    """Name, kind, and kind of the count, empty for one number."""


def read_stanford(path: Path) -> tuple[FloatArray, IntArray, list[str], bool]:
    """Return vertices (V, 3), triangles (F, 3), the layer of each, and if it is single.

    Layers are called as an element ``layer`` or ``material`` says, which lists names as
    characters; else by their number, and "all" if faces state none.

    Raises
    ------
    SceneError
        If the file cannot be understood.
    """
    try:
        return _read(path.read_bytes())
    # whatever a broken file makes of it
    except (ValueError, IndexError, KeyError, struct.error, StopIteration) as error:
        told = str(error) or "it ends too soon"
        raise SceneError(f"{path.name} cannot be read as PLY: {told}") from error


def _read(data: bytes) -> tuple[FloatArray, IntArray, list[str], bool]:
    head, mark, body = data.partition(b"end_header")
    if not data.startswith(b"ply") or not mark:
        raise ValueError("it does not begin with the head of one")
    body = body[body.index(b"\n") + 1 :]
    order, elements = _parse_head(head.decode("ascii", errors="replace"))
    take = _taking(body, order)
    rows = {element.name: list(_rows(element, take)) for element in elements}
    vertices = [[row["x"], row["y"], row["z"]] for row in rows["vertex"]]
    single = any(
        kind in ("float", "float32")
        for element in elements
        for name, kind, _ in element.properties
        if name == "x"
    )
    names = {
        kind: [_text(row) for row in rows[kind]]
        for kind in ("layer", "material")
        if kind in rows
    }
    known = next(iter(names.values()), [])
    faces: list[list[int]] = []
    layers: list[str] = []
    for row in rows["face"]:
        corners = next(row[name] for name in _CORNERS if name in row)
        if len(corners) and not 0 <= min(corners) <= max(corners) < len(vertices):
            raise IndexError(f"a face has a corner that is none of {len(vertices)}")
        triangles = cut_face(vertices, list(corners))
        faces += triangles
        layers += [_layer(row, known)] * len(triangles)
    points = np.array(vertices, dtype=float).reshape(-1, 3)
    return points, np.array(faces, np.int64).reshape(-1, 3), layers, single


def _layer(row: dict[str, Any], names: list[str]) -> str:
    number = next((int(row[name]) for name in _LAYERS if name in row), None)
    if number is None:
        return "all"
    return names[number] if 0 <= number < len(names) else f"layer{number}"


def _text(row: dict[str, Any]) -> str:
    """Return a name that a row lists as characters."""
    letters = next(value for value in row.values() if isinstance(value, tuple))
    return bytes(int(k) & 255 for k in letters).decode("utf-8", "replace").strip("\0 ")


def _parse_head(text: str) -> tuple[str, list[_Element]]:
    """Return the order of bytes and the elements of a file."""
    order, elements = "", []
    for line in text.splitlines()[1:]:
        match line.split():
            case ["format", kind, *_]:
                order = _ORDERS[kind]
            case ["element", name, count]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", size, kind, name]:
                elements[-1].properties.append((name, kind, size))
            case ["property", kind, name]:
                elements[-1].properties.append((name, kind, ""))
    return order, elements


def _taking(body: bytes, order: str) -> Callable[[str, int], tuple[Any, ...]]:
    """Return a function that takes the next numbers of a kind."""
    place, words = 0, body.split() if not order else []

    def take_words(kind: str, count: int) -> tuple[Any, ...]:
        nonlocal place
        some = words[place : place + count]
        place += count
        if len(some) < count:
            raise ValueError("it ends too soon")
        return tuple(map(float if kind in "fd" else int, some))

    def take(kind: str, count: int) -> tuple[Any, ...]:
        nonlocal place
        form = f"{order}{count}{kind}"
        found = struct.unpack_from(form, body, place)
        place += struct.calcsize(form)
        return found

    return take if order else take_words


def _rows(
    element: _Element, take: Callable[[str, int], tuple[Any, ...]]
) -> Iterator[dict[str, Any]]:
    kinds = [
        (name, _KINDS[kind], _KINDS[size] if size else "")
        for name, kind, size in element.properties
    ]
    for _ in range(element.count):
        row: dict[str, Any] = {}
        for name, kind, size in kinds:
            row[name] = take(kind, take(size, 1)[0]) if size else take(kind, 1)[0]
        yield row
