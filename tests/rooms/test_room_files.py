"""Rooms as they are published: a measured cuboid, a hall of named materials."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from rir import RoomSpec
from rir.errors import ConfigError, SceneError
from rir.room import per_octave
from rooms import Scene, simulate
from rooms.builtin import load_places, load_scene
from rooms.cli import main
from rooms.mesh import find_paths
from rooms.parameters import hall_parameters

CUBOID = """
name: cuboid
size_m: [5.74, 4.36, 2.87]
air: {temperature_c: 24.3, humidity_percent: 38}
surfaces:
  all: {absorption: {125: 0.05, 1000: 0.08, 4000: 0.10}, scattering: 0.02}
  floor: {absorption: [0.04, 0.04, 0.05, 0.06, 0.07, 0.08]}
emitters: [[1.32, 1.21, 1.05]]
listeners: [{at: [4.11, 2.76, 1.4], yaw_deg: 90, name: M1}, [3.2, 3.4, 1.1]]
"""
HALL = """
name: hall
mesh: hall.obj
default_scattering: 0.1
surfaces:
  stage floor: {absorption: [0.14, 0.10, 0.06, 0.05, 0.05, 0.04]}
  "seat*": {absorption: {125: 0.4, 1000: 0.9}, scattering: 0.6}
  walls: {absorption: 0.1}
