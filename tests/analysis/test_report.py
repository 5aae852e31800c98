"""The written report."""

import csv
import json
import re

import numpy as np
import pytest

from analysis.cli import main
from analysis.report import write_report
from rir import Dataset


@pytest.fixture(scope="module")
def files(tmp_path_factory, session):
    return write_report([session], tmp_path_factory.mktemp("report"))


def test_page_is_self_contained_and_marked(files):
    page = files["html"].read_text()
    assert not re.search(r"(src|href)=[\"'](?!data:|#)", page)
    assert "http" not in page.replace("http://www.w3.org/2000/svg", "")
    body = page[page.index("<body>") :]
    assert body.index("SIMULATED") < body.index("<h1>")
    assert 'name="viewport"' in page


def test_json_holds_the_table(files):
    said = json.loads(files["json"].read_text())
    (room,) = said["rooms"]
    assert said["mark"] == room["mark"] == "SIMULATED"
    assert list(room["metrics"]) == ["Amp", "Env", "T60", "C50", "EDT", "STFT"]
    for metric in room["metrics"].values():
        assert metric["paired"]["mean"] < metric["unpaired"]["mean"]
        np.testing.assert_allclose(
            metric["paired"]["mean"], np.mean(list(metric["paired_by_truth"].values()))
        )
    assert "reciprocal" in said["verdicts"][0]


def test_csv_has_a_line_for_each_metric_and_variant(files):
    rows = list(csv.DictReader(files["csv"].read_text().splitlines()))
    assert len(rows) == 18
    assert {row["variant"] for row in rows} == {"paired", "unpaired", "floor"}


def test_verdict_tells_a_directional_loudspeaker(tmp_path, directional_session, files):
    made = write_report([directional_session], tmp_path)
    omni, cardioid = (json.loads(f["json"].read_text()) for f in (files, made))
    assert "not reciprocal" in cardioid["verdicts"][0] or (
        "partly" in cardioid["verdicts"][0]
    )
    assert cardioid["rooms"][0]["ratio"] < omni["rooms"][0]["ratio"] / 3


def test_command_writes_beside_the_session(tmp_path, session, capsys):
    path = session.save(tmp_path / "kitchen.h5")
    assert main(["report", str(path)]) == 0
    said = capsys.readouterr().out
    assert "SIMULATED" in said
    assert (tmp_path / "report" / "report.html").exists()
    assert main(["report", str(path), str(path)]) == 1
    assert "named twice" in capsys.readouterr().err
    assert main(["report", str(tmp_path / "none.h5")]) == 1
    assert main(["report"]) == 2


def test_same_input_gives_the_same_files(tmp_path, session, files):
    again = write_report([session], tmp_path)
    for kind, path in files.items():
        assert path.read_bytes() == again[kind].read_bytes()


def test_rooms_stand_side_by_side(tmp_path, session, new_session):
    other = new_session(3, room="hall", simulated=False, session="second")
    said = json.loads(write_report([session, other], tmp_path)["json"].read_text())
    assert [room["room"] for room in said["rooms"]] == ["box", "hall"]
    assert said["mark"] == "MEASURED and SIMULATED"
    assert isinstance(session, Dataset)
