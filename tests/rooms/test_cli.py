import json
from pathlib import Path

import numpy as np
import pytest

from rir import Dataset, GainPattern
from rir.errors import ConfigError, SceneError, SignalError, UnknownNameError
from rooms import Scene, plan_effects, simulate
from rooms.builtin import SCENES, load_scene
from rooms.cli import main
from rooms.effort import parse_accuracy
from rooms.gains import load_gain
from rooms.places import grid_places, random_places
from rooms.writing import check_target

FAST = ["--sample-rate", "8000", "--duration", "0.1"]


def test_explain_names_every_effect_and_writes_nothing(capsys):
    assert main(["kitchen", "--explain", *FAST]) == 0
    shown = capsys.readouterr().out
    assert "SIMULATED" in shown
    for name in ("patterns", "scattering", "air", "direct", "specular", "late"):
        assert name in shown
    assert "refrigerator" in shown
    assert "sound meets" in shown


def test_explain_needs_no_free_place(tmp_path, capsys):
    # a passage 4 cm wide at 45° to the axes
    floor = [(0, 0), (0.06, 0), (5, 4.94), (5, 5)]
    corners = [(x, y, z) for z in (0, 2) for x, y in floor]
    sides = [(k, k % 4 + 1, k % 4 + 5, k + 4) for k in (1, 2, 3, 4)]
    lines = ["v " + " ".join(map(str, corner)) for corner in corners]
    faces = [(4, 3, 2, 1), (5, 6, 7, 8), *sides]
    lines += ["f " + " ".join(map(str, face)) for face in faces]
    room = tmp_path / "passage.obj"
    room.write_text("\n".join(lines))
    assert main([str(room), *FAST]) == 1
    assert "free places" in capsys.readouterr().err
    assert main([str(room), "--explain", *FAST]) == 0
    assert "specular" in capsys.readouterr().out


def test_a_simulation_is_written_as_a_data_set(tmp_path, capsys):
    out = tmp_path / "three.h5"
    places = ["--emitter", "1,1,1.2", "--listener", "3,2,1.2,90"]
    assert main(["kitchen", *FAST, *places, "--out", str(out)]) == 0
    data = Dataset.open(out)
    assert data.simulated
    assert len(data) == 1
    scene = load_scene("kitchen")
    expected = simulate(
        scene, [1, 1, 1.2], data.listeners, sample_rate=8000, duration=0.1
    ).responses[0]
    np.testing.assert_allclose(data.responses[0:1], expected, atol=1e-6)
    assert "late" in json.dumps(data.sessions[0])
    assert "wrote" in capsys.readouterr().out


def test_overrides_decide(capsys):
    assert main(["office", *FAST, "--only", "direct,specular"]) == 0
    assert "effects: direct, specular\n" in capsys.readouterr().out
    assert main(["office", *FAST, "--without", "late, air"]) == 0
    assert "late" not in capsys.readouterr().out.split("effects:")[1]


@pytest.mark.parametrize("other", [["--all"], ["--without", "air"]])
def test_effects_are_not_chosen_in_two_ways(other, capsys):
    assert main(["office", *FAST, "--only", "direct", *other]) == 2
    assert f"--only: it contradicts {other[0]}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bathroom"], "no scene 'bathroom'"),
        (["kitchen", "--only", "dirct"], "did you mean 'direct'"),
        (["kitchen", "--emitter", "9,9,9"], "outside kitchen"),
        (["kitchen", "--emitter", "1,2"], "write x,y,z"),
        (["kitchen", "--accuracy", "C50 1 %"], "C50 is stated in dB"),
        (["kitchen", "--emitter-gain", "conical"], "no gain pattern"),
    ],
)
def test_mistakes_are_one_line(arguments, message, capsys):
    assert main([*arguments, *FAST]) == 1
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1


def test_cost_recommends_a_setting(capsys):
    arguments = ["--sample-rate", "4000", "--duration", "0.1", "--cost"]
    bare = str(Path(__file__).with_name("bare_room.yaml"))
    assert main([bare, *arguments]) == 0
    assert "recommended" in capsys.readouterr().out


@pytest.mark.parametrize("name", list(SCENES))
def test_built_in_scenes_have_places(name):
    scene = load_scene(name)
    rng = np.random.default_rng(0)
    drawn = random_places(scene, 3, rng)
    spread = grid_places(scene, 60)
    assert not scene.geometry.outside(drawn.positions).any()
    assert 30 <= len(spread) <= 60


def test_scenes_from_folders(tmp_path):
    with pytest.raises(SceneError, match="holds no mesh"):
        load_scene(tmp_path)
    with pytest.raises(UnknownNameError, match="no scene"):
        load_scene("cellar")


OBJ = """
v 0 0 0
v 4 0 0
v 4 3 0
v 0 3 0
v 0 0 2.5
v 4 0 2.5
v 4 3 2.5
v 0 3 2.5
"""


