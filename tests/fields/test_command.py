import csv
import json
import resource
import subprocess
import sys

import pytest
import yaml

from fields.cli import main


@pytest.fixture(scope="module")
def file(pairs, tmp_path_factory):
    return pairs.save(tmp_path_factory.mktemp("data") / "pairs.h5")


@pytest.fixture(scope="module")
def run(file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "first"
    arguments = ["--exchange", "--steps", "3", "--out", str(folder), "--quiet"]
    return folder, main([str(file), *arguments])


def test_run_folder_holds_everything(run):
    folder, code = run
    assert code == 0
    names = {path.name for path in folder.iterdir()}
    assert names >= {
        "config.yaml", "split.json", "checkpoint.pt", "field.pt",
        "table.json", "table.csv", "results.png",
    }  # fmt: skip


def test_table_names_chance_and_the_mark(run):
    folder, _ = run
    table = json.loads((folder / "table.json").read_text())
    methods = [row["method"] for row in table["rows"]]
    assert methods == ["inras", "nearest", "linear", "chance"]
    assert table["mark"] == "SIMULATED"
    with (folder / "table.csv").open() as lines:
        assert next(csv.DictReader(lines))["method"] == "inras"


def test_configuration_is_plain_yaml(run):
    folder, _ = run
    plain = yaml.safe_load((folder / "config.yaml").read_text())
    assert plain["schema"] == 1
    assert plain["model"] == "inras"
    assert plain["training"]["exchange"] == "double"


def test_summary_has_five_lines(file, tmp_path, capsys):
    arguments = ["--model", "nearest", "--out", str(tmp_path / "n"), "--quiet"]
    assert main([str(file), *arguments]) == 0
    lines = capsys.readouterr().out.strip().splitlines()
    assert lines[-5].startswith("SIMULATED data, model nearest")
    assert str(tmp_path / "n" / "field.npz") in lines[-2]


def test_curves_and_a_map_are_in_the_run_folder(run):
    folder, _ = run
    with (folder / "curves.csv").open() as lines:
        steps = [int(row["step"]) for row in csv.DictReader(lines)]
    assert steps == sorted(set(steps))
    assert steps[-1] <= 3
    for name in ("curves.png", "map.png", "map.npz", "results.png"):
        assert (folder / name).stat().st_size > 1000


def test_event_files_are_written_for_tensorboard(file, tmp_path):
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing import event_accumulator

    out = tmp_path / "t"
    arguments = ["--model", "inras", "--steps", "3", "--quiet", "--tensorboard"]
    assert main([str(file), *arguments, "--out", str(out)]) == 0
    events = event_accumulator.EventAccumulator(str(out / "tensorboard"))
    events.Reload()
    assert "unseen emitters/C50" in events.Tags()["scalars"]
    assert len(events.Scalars("training/loss")) == 3


def test_full_folder_is_not_overwritten(run, file, capsys):
    folder, _ = run
    assert main([str(file), "--out", str(folder)]) == 1
    error = capsys.readouterr().err
    assert "--resume" in error
    assert error.count("\n") == 1


def test_finished_run_resumes_to_the_same_end(run, file):
    folder, _ = run
    before = (folder / "table.json").read_text()
    arguments = ["--exchange", "--steps", "3", "--out", str(folder), "--quiet"]
    assert main([str(file), *arguments, "--resume"]) == 0
    after = json.loads((folder / "table.json").read_text())
    assert after["rows"][0]["C50"] == json.loads(before)["rows"][0]["C50"]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["--model", "nerf"], 1),
        (["--budget", "soon"], 1),
        (["--steps", "0"], 1),
        (["--set", "octaves=99"], 1),
        (["--model", "avr", "--set", "head=wide"], 1),
        (["--split", "absent.json"], 1),
        (["--out", __file__], 1),
        (["--nonsense"], 2),
    ],
)
def test_mistakes_have_their_exit_code(file, tmp_path, arguments, code):
    assert main([str(file), "--out", str(tmp_path / "x"), *arguments]) == code


def test_models_are_listed(capsys):
    assert main(["list"]) == 0
    assert "inras" in capsys.readouterr().out


def _cpu_seconds(arguments):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def test_help_is_quick():
    code = "from fields.cli import main; main(['--help'])"
    bare = min(_cpu_seconds(["-c", "pass"]) for _ in range(3))
    ours = min(_cpu_seconds(["-c", code]) for _ in range(3))
    assert ours - bare < 0.3
