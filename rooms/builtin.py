"""Scenes by name, or from any file that describes a room."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rir import Poses, Registry, RoomSpec
from rir.errors import SceneError
from rir.numbers import shown
from rooms.presets import PRESETS, load_room
from rooms.scene import Scene

__all__ = ["SCENES", "load_place_names", "load_places", "load_scene"]

_MESHES = (".obj", ".ply", ".glb", ".gltf", ".stl", ".off")

SCENES: Registry[Callable[[], Scene]] = Registry("scene")


def _preset(name: str) -> Callable[[], Scene]:
    return lambda: Scene.from_room(load_room(name))


for _name in PRESETS:
    SCENES.add(_name)(_preset(_name))

_FURNISHED: dict[str, Any] = {
    "floor": "furnished_floor",
    "ceiling": "plasterboard_on_studs",
    "all": "furnished_wall",
}


@SCENES.add("l-shaped")
def l_shaped() -> Scene:
    """Return an L-shaped living room: 6 x 5 x 3 m less a 3 x 2.5 m corner."""
    outline = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
    return Scene.extruded(outline, 3.0, _FURNISHED, name="l-shaped")


@SCENES.add("corridor")
def corridor() -> Scene:
    """Return a bare corridor, 18 x 2 x 2.7 m, with a 4 m side arm."""
    outline = [(0, 0), (18, 0), (18, 2), (12, 2), (12, 6), (10, 6), (10, 2), (0, 2)]
    materials = {
        "floor": "linoleum",
        "ceiling": "acoustic_ceiling_tile",
        "all": "plaster_on_masonry",
    }
    return Scene.extruded(outline, 2.7, materials, name="corridor")


@SCENES.add("coupled")
def coupled() -> Scene:
    """Return a hard and a soft room joined by a doorway, with furniture in both."""
    soft = {f"wall{k}": "heavy_curtain" for k in (5, 6)}
    materials = {
        "floor": "wood_floor",
        "ceiling": "plasterboard_on_studs",
        "all": "plaster_on_masonry",
        **soft,
    }
    return _two_rooms(materials, "coupled")


@SCENES.add("coupled-dry")
def coupled_dry() -> Scene:
    """Return the same two rooms with carpet, curtains and an absorbing ceiling."""
    materials = {
        "floor": "carpet_on_felt",
        "ceiling": "acoustic_ceiling_tile",
        "all": "heavy_curtain",
    }
    return _two_rooms(materials, "coupled-dry")


def _two_rooms(materials: dict[str, Any], name: str) -> Scene:
    outline = [
        (0, 0), (5, 0), (5, 1.5), (5.2, 1.5), (5.2, 0), (9.2, 0),
        (9.2, 4), (5.2, 4), (5.2, 2.4), (5, 2.4), (5, 4), (0, 4),
    ]  # fmt: skip
    from rooms.mesh import MeshGeometry

    shell = MeshGeometry.extruded(outline, 2.6)
    boxes = [
        ("table", (1.5, 1.4, 0.02), (2.9, 2.3, 0.75)),
        ("shelves", (0.3, 3.4, 0.02), (2.5, 3.8, 1.9)),
        ("sofa", (8.1, 0.8, 0.02), (9.0, 2.8, 0.8)),
    ]
    furniture = {
        "table": "wood_floor",
        "shelves": "bookshelf",
        "sofa": "audience_on_upholstered_seats",
    }
    geometry = _furnished(shell, boxes)
    return Scene.of_geometry(geometry, furniture | materials, name=name)


def _furnished(shell: Any, boxes: list[tuple[str, Any, Any]]) -> Any:
    """Return a mesh with boxes standing in it, each a surface of its own."""
    from rooms.mesh import MeshGeometry

    vertices, faces = [shell.vertices + shell.origin], [shell.faces]
    names = [shell.surface_names[k] for k in shell.face_surface]
    count = len(vertices[0])
    for name, low, high in boxes:
        box = MeshGeometry.box(np.subtract(high, low))
        vertices.append(box.vertices + box.origin + np.array(low))
        faces.append(box.faces + count)
        names += [name] * len(box.faces)
        count += len(box.vertices)
    return MeshGeometry.from_arrays(
        np.concatenate(vertices), np.concatenate(faces), names
    )


def load_scene(name_or_path: str | Path, materials: Any = None) -> Scene:
    """Return a built-in scene, a room file's, or that of a mesh.

    Parameters
    ----------
    name_or_path : str or Path
        One of `SCENES`; a room YAML; a mesh file; or a folder with meshes, also in
        the layout of iGibson (``mesh_z_up.obj``, or parts in ``shape/collision``);
        else its largest mesh is the room.
    materials : optional
        For meshes; see `rooms.surfaces.resolve_surfaces`. A mesh without known
        materials is given the furnished wall's when left out.

    Raises
    ------
    UnknownNameError
        If it is none of these; lists the built-in names.
    SceneError
        If a folder holds no mesh, or materials are stated for what has its own.

    Examples
    --------
    >>> load_scene("kitchen").name
    'kitchen'
    """
    if not isinstance(name_or_path, str | Path):
        raise SceneError(
            f"a scene is a name or a path, not {shown(name_or_path)}; known names:"
            f" {', '.join(SCENES)}"
        )
    path = Path(name_or_path)
    meshed = path.is_dir() or path.suffix.lower() in _MESHES
    if materials is not None and not meshed:
        raise SceneError(
            f"{name_or_path} has materials of its own; state materials for a mesh only"
        )
    if path.suffix in (".yaml", ".yml"):
        return _from_room_file(path)
    if path.is_dir():
        return _from_folder(path, materials)
    if path.suffix.lower() in _MESHES:
        return _from_mesh(path, materials, path.stem)
    return SCENES[str(name_or_path)]()


def _from_room_file(path: Path) -> Scene:
    room = RoomSpec.load(path)
    if room.mesh is None:
        return Scene.from_room(room)
    materials: dict[str, Any] = {
        name: {
            **surface.model_dump(exclude_none=True),
            "scattering": room.scattering_of(surface),
        }
        for name, surface in room.surfaces.items()
    }
    mesh = path.parent / room.mesh
    return Scene.from_mesh(
        mesh,
        materials or None,
        up=room.mesh_up,
        scale=room.mesh_scale,
        name=room.name,
        air=room.air,
        notes=_left_out(room),
    )


def _left_out(room: RoomSpec) -> tuple[str, ...]:
    """Return what to say of furniture stated beside a mesh."""
    if not room.furniture:
        return ()
    names = ", ".join(box.name for box in room.furniture)
    return (
        f"furniture ({names}) is not simulated: give it as part of the mesh, or the"
        " room as a box",
    )


def load_places(name_or_path: str | Path) -> tuple[Poses | None, Poses | None]:
    """Return the emitters and the listeners that a room file states, or None each.

    Raises
    ------
    ConfigError
        If the file is none of a room.
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        return None, None
    room = RoomSpec.load(path)
    emitters, listeners = (
        Poses.of([place.pose for place in places]) if places else None
        for places in (room.emitters, room.listeners)
    )
    return emitters, listeners


