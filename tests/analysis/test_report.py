"""The written report."""

import csv
import json
import re

import numpy as np
import pytest

from analysis.cli import main
from analysis.report import StudyOptions, write_report
from hard_cases.trials import TrialBox, trial_session
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


def test_the_floor_of_a_session_with_noise_only_is_its_distance(files):
    (room,) = json.loads(files["json"].read_text())["rooms"]
    for symbol in ("Env", "STFT"):
        metric = room["metrics"][symbol]
        assert 0.5 < metric["paired"]["mean"] / metric["floor"] < 2


def test_outliers_are_named_in_verdict_and_table(tmp_path):
    box = TrialBox(sample_rate=16000, duration=0.2)
    rng = np.random.default_rng(0)
    trial = trial_session(6, {2: "gain"}, rng, box=box)
    made = write_report([trial], tmp_path, figures=True)
    said = json.loads(made["json"].read_text())
    assert "apart from 1 of 6 pairs" in said["verdicts"][0]
    assert "stands out: pair 2: gain step of +0.5" in said["verdicts"][0]
    metric = said["rooms"][0]["metrics"]["Amp"]
    assert metric["paired_sound"]["count"] == 5
    assert metric["paired_sound"]["mean"] < metric["paired"]["mean"]
    assert "trial box (simulated)" in made["tex"].read_text()
    names = {p.name for p in made["figures"].iterdir()}
    assert {"trial-box-map.svg", "trial-box-distances.png"} <= names
    rows = list(csv.DictReader(made["pairs"].read_text().splitlines()))
    assert rows[2]["faults"].startswith("gain step")


def test_what_all_pairs_share_is_told_once(tmp_path):
    box = TrialBox(sample_rate=16000, duration=0.2)
    rng = np.random.default_rng(1)
    trial = trial_session(6, dict.fromkeys(range(6), "gain"), rng, box=box)
    (room,) = json.loads(write_report([trial], tmp_path)["json"].read_text())["rooms"]
    np.testing.assert_allclose(room["typical"]["gain_db"], 0.5, atol=0.05)
    assert not any(pair["faults"] for pair in room["pairs"])


def test_robust_flavour_and_short_duration_make_a_report(tmp_path, session):
    options = StudyOptions(flavour="robust", duration=0.2)
    said = json.loads(
        write_report([session], tmp_path, options=options)["json"].read_text()
    )
    assert said["rooms"][0]["metrics"]["T60"]["version"] == "robust-1"
    assert said["methods"]["length"] == "the first 0.2 s"


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


@pytest.mark.parametrize("n_pairs", [1, 2])
def test_few_pairs_make_a_report_that_claims_nothing(tmp_path, new_session, n_pairs):
    said = json.loads(
        write_report([new_session(n_pairs)], tmp_path)["json"].read_text()
    )
    metric = said["rooms"][0]["metrics"]["C50"]
    assert metric["paired"]["low"] is None
    assert ("undetermined" in said["verdicts"][0]) == (n_pairs == 1)


def test_sessions_of_one_room_are_joined_and_others_kept_apart(tmp_path, new_session):
    paths = [
        new_session(2, seed=k, session=name).save(tmp_path / f"{name}.h5")
        for k, name in enumerate(("monday", "tuesday"))
    ]
    hall = new_session(2, room="hall", session="hall").subset(np.arange(4))
    paths.append(hall.save(tmp_path / "hall.h5"))
    out = tmp_path / "out"
    assert main(["report", *map(str, paths), "--out", str(out)]) == 0
    box, other = json.loads((out / "report.json").read_text())["rooms"]
    assert [p["pair"] for p in box["pairs"]] == [
        "monday/0",
        "monday/1",
        "tuesday/0",
        "tuesday/1",
    ]
    assert (other["room"], len(other["pairs"])) == ("hall", 2)


@pytest.mark.parametrize(
    ("simulated", "config", "expected"),
    [
        (True, {}, 0.0),
        (False, {}, 0.5),
        (False, {"placement_sigma_mm": 2.0}, 2.0),
        (True, {"simulation": {"placement_mm": 1.0}}, 1.0),
    ],
)
def test_floor_takes_the_repeatability_a_session_states(
    tmp_path, new_session, simulated, config, expected
):
    session = new_session(2, simulated=simulated, metadata={"config": config})
    said = json.loads(write_report([session], tmp_path)["json"].read_text())
    assert said["rooms"][0]["position_mm"] == expected