emitters: [[1, 3, 2]]
listeners: [[7, 3, 2], [9, 5, 2]]
"""
OBJ = """mtllib hall.mtl
o shell
v 0 0 0
v 10 0 0
v 10 6 0
v 0 6 0
v 0 0 5
v 10 0 5
v 10 6 5
v 0 6 5
v 4 0 0
v 4 6 0
usemtl stage floor
f 1/1/1 9/1/1 10/1/1 4/1/1
usemtl seats.001
f 9 2 3 10
usemtl walls
f 5 8 7 6
f 1 5 6 2 9
f 2 6 7 3
f 3 7 8 4 10
f 4 8 5 1
"""


@pytest.fixture
def hall(tmp_path):
    (tmp_path / "hall.obj").write_text(OBJ)
    path = tmp_path / "hall.yaml"
    path.write_text(HALL)
    return path


@pytest.fixture
def cuboid(tmp_path):
    path = tmp_path / "cuboid.yaml"
    path.write_text(CUBOID)
    return path


@pytest.mark.parametrize("wall", range(6))
def test_first_order_echoes_of_a_measured_cuboid_come_on_time(cuboid, wall):
    scene, (emitters, listeners) = load_scene(cuboid), load_places(cuboid)
    assert emitters is not None
    assert listeners is not None
    c, rate = 331.3 * math.sqrt(1 + 24.3 / 273.15), 48000
    np.testing.assert_allclose(scene.speed_of_sound, c, rtol=1e-3)
    # only one wall mirrors, so that no echo hides another
    absorption = np.ones((6, 7))
    absorption[wall] = scene.absorption[wall]
    made = simulate(
        replace(scene, absorption=absorption), emitters, listeners,
        sample_rate=rate, duration=0.06, effects=["direct", "specular"],
    ).responses[0]  # fmt: skip
    plane = [5.74, 4.36, 2.87][wall // 2] * (wall % 2)
    image = emitters.positions[0].copy()
    image[wall // 2] = 2 * plane - image[wall // 2]
    for ear, response in zip(listeners.positions, made, strict=True):
        direct, echo = (
            np.linalg.norm(place - ear) / scene.speed_of_sound
            for place in (emitters.positions[0], image)
        )
        after = np.abs(response)
        after[: round(direct * rate) + 12] = 0.0
        assert abs(np.argmax(after) / rate - echo) < 0.03e-3


def test_places_and_headings_are_read_from_the_room_file(cuboid):
    emitters, listeners = load_places(cuboid)
    assert emitters is not None
    assert listeners is not None
    np.testing.assert_allclose(emitters.positions, [[1.32, 1.21, 1.05]])
    np.testing.assert_allclose(listeners.forward, [[0, 1, 0], [1, 0, 0]], atol=1e-12)
    assert load_places("kitchen") == (None, None)


def test_materials_of_a_mesh_are_found_by_name_and_pattern(hall):
    scene = load_scene(hall)
    names = scene.geometry.surface_names  # pyright: ignore[reportAttributeAccessIssue]
    stage, seats, walls = (
        names.index(name) for name in ("stage floor", "seats.001", "walls")
    )
    np.testing.assert_allclose(
        scene.absorption[stage], [0.14, 0.10, 0.06, 0.05, 0.05, 0.04, 0.04]
    )
    np.testing.assert_allclose(scene.absorption[seats, [0, 3, 6]], [0.4, 0.9, 0.9])
    np.testing.assert_allclose(
        scene.scattering[[stage, seats, walls], 0], [0.1, 0.6, 0.1]
    )
    np.testing.assert_allclose(scene.geometry.volume, 300.0)
    assert not any("no scattering" in remark for remark in scene.remarks)


def test_a_hall_decays_as_its_absorption_says(hall):
    scene, (emitters, listeners) = load_scene(hall), load_places(hall)
    assert emitters is not None
    assert listeners is not None
    made = simulate(
        scene, emitters, listeners, sample_rate=8000, duration=1.2, rays=3000
    )
    way = np.linalg.norm(listeners.positions - emitters.positions, axis=1)
    arrival = way[None] / scene.speed_of_sound
    found = hall_parameters(made.responses, 8000, arrival, [500.0, 1000.0])
    # soft floor under hard walls: slower than Eyring's mean, by no more than half
    ratio = found["T30"].mean(axis=(0, 1)) / scene.eyring_t60()[[2, 3]]
    assert np.all((ratio > 0.95) & (ratio < 1.6))


def test_shares_by_frequency_are_interpolated_over_its_logarithm():
    over = per_octave({250: 0.1, 1000: 0.3})
    np.testing.assert_allclose(over, [0.1, 0.1, 0.2, 0.3, 0.3, 0.3, 0.3])
    thirds = {f: 0.1 * math.log10(f) for f in (100, 315, 800, 2500, 10000)}
    np.testing.assert_allclose(
        per_octave(thirds), 0.1 * np.log10(125 * 2.0 ** np.arange(7)), atol=1e-9
    )


def test_what_mirrors_only_is_told(hall):
    hall.write_text(HALL.replace("default_scattering: 0.1\n", ""))
    told = " ".join(load_scene(hall).remarks)
    assert "no scattering is stated for stage floor, walls" in told


def test_mistakes_of_room_files_are_told(hall, cuboid):
    hall.write_text(HALL.replace("walls:", "wals:"))
    with pytest.raises(SceneError, match="no surface 'wals' in the mesh; it has"):
        load_scene(hall)
    hall.write_text(HALL.replace("0.04]", "0.04, 0.1, 0.1]"))
    with pytest.raises(ConfigError, match="absorption needs 1, 6 or 7 values"):
        load_scene(hall)
    cuboid.write_text(CUBOID.replace("size_m: [5.74, 4.36, 2.87]\n", ""))
    with pytest.raises(ConfigError, match="state size_m"):
        load_scene(cuboid)
    hall.write_text(HALL)
    with pytest.raises(SceneError, match="hall is a mesh"):
        Scene.from_room(RoomSpec.load(hall))


def test_the_command_simulates_between_the_places_of_the_file(hall, capsys):
    out = hall.with_name("hall.npz")
    options = ["--parameters", "--duration", "0.8", "--sample-rate", "4000"]
    more = ["--rays", "500", "--temperature", "25", "--out", str(out)]
    assert main([str(hall), *options, *more]) == 0
    printed = capsys.readouterr().out
    for word in ("SIMULATED", "T30 s", "C80 dB", "G dB", "TS ms", "125 Hz"):
        assert word in printed
    with np.load(out) as made:
        assert made["responses"].shape == (1, 2, 3200)
        np.testing.assert_allclose(made["listener_positions"], [[7, 3, 2], [9, 5, 2]])
        assert "late" in json.loads(str(made["plan"]))["plan"]


def test_files_in_millimetres_with_y_up_are_the_same_room(hall):
    lines = []
    for line in OBJ.splitlines():
        if line.startswith("v "):
            x, y, z = (1000 * float(part) for part in line.split()[1:])
            line = f"v {x} {z} {-y}"
        lines.append(line)
    hall.with_name("mm.obj").write_text("\n".join(lines))
    other = hall.with_name("mm.yaml")
    text = HALL.replace("mesh: hall.obj", "mesh: mm.obj")
    other.write_text(text + "mesh_up: y\nmesh_scale: 0.001\n")
    one, two = load_scene(hall), load_scene(other)
    np.testing.assert_allclose(two.geometry.size, one.geometry.size, rtol=1e-9)
    np.testing.assert_allclose(two.geometry.center, one.geometry.center, atol=1e-9)
    run = {"sample_rate": 8000, "duration": 0.05, "effects": ["direct", "specular"]}
    made = [simulate(s, [1, 3, 2], [7, 3, 2], **run).responses for s in (one, two)]
    np.testing.assert_allclose(made[1], made[0], atol=1e-6 * np.abs(made[0]).max())


def test_reflectors_that_hang_in_a_hall_leave_its_volume_and_its_outside(hall):
    hanging = "v 3 2 4\nv 5 2 4\nv 5 4 4\nv 3 4 4\nusemtl walls\nf 11 12 13 14\n"
    hall.with_name("hall.obj").write_text(OBJ + hanging)
    scene = load_scene(hall)
    np.testing.assert_allclose(scene.geometry.volume, 300.0)
    points = [[4, 3, 3.9], [4, 3, 4.1], [4, 3, 5.1], [10.1, 3, 2]]
    assert scene.geometry.outside(points).tolist() == [False, False, True, True]
    assert any("in a closed shell" in remark for remark in scene.remarks)
    # the reflector sends sound from below back
    ends = [4, 3, 2.5], [[4.2, 3, 2.5]]
    paths = find_paths(scene.geometry, *ends, max_order=1)  # pyright: ignore[reportArgumentType]
    assert np.abs(paths.length - np.hypot(3.0, 0.2)).min() < 1e-9
