import numpy as np
import pytest

from rir.errors import SceneError
from rooms import Scene, plan_effects
from rooms.mesh import MeshGeometry

FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]


def without(room, names, extra=None):
    """Return a room that lacks some surfaces, and has more triangles."""
    kept = [
        k
        for k in range(len(room.faces))
        if room.surface_names[room.face_surface[k]] not in names
    ]
    points, faces = room.vertices + room.origin, room.faces[kept]
    if extra is not None:
        faces = np.concatenate([faces, np.asarray(extra[1]) + len(points)])
        points = np.concatenate([points, extra[0]])
    return MeshGeometry.from_arrays(points, faces)


def test_an_open_l_has_its_own_volume_and_not_its_hulls():
    room = without(MeshGeometry.extruded(FLOOR, 3), ("wall1",))
    assert not room.watertight
    np.testing.assert_allclose(room.volume, 67.5, rtol=0.02)
    np.testing.assert_allclose(room.areas.sum(), 111 - 7.5)
    np.testing.assert_allclose(room.reach.open_length, 11.0)
    assert abs(room.volume - 67.5) < 3 * room.reach.error


def test_a_missing_ceiling_is_an_opening_that_absorbs():
    room = without(MeshGeometry.box((6, 5, 3)), ("ceiling",))
    np.testing.assert_allclose(room.volume, 90, rtol=0.02)
    # of 126 m2 around the air 30 are open
    np.testing.assert_allclose(room.open_share, 30 / 126, atol=0.02)
    scene = Scene.of_geometry(room, 0.2)
    closed = Scene.shoebox(
        (6, 5, 3), absorption={"all": 0.2, "ceiling": 1.0}
    ).eyring_t60(air=False)
    np.testing.assert_allclose(scene.eyring_t60(air=False), closed, rtol=0.04)
    said = " ".join(scene.remarks)
    assert "about 8" in said
    assert "22 m of edges are free" in said


def test_a_panel_in_the_air_counts_on_both_sides_and_its_back_outside_does_not():
    plate = np.array([[1.0, 1, 1.5], [3, 1, 1.5], [3, 3, 1.5], [1, 3, 1.5]])
    box = MeshGeometry.box((6, 5, 3))
    room = without(box, ("x1",), (plate, [[0, 1, 2], [0, 2, 3]]))
    np.testing.assert_allclose(room.areas.sum(), 126 - 15 + 2 * 4)


def test_a_cavity_is_no_part_of_the_room():
    cavity = MeshGeometry.box((3, 2, 2))
    points = cavity.vertices + cavity.origin + [1.5, 1.5, 0.5]
    room = without(MeshGeometry.box((6, 5, 3)), ("x1",), (points, cavity.faces))
    np.testing.assert_allclose(room.volume, 90 - 12, rtol=0.02)
    np.testing.assert_allclose(room.areas.sum(), 126 - 15 + 32)


def test_closed_rooms_say_nothing_and_a_plate_has_no_room():
    room = MeshGeometry.extruded(FLOOR, 3)
    assert room.estimates == ()
    assert room.open_share == 0
    assert room.volume == pytest.approx(67.5, rel=1e-12)
    plate = MeshGeometry.from_arrays(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    assert plate.reach.volume == 0
    assert np.all(np.isfinite(Scene.of_geometry(plate, 0.2).eyring_t60()))


def test_a_single_plate_is_told_to_hold_no_air(tmp_path):
    path = tmp_path / "plate.obj"
    path.write_text("v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3\nf 1 3 4\n")
    scene = Scene.from_mesh(path, {"all": "brick"})
    with pytest.raises(SceneError, match="the mesh holds no air"):
        plan_effects(scene, sample_rate=4000, duration=0.05)
