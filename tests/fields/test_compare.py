# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import json

import pytest
import yaml

from fields.cli import main
from rir.cost import CostCurve


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
        "nearest", "linear", "chance",
    ]  # fmt: skip
    assert table["rows"][0]["STFT spread"] >= 0
    assert (out / "grid" / "seconds.png").exists()
    jobs = sorted((out / "jobs").iterdir())
    before = [job.stat().st_mtime_ns for job in jobs]
    jobs[0].unlink()
    assert main(["compare", str(config), "--out", str(out)]) == 0
    after = [job.stat().st_mtime_ns for job in jobs]
    assert after[0] != before[0]
    assert after[1:] == before[1:]


def test_mistakes_in_the_configuration_are_all_told(config, tmp_path, capsys):
    plain = yaml.safe_load(config.read_text())
    plain["seed"] = 3
    plain["models"][0]["modle"] = "x"
    config.write_text(yaml.safe_dump(plain))
    assert main(["compare", str(config), "--out", str(tmp_path / "x")]) == 1
    error = capsys.readouterr().err
    assert "seed" in error
    assert "modle" in error


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