def load_place_names(name_or_path: str | Path) -> tuple[list[str], list[str]]:
    """Return the names of the emitters and listeners that a room file states.

    A place without a name is called by its number: S1, S2, … or R1, R2, …
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        return [], []
    room = RoomSpec.load(path)
    emitters, listeners = (
        [place.name or f"{letter}{k}" for k, place in enumerate(places, start=1)]
        for letter, places in (("S", room.emitters), ("R", room.listeners))
    )
    return emitters, listeners


def _from_mesh(path: Path, materials: Any, name: str) -> Scene:
    if materials is not None:
        return Scene.from_mesh(path, materials, name=name)
    try:
        return Scene.from_mesh(path, name=name)
    except SceneError as error:
        if "no material" not in str(error):
            raise
    return Scene.from_mesh(path, {"all": "furnished_wall"}, name=name)


def _from_folder(folder: Path, materials: Any) -> Scene:
    """Return the scene of a folder with one mesh, or with one per part of a room.

    Two layouts of the iGibson data sets are known: ``mesh_z_up.obj``, and
    ``shape/collision`` with walls, floors and ceilings in files of their own.
    """
    whole = folder / "mesh_z_up.obj"
    parts = _meshes_in(folder / "shape" / "collision")
    if whole.exists() or not parts:
        mesh = whole if whole.exists() else _largest_mesh(folder)
        return _from_mesh(mesh, materials, folder.name)
    geometry = _assembled(parts)
    named = {name: _guess(name) for name in geometry.surface_names}
    chosen = named if materials is None else materials
    return Scene.of_geometry(geometry, chosen, name=folder.name)


def _guess(part: str) -> str:
    """Return a material for a part of a house, by its name."""
    guesses = {"floor": "wood_floor", "ceil": "plasterboard_on_studs"}
    guesses |= {"wall": "plaster_on_masonry", "window": "window_glass"}
    found = [material for word, material in guesses.items() if word in part.lower()]
    return found[0] if found else "furnished_wall"


def _assembled(parts: list[Path]) -> Any:
    """Return one mesh of many files, each a surface named after its file."""
    from rooms.mesh import MeshGeometry
    from rooms.mesh.loading import load_mesh

    vertices, faces, names, count = [], [], [], 0
    for part in parts:
        mesh = load_mesh(part)
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        names += [part.stem] * len(mesh.faces)
        count += len(mesh.vertices)
    return MeshGeometry.from_arrays(
        np.concatenate(vertices), np.concatenate(faces), names
    )


def _meshes_in(folder: Path) -> list[Path]:
    return [p for p in sorted(folder.rglob("*")) if p.suffix.lower() in _MESHES]


def _largest_mesh(folder: Path) -> Path:
    meshes = _meshes_in(folder)
    if not meshes:
        raise SceneError(f"{folder} holds no mesh ({', '.join(_MESHES)})")
    return max(meshes, key=lambda p: p.stat().st_size)
