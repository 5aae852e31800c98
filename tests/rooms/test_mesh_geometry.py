import struct
from typing import Any

import numpy as np
import pytest

from rir.errors import SceneError
from rooms.mesh import MeshGeometry

FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]


def split_up(geometry, times):
    """Cut every triangle into four, again and again."""
    corners = geometry.corners + geometry.origin
    for _ in range(times):
        a, b, c = np.moveaxis(corners, 1, 0)
        d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate(
            [np.stack(t, 1) for t in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
        )
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


def test_extruded_room_has_the_volume_and_areas_of_its_floor():
    room = MeshGeometry.extruded(FLOOR, 3)
    np.testing.assert_allclose(room.volume, 67.5)
    np.testing.assert_allclose(room.areas[:2], 22.5)
    np.testing.assert_allclose(room.areas.sum(), 2 * 22.5 + 3 * 22)
    assert room.watertight
    assert not room.convex
    assert len(room.panels) == 8


def test_normals_point_into_the_air_whatever_the_winding():
    room = MeshGeometry.box((6, 5, 3))
    rng = np.random.default_rng(3)
    faces = np.array([rng.permutation(face) for face in room.faces])
    again = MeshGeometry.from_arrays(room.vertices, faces)
    centers = again.corners.mean(axis=1)
    normals = again.tables.planes[:, :3]
    assert np.all(np.einsum("ij,ij->i", centers, normals) < 0)
    assert any("turned" in line for line in again.report)


def test_furniture_faces_the_air_and_is_outside_it():
    shell, box = MeshGeometry.box((6, 5, 3)), MeshGeometry.box((1, 1, 1))
    vertices = np.concatenate(
        [shell.vertices + shell.origin, box.vertices + box.origin + [2, 2, 0.5]]
    )
    faces = np.concatenate([shell.faces, box.faces + len(shell.vertices)])
    room = MeshGeometry.from_arrays(vertices, faces)
    np.testing.assert_allclose(room.volume, 89.0)
    outside = room.outside([[2.5, 2.5, 1.0], [2.5, 2.5, 2.5], [7, 1, 1]])
    assert outside.tolist() == [True, False, True]
    assert room.visible([[0.5, 2.5, 1.0]], [[5.5, 2.5, 1.0]]).tolist() == [False]


def test_points_on_walls_and_edges_count_as_inside():
    room = MeshGeometry.extruded(FLOOR, 3)
    points = [[0, 1, 1], [3, 4, 1], [0, 0, 0], [3, 2.5, 1.5], [4.5, 4, 1]]
    assert room.outside(points).tolist() == [False, False, False, False, True]


def test_faults_are_repaired_and_told():
    room = MeshGeometry.box((6, 5, 3))
    vertices = np.concatenate([room.vertices, room.vertices[:1] + 1e-8])
    faces = np.concatenate([room.faces, room.faces[:2], [[0, 0, 1], [0, 8, 1]]])
    faces[0, faces[0] == 0] = 8
    fixed = MeshGeometry.from_arrays(vertices, faces)
    assert fixed.watertight
    assert len(fixed.faces) == 12
    told = " ".join(fixed.report)
    assert "closed 1 cracks" in told
    assert "dropped 2 triangles without an area" in told
    assert "dropped 2 triangles that stood twice" in told


def test_open_mesh_is_told_and_kept_open():
    room = MeshGeometry.box((6, 5, 3))
    lid_off = MeshGeometry.from_arrays(room.vertices + room.origin, room.faces[:-2])
    assert not lid_off.watertight
    assert any("4 open edges" in line for line in lid_off.report)
    assert lid_off.outside([[3, 2, 1], [9, 2, 1]]).tolist() == [False, True]


def test_panels_do_not_depend_on_triangulation():
    room = MeshGeometry.extruded(FLOOR, 3)
    fine = MeshGeometry.from_arrays(*split_up(room, 2))
    assert len(fine.faces) == 16 * len(room.faces)
    assert len(fine.panels) == 8


@pytest.mark.parametrize(
    ("vertices", "faces", "match"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "shape"),
        (np.zeros((3, 3)), np.zeros((0, 3)), "F > 0"),
        (np.zeros((3, 3)), [[0, 1, 3]], "name vertices 0…3"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "not finite"),
        (np.zeros((3, 3)), [[0, 1, 2]], "1e-6 to 1e7 m across, not 0 m"),
    ],
)
def test_useless_arrays_are_refused(vertices, faces, match):
    with pytest.raises(SceneError, match=match):
        MeshGeometry.from_arrays(vertices, faces)


@pytest.mark.parametrize(
    ("floor", "match"),
    [
        ([(0, 0), (1, 0)], "3 or more"),
        ([(0, 0), (1, 0), (2, 0)], "no area"),
        ([(0, 0), (4, 0), (0, 2), (3, 3)], "crosses itself"),
    ],
)
def test_useless_floors_are_refused(floor, match):
    with pytest.raises(SceneError, match=match):
        MeshGeometry.extruded(floor, 3)


