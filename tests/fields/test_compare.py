# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import json
from dataclasses import fields

import pytest
import yaml

from fields import FIELDS
from fields.cli import main
from fields.comparison.config import FORMS, comparison_names, load_comparisons
from rir.cost import CostCurve
from rooms.builtin import SCENES


@pytest.fixture
def config(grid, tmp_path):
    path = grid.save(tmp_path / "grid.h5")
    plain = {
        "title": "small",
        "budget_s": 0.2,
        "seeds": [0, 1],
        "sets": [{"path": str(path)}],
        "models": [
            {"model": "inras", "config": {"width": 8, "depth": 1}},
            {
                "model": "avr",
                "config": {"rays": 4, "shells": 4, "width": 8, "channels": 2},
                "forms": ["vanilla", "ssl"],
            },
        ],
    }
    file = tmp_path / "compare.yaml"
    file.write_text(yaml.safe_dump(plain))
    return file


def test_comparison_makes_a_table_and_goes_on_where_it_stopped(config, tmp_path):
    out = tmp_path / "out"
    assert main(["compare", str(config), "--out", str(out)]) == 0
    table = json.loads((out / "grid" / "table.json").read_text())
    methods = [row["method"] for row in table["rows"]]
    assert methods == [
        "inras vanilla", "inras exchange", "avr vanilla", "avr ssl",
        "nearest", "nearest exchange", "linear", "chance",
    ]  # fmt: skip
    assert table["rows"][0]["spread STFT"] >= 0
    assert "train C50" in table["rows"][0]
    assert any("converged" in note for note in table["notes"])
    assert (out / "grid" / "seconds.png").exists()
    jobs = sorted((out / "jobs").iterdir())
    before = [job.stat().st_mtime_ns for job in jobs]
    jobs[0].unlink()
    assert main(["compare", str(config), "--out", str(out)]) == 0
    after = [job.stat().st_mtime_ns for job in jobs]
    assert after[0] != before[0]
    assert after[1:] == before[1:]


@pytest.mark.parametrize("name", ["same", "diff", *comparison_names()])
@pytest.mark.parametrize("size", ["cpu", "paper"])
def test_built_in_comparisons_name_what_exists(name, size):
    found = dict(load_comparisons(name, size))
    assert found
    for folder, config in found.items():
        assert folder.startswith(name.split("/")[0])
        for one in config.models:
            values = [] if size == "paper" else one.config
            assert set(values) <= {f.name for f in fields(_preset(one))}
            assert set(one.forms) <= set(FORMS)
        for one in config.sets:
            assert one.scene in SCENES
            assert one.listeners == (5000 if size == "paper" else 150)
        assert len({one.title for one in config.sets}) == len(config.sets)


def _preset(one):
    return FIELDS[one.model].load_module().PRESETS[one.preset]


def test_unknown_comparison_is_told_with_those_built_in(capsys):
    assert main(["compare", "some"]) == 1
    error = capsys.readouterr().err
    assert "built in: diff, same and diff/contrastive" in error


def test_a_built_in_set_has_its_floor_and_pattern(tmp_path):
    walls = {"all": {"absorption": 0.2, "scattering": 0.4}}
    bare = {"name": "bare", "size_m": [4.2, 3.4, 2.6], "surfaces": walls}
    scene = tmp_path / "bare.yaml"
    scene.write_text(yaml.safe_dump(bare))
    made = {"name": "bare-diff", "scene": str(scene), "gains": "diff"}
    plain = {
        "sets": [made | {"listeners": 24}],
        "models": [{"model": "nearest", "forms": ["vanilla"]}],
        "seeds": [0],
        "cache": str(tmp_path / "sets"),
    }
    (tmp_path / "small.yaml").write_text(yaml.safe_dump(plain))
    out = tmp_path / "out"
    assert main(["compare", str(tmp_path / "small.yaml"), "--out", str(out)]) == 0
    table = json.loads((out / "bare-diff" / "table.json").read_text())
    rows = {row["method"]: row for row in table["rows"]}
    floor = rows["truth, places off by 3 mm"]
    assert floor["C50"] < rows["nearest vanilla"]["C50"] < rows["chance"]["C50"]
    assert rows["nearest vanilla"]["true front-to-back"] > 8
    assert table["mark"] == "SIMULATED"


def test_mistakes_in_the_configuration_are_all_told(config, tmp_path, capsys):
    plain = yaml.safe_load(config.read_text())
    plain["seed"] = 3
    plain["models"][0]["modle"] = "x"
    config.write_text(yaml.safe_dump(plain))
    assert main(["compare", str(config), "--out", str(tmp_path / "x")]) == 1
    error = capsys.readouterr().err
    assert "seed" in error
    assert "modle" in error


def test_unknown_models_forms_and_settings_are_told_first(config, tmp_path, capsys):
    plain = yaml.safe_load(config.read_text())
    plain["models"][1]["forms"] = ["ssl", "wrong"]
    plain["models"][1]["config"] = {"head": "wide"}
    plain["models"].append({"model": "nerf"})
    config.write_text(yaml.safe_dump(plain))
    assert main(["compare", str(config), "--out", str(tmp_path / "out")]) == 1
    told = " ".join(capsys.readouterr().err.split())
    for part in ("no form 'wrong'", "no 'wide'; known: shell, bank", "no field 'nerf'"):
        assert part in told
    assert not (tmp_path / "out").exists()


def test_cost_command_writes_curves(grid, tmp_path):
    path = grid.save(tmp_path / "grid.h5")
    arguments = ["--model", "inras", "--knob", "width", "--values", "8,16"]
    out = tmp_path / "cost"
    code = main(["cost", str(path), *arguments, "--budgets", "0.1s", "--out", str(out)])
    assert code == 0
    curve = CostCurve.load(out / "cost-c50.json")
    assert [point.setting for point in curve.points] == ["8, 0.1 s", "16, 0.1 s"]
    assert all(point.seconds >= 0.1 for point in curve.points)
    assert curve.mark == "SIMULATED"
    assert curve.sentence in (out / "cost.html").read_text()