def test_a_house_in_parts_becomes_one_room(tmp_path):
    folder = tmp_path / "house" / "shape" / "collision"
    folder.mkdir(parents=True)
    parts = {
        "floor_0": ["1 2 3", "1 3 4"],
        "ceiling_0": ["5 6 7", "5 7 8"],
        "wall_0": [
            "1 2 6",
            "1 6 5",
            "2 3 7",
            "2 7 6",
            "3 4 8",
            "3 8 7",
            "4 1 5",
            "4 5 8",
        ],
    }
    for name, faces in parts.items():
        text = OBJ + "".join(f"f {face}\n" for face in faces)
        (folder / f"{name}.obj").write_text(text)
    scene = load_scene(tmp_path / "house")
    np.testing.assert_allclose(scene.geometry.volume, 30.0)
    assert scene.geometry.surfaces == 3
    assert scene.name == "house"
    assert len(np.unique(scene.absorption[:, 0])) == 3


def test_a_sofa_directivity_becomes_a_pattern(tmp_path):
    sofar = pytest.importorskip("sofar")
    pytest.importorskip("netCDF4")
    cardioid = GainPattern.cardioid()
    azimuth, elevation = np.meshgrid(np.arange(0, 360, 30), np.arange(-75, 90, 30))
    a, e = np.radians(azimuth.ravel()), np.radians(elevation.ravel())
    ways = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=1)
    sofa = sofar.Sofa("FreeFieldDirectivityTF")
    frequencies = np.array([125.0, 500.0, 2000.0, 8000.0])
    gains = np.repeat(cardioid.gain(ways), len(frequencies), axis=1)
    sofa.Data_Real, sofa.Data_Imag = gains[None], np.zeros_like(gains)[None]
    sofa.N = frequencies
    sofa.ReceiverPosition = np.column_stack(
        [azimuth.ravel(), elevation.ravel(), np.ones(azimuth.size)]
    )
    sofa.ReceiverPosition_Type = "spherical"
    sofa.ReceiverPosition_Units = "degree, degree, metre"
    path = tmp_path / "speaker.sofa"
    sofar.write_sofa(str(path), sofa)
    fitted = load_gain(path)
    np.testing.assert_allclose(
        fitted.gain(ways), np.repeat(cardioid.gain(ways), 7, axis=1), atol=1e-6
    )


def test_accuracies_are_read():
    assert parse_accuracy({"C50": 0.1}) == {"clarity_db": 0.1}
    with pytest.raises(SignalError, match="cannot read"):
        parse_accuracy("as good as possible")
    with pytest.raises(SignalError, match="positive"):
        parse_accuracy("C50 0 dB")


def test_a_balloon_file_becomes_a_pattern(tmp_path):
    cardioid = GainPattern.cardioid()
    rows = []
    for azimuth in range(0, 360, 20):
        for elevation in range(-80, 90, 20):
            a, e = np.radians([azimuth, elevation])
            way = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
            rows.append(f"{azimuth}, {elevation}, {2 * cardioid.gain(way)[0]:.9f}")
    path = tmp_path / "balloon.csv"
    path.write_text("azimuth, elevation, gain\n" + "\n".join(rows))
    fitted = load_gain(path)
    ways = np.random.default_rng(0).standard_normal((20, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    np.testing.assert_allclose(fitted.gain(ways), cardioid.gain(ways), atol=1e-6)
    path.write_text("1, 2\n")
    with pytest.raises(ConfigError, match="needs rows"):
        load_gain(path)


def test_an_accuracy_is_reached_in_a_room_that_needs_rays():
    scene = load_scene("l-shaped")
    places = random_places(scene, 3, np.random.default_rng(1))
    run = {"sample_rate": 8000, "duration": 0.3}
    result = simulate(scene, places[:1], places[1:], accuracy="C50 0.1 dB", **run)
    chance = result.error_parts["sampling"]["clarity_db"]
    assert 0 < chance <= 0.1
    rough = simulate(scene, places[:1], places[1:], rays=1000, **run)
    assert rough.error_parts["sampling"]["clarity_db"] > chance
    assert result.errors["clarity_db"] > chance


def test_what_is_off_is_not_imported():
    import subprocess
    import sys

    program = (
        "import sys; from rooms import Scene, simulate;"
        "simulate(Scene.shoebox((6, 5, 3)), [1, 1, 1], [2, 2, 2], sample_rate=8000,"
        " duration=0.05, effects=['direct']);"
        "print([m for m in sys.modules if m.startswith(('rooms.mesh', 'rooms.rays'))])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_a_plan_says_why():
    plan = plan_effects(Scene.shoebox((6, 5, 3), absorption=1.0), duration=0.1)
    assert plan.on == ["air", "direct"] or plan.on == ["direct"]
    assert all(verdict.reason for verdict in plan.verdicts.values())
    everything = plan_effects(Scene.shoebox((6, 5, 3)), everything=True)
    assert set(everything.on) == set(everything.verdicts)


@pytest.mark.parametrize(
    ("name", "word"), [("made.txt", "end it in"), ("kept.h5/made.h5", "no folder")]
)
def test_a_target_is_checked_before_anything_is_computed(
    tmp_path: Path, name: str, word: str
):
    (tmp_path / "kept.h5").write_text("a file")
    with pytest.raises(ConfigError, match=word):
        check_target(tmp_path / name)
    check_target(tmp_path / "new" / "made.h5")


def test_materials_are_for_meshes():
    with pytest.raises(SceneError, match="materials of its own"):
        load_scene("kitchen", "concrete")