@pytest.mark.parametrize("ending", ["obj", "ply", "glb", "stl"])
def test_files_give_back_the_room(tmp_path, ending):
    trimesh = pytest.importorskip("trimesh")
    room = MeshGeometry.extruded(FLOOR, 3)
    mesh = trimesh.Trimesh(room.vertices + room.origin, room.faces, process=False)
    mesh.export(tmp_path / f"room.{ending}")
    read = MeshGeometry.from_file(tmp_path / f"room.{ending}")
    assert read.watertight
    assert len(read.panels) == 8
    np.testing.assert_allclose(read.volume, 67.5, rtol=1e-6)
    np.testing.assert_allclose(np.sort(read.size), [3, 5, 6], rtol=1e-6)


def layered(binary):
    """Return a PLY of a tetrahedron whose faces belong to named layers."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [((0, 2, 1), 0), ((0, 1, 3), 0), ((0, 3, 2), 1), ((1, 2, 3), 1)]
    names = [b"floor", b"side wall"]
    kind = "binary_little_endian" if binary else "ascii"
    head = (
        f"ply\nformat {kind} 1.0\ncomment made by hand\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\nelement face 4\n"
        "property list uchar uint vertex_indices\nproperty uint layer_id\n"
        "element layer 2\nproperty list uchar uchar layer_name\nend_header\n"
    )
    if binary:
        body = b"".join(struct.pack("<3f", *corner) for corner in corners)
        body += b"".join(struct.pack("<B3II", 3, *face, k) for face, k in faces)
        return head.encode() + body + b"".join(bytes([len(n)]) + n for n in names)
    rows = [*corners, *((3, *face, k) for face, k in faces)]
    rows += [(len(name), *name) for name in names]
    return (head + "\n".join(" ".join(map(str, row)) for row in rows)).encode()


@pytest.mark.parametrize("binary", [False, True])
def test_layers_of_ply_files_are_surfaces(tmp_path, binary):
    (tmp_path / "room.ply").write_bytes(layered(binary))
    room = MeshGeometry.from_file(tmp_path / "room.ply")
    assert room.surface_names == ("floor", "side wall")
    np.testing.assert_allclose(room.areas, [1.0, 0.5 + np.sqrt(0.75)], rtol=1e-6)
    (tmp_path / "cut.ply").write_bytes(layered(binary)[:-20])
    with pytest.raises(SceneError, match=r"cut\.ply cannot be read as PLY"):
        MeshGeometry.from_file(tmp_path / "cut.ply")


def test_obj_files_name_surfaces_and_may_hold_any_polygon(tmp_path):
    corners = [(*point, z) for z in (0, 3) for point in FLOOR]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["usemtl carpet", "f 6 5 4 3 2 1", "usemtl plaster"]
    lines += ["f 7//1 8//1 9//1 10//1 11//1 12//1", "usemtl brick"]
    lines += [
        f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}" for k in range(6)
    ]
    (tmp_path / "room.obj").write_text("\n".join(lines))
    room = MeshGeometry.from_file(tmp_path / "room.obj")
    assert room.surface_names == ("carpet", "plaster", "brick")
    np.testing.assert_allclose(room.areas, [22.5, 22.5, 66])
    assert room.watertight
    (tmp_path / "room.obj").write_text("v 0 0 0\nf 1 2 3")
    with pytest.raises(SceneError, match="line 2: there is no vertex 2"):
        MeshGeometry.from_file(tmp_path / "room.obj")
    (tmp_path / "room.obj").write_text("hello")
    with pytest.raises(SceneError, match="holds no triangles"):
        MeshGeometry.from_file(tmp_path / "room.obj")


def test_single_precision_far_from_the_origin_still_closes(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    room = MeshGeometry.extruded(FLOOR, 3)
    far = room.vertices + np.array([10_000.0, 10_000.0, 0.0])
    trimesh.Trimesh(far, room.faces, process=False).export(tmp_path / "far.stl")
    read = MeshGeometry.from_file(tmp_path / "far.stl")
    assert read.watertight
    assert len(read.panels) == 8


def test_unknown_and_missing_files_are_refused(tmp_path):
    with pytest.raises(SceneError, match="known endings"):
        MeshGeometry.from_file(tmp_path / "room.dwg")
    with pytest.raises(SceneError, match="no mesh file"):
        MeshGeometry.from_file(tmp_path / "room.obj")


def test_first_hits_match_trying_every_triangle():
    from rooms.mesh.hits import DEPTH, FEW, first_hit

    rng = np.random.default_rng(0)
    middle = rng.uniform(-3, 3, (400, 1, 3))
    corners = middle + rng.uniform(-0.4, 0.4, (400, 3, 3))
    room = MeshGeometry.from_arrays(
        corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3)
    )
    search: Any = first_hit
    owner, keys = np.empty(DEPTH, np.int64), np.empty(16 * DEPTH, np.int32)
    far = np.empty(8 * FEW)
    for _ in range(200):
        origin, way = rng.uniform(-2, 2, 3), rng.standard_normal(3)
        way /= np.linalg.norm(way)
        a, b, c = np.moveaxis(room.corners, 1, 0)
        h = np.cross(way, c - a)
        det = np.einsum("ij,ij->i", b - a, h)
        s = origin - a
        q = np.cross(s, b - a)
        u, v = np.einsum("ij,ij->i", s, h) / det, q @ way / det
        t = np.einsum("ij,ij->i", c - a, q) / det
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        wanted = np.where(met, t, np.inf).min()
        got, face = search(*room.hierarchy.arrays, *origin, *way, 1e9, owner, keys, far)
        if np.isfinite(wanted):
            np.testing.assert_allclose(got, wanted, rtol=1e-9)
        else:
            assert face == -1
