"""The command find-room: walls, plan and room of a data set, without torch."""

import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from inverse import Acoustics
from inverse.cli import main
from inverse.find import room_in_rows
from rir import Dataset

ALONE = """
import sys

class Missing:
    def find_spec(self, name, *_):
        if name.split(".")[0] in ("torch", "fields"):
            raise ImportError(name)

sys.meta_path.insert(0, Missing())
from inverse.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def file(box_set, tmp_path_factory):
    ends = box_set.emitters, box_set.listeners
    data = Dataset.from_arrays(box_set.responses, *ends, sample_rate=16000)
    return data.save(tmp_path_factory.mktemp("data") / "box.h5")


def test_the_walls_of_a_box_are_found_in_a_process_without_torch(
    file, tmp_path, unseen_set
):
    out = tmp_path / "found"
    command = [sys.executable, "-c", ALONE, str(file), "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "SIMULATED" in done.stdout
    assert "6 walls found" in done.stdout
    plan = json.loads((out / "plan.json").read_text())
    assert plan["mark"] == "SIMULATED"
    offsets = sorted(wall["offset_m"] for wall in plan["walls"])
    assert_allclose(offsets, [-5.0, -4.0, -2.8, 0, 0, 0], atol=1e-3)
    assert (out / "plan.png").stat().st_size > 10_000
    again = Acoustics.load(out / "room.npz")
    ends = unseen_set.emitters, unseen_set.listeners, unseen_set.n_samples
    answer = again.predict(*ends)
    # a data set is scaled before walls are found in it
    scale = (answer * unseen_set.responses).sum() / (answer**2).sum()
    error = ((scale * answer - unseen_set.responses) ** 2).sum()
    assert error < 1e-3 * (unseen_set.responses**2).sum()


def test_a_sofa_file_is_read_and_its_mark_never_guessed(file, tmp_path, capsys):
    pytest.importorskip("sofar")
    from rir.files import FORMATS

    sofa = tmp_path / "few.sofa"
    FORMATS["sofa"].write(Dataset.open(file).subset(np.arange(4)), sofa)
    out = ["--out", str(tmp_path / "out"), "--quiet"]
    assert main([str(sofa), *out]) == 0
    assert "SIMULATED data: 4 responses" in capsys.readouterr().out
    for source in (sofa, file):
        assert main([str(source), *out, "--measured"]) == 1
        told = f"{source} says SIMULATED: leave out --measured"
        assert told in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_told_before_the_search(file, tmp_path, capsys):
    (tmp_path / "taken").write_text("")
    assert main([str(file), "--out", str(tmp_path / "taken"), "--quiet"]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert "cannot use" in told.err


def test_what_cannot_be_used_is_told_in_one_line(file, tmp_path, capsys):
    wrong = [
        [str(tmp_path / "nowhere")],
        [str(file), "--reach", "0"],
        [str(file), "--pose-error", "nan"],
        [str(file), "--drawn", "no-such-scene"],
    ]
    for arguments in wrong:
        assert main([*arguments, "--quiet"]) == 1
        told = capsys.readouterr().err
        assert told.startswith("find-room: ")
        assert told.count("\n") == 1


def test_a_set_too_small_for_walls_is_told_so(tmp_path, capsys, box_set):
    few = box_set.rows(np.arange(4))
    ends = few.emitters, few.listeners
    data = Dataset.from_arrays(few.responses, *ends, sample_rate=16000)
    file = data.save(tmp_path / "few.h5")
    assert main([str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    shown = capsys.readouterr().out
    assert "0 walls found" in shown
    assert "too few" in shown


def test_rooms_of_other_programs_are_refused(tmp_path, box_set):
    from rir.errors import DatasetError

    kept = room_in_rows(box_set.rows(np.arange(4)))
    path = kept.save(tmp_path / "room.npz")
    assert Acoustics.load(path).alarms == kept.alarms
    (tmp_path / "other.npz").write_text("no arrays")
    with pytest.raises(DatasetError, match="found room"):
        Acoustics.load(tmp_path / "other.npz")
