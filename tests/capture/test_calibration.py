from pathlib import Path

import numpy as np
import pytest

from capture.signal.calibration import pascal_per_unit, read_microphone_file, tone_level
from rir import ConfigError, SignalError

RATE = 48000
TIMES = np.arange(2 * RATE) / RATE


def tone(frequency: float = 1000.0, amplitude: float = 0.2) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * frequency * TIMES + 0.3)


@pytest.mark.parametrize("frequency", [999.3, 1000.0, 1012.7])
def test_the_level_of_a_tone_between_bins_is_exact(frequency: float) -> None:
    level = tone_level(tone(frequency), RATE)
    np.testing.assert_allclose(level, 0.2 / np.sqrt(2), rtol=1e-4)


def test_ninety_four_decibels_are_one_pascal() -> None:
    np.testing.assert_allclose(
        pascal_per_unit(tone(), RATE) * 0.2 / np.sqrt(2), 1.0024, rtol=1e-4
    )
    louder = pascal_per_unit(tone(), RATE, level_db=114.0)
    np.testing.assert_allclose(louder, 10 * pascal_per_unit(tone(), RATE))


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (tone(440.0), "strongest tone is at 440 Hz"),
        (tone() + 0.1 * np.random.default_rng(0).standard_normal(len(TIMES)), "only"),
        (tone(amplitude=1.0), "clips"),
    ],
)
def test_what_is_no_calibrator_is_refused(samples: np.ndarray, message: str) -> None:
    with pytest.raises(SignalError, match=message):
        pascal_per_unit(samples, RATE)


@pytest.mark.parametrize(
    "text",
    [
        "Sens Factor =-1.6dB, SERNO: 700\n20 -1.5\n1000 0.0\n20000 2.5\n",
        "* remark\n20,-1.5,12\n1000,0,3\n20000,2.5,-4\n",
        "freq\tdb\n20\t-1.5\n1000\t0\n20000\t2.5\n",
    ],
)
def test_usual_microphone_files_are_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mic.txt"
    path.write_text(text)
    frequencies, levels = read_microphone_file(path)
    np.testing.assert_array_equal(frequencies, [20, 1000, 20000])
    np.testing.assert_array_equal(levels, [-1.5, 0, 2.5])


@pytest.mark.parametrize("text", ["nothing\n", "20 1\n10 2\n"])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mic.txt"
    path.write_text(text)
    with pytest.raises(ConfigError, match="frequenc"):
        read_microphone_file(path)
