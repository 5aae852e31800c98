"""The deconvolve-sweep command on files."""

from pathlib import Path

import numpy as np
import pytest

from capture import synchronized_sweep
from capture.commands.deconvolve_sweep import main
from rir.files.audio import read_audio, write_audio

RATE = 16000


@pytest.fixture
def files(tmp_path: Path) -> Path:
    sweep = np.asarray(synchronized_sweep(50, 7500, 0.6, RATE, band=(80, 7000)))
    room = np.zeros(400)
    room[[100, 250]] = 0.5, 0.2
    take = np.zeros((2, 3 * RATE))
    for start in (1600, 24000):
        take[0, start : start + sweep.size + 399] += np.convolve(sweep, room)
        take[1, start : start + sweep.size] += sweep
    take += 1e-5 * np.random.default_rng(0).standard_normal(take.shape)
    write_audio(tmp_path / "x.wav", sweep, RATE)
    write_audio(tmp_path / "y.wav", take, RATE)
    return tmp_path


def arguments(files: Path, out: str) -> list[str]:
    return [
        *("--recording", str(files / "y.wav"), "--excitation", str(files / "x.wav")),
        *("--out", str(files / out), "--length", "0.05", "--pre", "0.01"),
        *("--loopback-channel", "2", "--band", "80", "7000"),
    ]


def test_both_sweeps_of_a_recording_are_found(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments(files, "h.wav")) == 0
    responses, rate = read_audio(files / "h.wav")
    assert rate == RATE
    assert responses.shape == (2, 960)
    for row in responses:
        assert np.argmax(row) == 160 + 100
        np.testing.assert_allclose(row[260], 0.5 * 6960 / 8000, rtol=0.05)
    told = capsys.readouterr().out
    assert "MEASURED" in told
    assert "sweep 2" in told


def test_npz_holds_all(files: Path) -> None:
    assert main(arguments(files, "h.npz")) == 0
    with np.load(files / "h.npz") as data:
        assert data["response"].shape == (2, 1, 960)
        assert data["latency"].shape == (2,)


def test_exit_codes(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments(files, "h.txt")) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["--what"]) == 2


def test_strict_tells_a_spoiled_take_by_its_exit_code(files: Path) -> None:
    assert main([*arguments(files, "good.npz"), "--strict"]) == 0
    take, rate = read_audio(files / "y.wav")
    take[0] = np.clip(take[0], -0.1, 0.1)
    write_audio(files / "y.wav", take, rate)
    assert main(arguments(files, "bad.npz")) == 0
    assert main([*arguments(files, "bad.npz"), "--strict"]) == 3
    assert (files / "bad.npz").exists()
