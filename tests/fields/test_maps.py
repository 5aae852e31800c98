# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import numpy as np
from numpy.testing import assert_allclose

from fields import train
from fields.cli import main
from fields.maps import check_reciprocity, make_map
from rir import Pose


def test_map_is_loudest_beside_the_emitter(grid):
    field = train(grid, model="nearest")
    shown = make_map(field, grid.emitters[0], spacing=0.5, frequency=250.0)
    assert shown.loudness_db.shape == (len(shown.y), len(shown.x))
    assert shown.loudness_db.max() == 0.0
    row, column = np.unravel_index(
        np.argmax(shown.loudness_db), shown.loudness_db.shape
    )
    place = np.array([shown.x[column], shown.y[row]])
    assert np.linalg.norm(place - grid.emitters[0].position[:2]) < 1.5


def test_phase_of_a_map_is_that_of_the_responses(grid):
    field = train(grid, model="nearest")
    shown = make_map(field, grid.emitters[1], spacing=1.0, frequency=300.0)
    place = Pose.at(shown.x[1], shown.y[2], shown.height)
    heard = field.predict(grid.emitters[1], place)[0].astype(float)
    turns = np.arange(grid.n_samples) * 300.0 / grid.sample_rate
    expected = np.angle(heard @ np.exp(-2j * np.pi * turns))
    assert_allclose(shown.phase[2, 1], expected, atol=1e-6)


def test_symmetric_field_has_no_swap_gap(grid):
    field = train(grid, model="inras", steps=2, config={"tied": True, "width": 16})
    gap = check_reciprocity(field, pairs=8, rng=np.random.default_rng(0))
    # 0.04 s have no late part, hence no C50.
    assert np.isnan(gap.pop("C50"))
    assert_allclose(list(gap.values()), 0.0, atol=1e-6)


def test_map_command_writes_picture_and_arrays(grid, tmp_path, capsys):
    path = train(grid, model="nearest", exchange=True).save(tmp_path / "field")
    assert main(["map", str(path), "--emitter", "1,2,1.2", "--spacing", "1"]) == 0
    assert (tmp_path / "map.png").exists()
    assert str(np.load(tmp_path / "map.npz")["mark"]) == "SIMULATED"
    assert "SIMULATED" in capsys.readouterr().out


def test_place_that_is_none_is_refused(grid, tmp_path, capsys):
    path = train(grid, model="nearest").save(tmp_path / "field")
    assert main(["map", str(path), "--emitter", "here"]) == 1
    assert "write x,y,z in metres" in capsys.readouterr().err
