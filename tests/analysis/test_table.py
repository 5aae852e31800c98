"""Parameters of files."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from analysis.cli import main
from analysis.table import read_responses, tabulate_files
from analysis.table.strength_column import read_reference
from rir import SignalError
from rir.files.audio import write_audio

RATE = 16000


def decay(time, seed=0):
    sign = np.random.default_rng(seed).choice([-1.0, 1.0], RATE)
    return sign * 10 ** (-3 * np.arange(RATE) / RATE / time)


@pytest.fixture
def wave(tmp_path):
    stereo = np.stack([0.5 * decay(0.4), 0.5 * decay(0.6, 1)])
    return write_audio(tmp_path / "stereo.wav", stereo, RATE)


def test_channels_of_a_wave_file_are_lines(wave):
    lines = tabulate_files([wave])
    assert [line["response"] for line in lines] == ["channel 0", "channel 1"]
    np.testing.assert_allclose([x["T20"] for x in lines], [0.4, 0.6], rtol=0.01)


def test_bands_add_lines(wave):
    lines = tabulate_files([wave], "octave")
    assert [x["band_hz"] for x in lines[:7]] == [None, 125, 250, 500, 1000, 2000, 4000]
    assert len(lines) == 14
    np.testing.assert_allclose(lines[5]["T20"], 0.4, rtol=0.1)


def test_data_sets_and_sofa_files_are_read(tmp_path, session):
    path = session.save(tmp_path / "box.h5")
    lines = tabulate_files([path])
    assert len(lines) == len(session)
    assert {line["mark"] for line in lines} == {"SIMULATED"}
    sofar = pytest.importorskip("sofar")
    sofa = sofar.Sofa("SingleRoomSRIR", verify=False)
    sofa.Data_IR = np.stack([decay(0.4), decay(0.5)])[:, None]
    sofa.Data_SamplingRate = RATE
    sofa.ListenerPosition = sofa.SourcePosition = np.ones((2, 3))
    sofa.MeasurementDate = np.zeros(2)
    sofar.write_sofa(str(tmp_path / "two.sofa"), sofa)
    (part,) = read_responses(tmp_path / "two.sofa")
    assert part.labels == ["0 0", "1 0"]
    assert part.samples.shape == (2, RATE)


def test_command_writes_tables_with_reasons(tmp_path, wave, capsys):
    noise = np.random.default_rng(0).standard_normal((1, RATE)) * 0.1
    still = write_audio(tmp_path / "noise.wav", noise, RATE)
    out = tmp_path / "table.csv"
    assert main(["metrics", str(wave), str(still), "--out", str(out)]) == 0
    assert "stereo.wav" in capsys.readouterr().out
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert rows[2]["T30 [s]"] == ""
    assert "T30:" in rows[2]["reasons"]
    out = tmp_path / "table.json"
    assert main(["metrics", str(wave), "--out", str(out)]) == 0
    assert len(json.loads(out.read_text())) == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.wav"], "no file"),
        (["pyproject.toml"], "cannot read"),
        (["stereo.wav", "--bands", "bark"], "bands are"),
        (["stereo.wav", "--out", "table.txt"], "csv or"),
    ],
)
def test_wrong_input_is_one_line(wave, arguments, words, capsys, monkeypatch):
    monkeypatch.chdir(wave.parent)
    Path("pyproject.toml").write_text("[project]")
    assert main(["metrics", *arguments]) == 1
    said = capsys.readouterr().err.strip()
    assert words in said
    assert "\n" not in said


def test_unknown_sofa_content_is_explained(tmp_path):
    broken = tmp_path / "broken.sofa"
    broken.write_bytes(b"not HDF5")
    pytest.importorskip("sofar")
    with pytest.raises(SignalError, match="as SOFA"):
        list(read_responses(broken))


def test_strength_needs_a_reference_and_says_so(wave):
    lines = tabulate_files([wave], "octave")
    assert all(np.isnan(line["G"]) for line in lines)
    assert all("--reference" in line["reasons"]["G"] for line in lines)


def test_strength_against_a_free_field_file(tmp_path, wave):
    pulse = np.zeros((2, RATE))
    pulse[:, 140] = 0.2
    path = write_audio(tmp_path / "free.wav", pulse, RATE, subtype="FLOAT")
    lines = tabulate_files([wave], "octave", read_reference(path, 3.0))
    # 0.5 e^(-t / tau): energy 0.25 rate T / 13.8; reference (0.2 x 3 / 10)^2.
    expected = 10 * np.log10(0.25 * RATE * 0.4 / 13.816 / 0.06**2)
    np.testing.assert_allclose(lines[0]["G"], expected, atol=0.1)
    np.testing.assert_allclose([x["G"] for x in lines[3:6]], expected, atol=1.5)
    with pytest.raises(SignalError, match="--reference-distance"):
        read_reference(path, None)


def test_strength_of_the_simulator_needs_no_reference(tmp_path):
    from rir import RoomSpec
    from rooms import Scene, simulate
    from rooms.writing import write_simulation

    dry = {"name": "dry", "size_m": (6, 5, 3), "surfaces": {"all": {"absorption": 0.3}}}
    room = RoomSpec.model_validate(dry)
    scene = Scene.from_room(room)
    ends = [[1.0, 1.0, 1.0]], [[4.0, 3.0, 1.5]]
    result = simulate(scene, *ends, sample_rate=RATE, duration=0.6)
    path = write_simulation(result, scene, *ends, tmp_path / "dry.h5")
    (line,) = tabulate_files([path])
    # Barron and Lee's revised theory, J. Acoust. Soc. Am. 84 (1988).
    distance = np.linalg.norm(np.subtract(*ends))
    late = 31200 * line["T30"] / room.volume_m3 * np.exp(-0.04 * distance / line["T30"])
    np.testing.assert_allclose(
        line["G"], 10 * np.log10(100 / distance**2 + late), atol=1.5
    )
