"""Two reports compared."""

import json

import numpy as np
import pytest

from analysis.cli import main
from analysis.report import StudyOptions, write_report
from analysis.report.compare import compare_reports
from analysis.report.contents import load_report
from rir import DatasetError


@pytest.fixture(scope="module")
def folders(tmp_path_factory, new_session):
    made = []
    for noise in (-60.0, -35.0):
        folder = tmp_path_factory.mktemp(f"report{noise:.0f}")
        write_report([new_session(8, noise_db=noise)], folder)
        made.append(folder)
    return made


def test_a_noisier_session_is_farther_from_reciprocity(folders):
    quiet, noisy = map(load_report, folders)
    lines = compare_reports(quiet, noisy, np.random.default_rng(0))
    assert [x.metric for x in lines] == ["Amp", "Env", "T60", "C50", "EDT", "STFT"]
    for line in lines:
        if line.metric in ("Amp", "Env", "STFT"):
            assert line.words == "the first is closer"
            assert 1 < line.low < line.change < line.high
    back = compare_reports(noisy, quiet, np.random.default_rng(0))
    assert back[0].words == "the second is closer"


def test_a_report_does_not_differ_from_itself(folders):
    report = load_report(folders[0] / "report.json")
    for line in compare_reports(report, report, np.random.default_rng(0)):
        assert line.change == 1
        assert line.words == "no clear difference"


def test_command_writes_a_marked_page(folders, tmp_path, capsys):
    out = tmp_path / "compare.html"
    assert main(["compare", *map(str, folders), "--out", str(out)]) == 0
    assert "factor" in capsys.readouterr().out
    page = out.read_text()
    assert "SIMULATED" in page
    assert len(json.loads(out.with_suffix(".json").read_text())) == 6


def test_unlike_reports_are_refused(folders, tmp_path, session):
    robust = write_report([session], tmp_path, options=StudyOptions(flavour="robust"))
    with pytest.raises(DatasetError, match="different metrics"):
        compare_reports(
            load_report(folders[0]),
            load_report(robust["json"]),
            np.random.default_rng(0),
        )
    (tmp_path / "report.json").write_text("{}")
    with pytest.raises(DatasetError, match="no reciprocity report"):
        load_report(tmp_path)
