import numpy as np
import pytest

from rigs.cli import main
from rigs.kinds.simulated import SimulatedRig
from rigs.operation.jogging import jog_by_keys
from rigs.planning.envelope import Envelope
from rir.errors import RigError
from rir.pose import Pose

PRESET = "kitchen-simulated"


def test_ports_and_kinds(capsys):
    assert main(["ports"]) == 0
    assert main(["kinds"]) == 0
    assert "grbl" in capsys.readouterr().out


def test_connect_says_what_is_there_and_that_it_is_simulated(capsys):
    assert main(["connect", PRESET]) == 0
    out = capsys.readouterr().out
    assert "SIMULATED" in out
    assert "not been homed" in out
    assert "Grbl 1.1h" in out


def test_home_move_and_draw(capsys):
    goal = ["--emitter", "1.5,1,1", "--listener", "3,1,1.2"]
    assert main(["move", PRESET, *goal, "--yes"]) == 0
    out = capsys.readouterr().out
    assert "(1.500, 1.000, 1.000) m" in out
    assert "E" in out
    assert "▒" in out


def test_a_pose_out_of_reach_is_one_line(capsys):
    goal = ["--emitter", "1.5,1,9", "--listener", "3,1,1.2", "--yes"]
    assert main(["move", PRESET, *goal]) == 1
    assert "beyond the z reach" in capsys.readouterr().err
    assert main(["move", PRESET, "--emitter", "1,2", "--listener", "3,1,1.2"]) == 2


def test_self_test_passes(capsys):
    assert main(["self-test", PRESET, "--count", "3", "--yes"]) == 0
    assert "passed: 3 poses" in capsys.readouterr().out


def test_confirm_tells_the_drift(capsys):
    assert main(["confirm", PRESET, "--yes"]) == 0
    assert "emitter gantry: drift" in capsys.readouterr().out


def test_survey_prints_a_frame(tmp_path, capsys):
    path = tmp_path / "points.yaml"
    path.write_text(
        "points:\n"
        "  - {machine_mm: [0, 0, 0], room_m: [1, 1, 1]}\n"
        "  - {machine_mm: [500, 0, 0], room_m: [1, 1.5, 1]}\n"
        "  - {machine_mm: [0, 300, 0], room_m: [0.7, 1, 1]}\n"
    )
    assert main(["survey", str(path)]) == 0
    out = capsys.readouterr().out
    assert "frame: {origin_m: [1.0, 1.0, 1.0]" in out


def test_order_is_shown_with_its_travel(tmp_path, capsys):
    path = tmp_path / "pairs.yaml"
    path.write_text(
        "pairs: [{a: [1.5, 1, 1], b: [3, 1, 1.2]}, {a: [1, 3, 1], b: [2, 3, 2]}]"
    )
    assert main(["order", PRESET, str(path)]) == 0
    out = capsys.readouterr().out
    assert "travel of both carriers" in out
    assert "·" in out


def test_jogging_by_keys_stays_inside():
    rig = SimulatedRig(
        envelope=Envelope([0, 0, 0], [1, 1, 1]), start=Pose.at(0.95, 0.5, 0.5)
    )
    shown = []
    keys = ["\x1b[C", "+", "\x1b[A", "\x1b[6~", "\x1b[C", "x", "q", "\x1b[D"]
    jog_by_keys(rig, 0.02, shown.append, iter(keys))
    pose = rig.where()
    assert pose is not None
    np.testing.assert_allclose(pose.position, [0.97, 0.54, 0.46])
    assert "beyond the x reach" in shown[-1]


def test_jogging_an_unknown_rig_is_refused():
    with pytest.raises(RigError, match="cannot be jogged"):
        jog_by_keys(SimulatedRig(), 0.01, print, iter(["\x1b[C"]))
