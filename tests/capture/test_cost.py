"""What accuracy costs in a session."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from capture.commands.capture_pairs import main
from capture.config import SessionConfig
from capture.cost import imperfect, measure_session, trials_of
from capture.cost.bench import misalignment, store
from rir.cost import CostCurve

MakeConfig = Callable[..., SessionConfig]


def decibels(curve: CostCurve) -> np.ndarray:
    return 20 * np.log10([point.error for point in curve.points])


def test_white_noise_falls_by_3_db_per_doubling(make_config: MakeConfig) -> None:
    curves = measure_session(make_config(simulation={"noise_db": -40.0}), repeats=1)
    error, noise = curves["repeats"]
    np.testing.assert_allclose(np.diff(decibels(error)), -3.01, atol=0.4)
    np.testing.assert_allclose(np.diff(decibels(noise)), -3.01, atol=1.0)
    once, twice = error.points[:2]
    assert twice.seconds == pytest.approx(2 * once.seconds)
    longer = decibels(curves["sweep length"][0])
    np.testing.assert_allclose(np.diff(longer[-3:]), -3.01, atol=0.8)
    assert {curve.mark for pair in curves.values() for curve in pair} == {"SIMULATED"}
    assert curves["float width"][0].seconds_of == "CPU"


def test_what_the_simulation_sets_stays(make_config: MakeConfig) -> None:
    real = imperfect(make_config(simulation={"noise_db": -70.0}))
    assert real.simulation is not None
    assert real.simulation.noise_db == -70.0
    assert real.simulation.distortion_db == (-45.0, -55.0)


def test_bands_keep_the_seconds_per_octave(make_config: MakeConfig) -> None:
    trials = trials_of(make_config())["band"]
    bands = [trial.config.sweep.band_hz for trial in trials]
    octaves = [np.log2(high / low) for low, high in bands]
    seconds = [trial.config.sweep.seconds for trial in trials]
    np.testing.assert_allclose(np.divide(seconds, octaves), seconds[0] / octaves[0])


def test_16_bits_are_kept_to_half_a_step() -> None:
    samples = np.random.default_rng(0).standard_normal((2, 1000))
    step = np.abs(samples).max(axis=1) * 10 ** (9 / 20) / 2**15
    off = np.abs(store(samples, 16) - samples).max(axis=1)
    assert np.all((off > 0.4 * step) & (off <= 0.5 * step * (1 + 1e-9)))


def test_a_gain_is_no_misalignment() -> None:
    truth = np.random.default_rng(0).standard_normal(500)
    assert misalignment(0.9 * truth, truth, 8000, (100, 3000)) < 1e-12


def test_command_writes_curves_and_a_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tiny.yaml").write_text(
        "sample_rate: 8000\nresponse_s: 0.2\n"
        "sweep: {seconds: 0.5, band_hz: [80, 3300], tail_s: 0.3, noise_s: 0.2}\n"
    )
    Path("booth.yaml").write_text(
        "name: booth\nsize_m: [4.2, 3.4, 2.5]\nsurfaces: {all: {absorption: 0.7}}\n"
    )
    options = ["--room", "booth.yaml", "--pairs", "1", "--config", "tiny.yaml"]
    assert main([*options, "--cost", "--out", "c"]) == 0
    told = capsys.readouterr().out
    assert "SIMULATED in booth, pair P01: room noise -40 dB" in told
    assert "of response error costs" in told
    curve = CostCurve.load("c/sweep-length-response-error.json")
    assert len(curve.points) == 6
    assert curve.sentence in Path("c/cost.html").read_text()
    assert len(list(Path("c").glob("*.json"))) == 8
