"""From full scale to pascal: microphone files and the calibrator's tone."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from rir import ConfigError, SignalError
from rir.arrays import FloatArray

__all__ = ["pascal_per_unit", "read_microphone_file", "tone_level"]

REFERENCE_PA = 20e-6  # ISO 1683
TONE_TOLERANCE_HZ = 30.0  # IEC 60942 calibrators keep 1 kHz within about 2 %: some more
TONE_SHARE = 0.9  # 0.5 dB of error at most by what is not the tone


def read_microphone_file(path: Path) -> tuple[FloatArray, FloatArray]:
    """Read a microphone's calibration: frequency [Hz] and level [dB] in columns.

    Lines that do not begin with a number are headers or remarks; columns beyond the
    second (phase) are left out; commas, blanks and tabs separate.

    Returns
    -------
    frequencies, levels_db : ndarray, shape (n,)
        Rising frequencies.

    Raises
    ------
    ConfigError
        If the file has no table, or its frequencies do not rise.
    """
    try:
        lines = path.read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror}") from error
    rows = [row for row in map(_numbers, lines) if len(row) >= 2]
    if len(rows) < 2:
        raise ConfigError(f"{path} has no two rows of frequency and level")
    table = np.array([row[:2] for row in rows])
    if np.any(np.diff(table[:, 0]) <= 0) or table[0, 0] < 0:
        raise ConfigError(f"the frequencies in {path} do not rise")
    return table[:, 0], table[:, 1]


def _numbers(line: str) -> list[float]:
    for mark in ",;\t":
        line = line.replace(mark, " ")
    numbers = []
    for word in line.split():
        try:
            numbers.append(float(word))
        except ValueError:
            break
    return numbers


def tone_level(
    samples: FloatArray, sample_rate: int, frequency: float = 1000.0
) -> float:
    """Return the root mean square of a calibrator's tone, full scale = 1.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        What the microphone heard with the calibrator on it.
    sample_rate : int
        Rate [Hz].
    frequency : float
        The calibrator's frequency [Hz].

    Raises
    ------
    SignalError
        If what is heard is not a steady tone of that frequency, or clips.
    """
    if np.abs(samples).max() >= 0.999:
        raise SignalError("the calibrator's tone clips: turn the input gain down")
    fft: Any = import_module("scipy.fft")
    window = np.hanning(len(samples))
    power = np.abs(fft.rfft(samples * window)) ** 2
    frequencies = fft.rfftfreq(len(samples), 1 / sample_rate)
    peak = float(frequencies[np.argmax(power)])
    if abs(peak - frequency) > TONE_TOLERANCE_HZ:
        raise SignalError(
            f"the strongest tone is at {peak:.0f} Hz, the calibrator's should be at "
            f"{frequency:.0f} Hz: is it on the microphone and switched on?"
        )
    near = np.abs(frequencies - peak) <= TONE_TOLERANCE_HZ
    share = float(power[near].sum() / power.sum())
    if share < TONE_SHARE:
        raise SignalError(
            f"only {100 * share:.0f} % of what is heard is the tone (at least "
            f"{100 * TONE_SHARE:.0f} % is needed): press the calibrator on firmly"
        )
    return float(np.sqrt(2 * power[near].sum() / len(samples) / np.sum(window**2)))


def pascal_per_unit(
    samples: FloatArray,
    sample_rate: int,
    level_db: float = 94.0,
    frequency: float = 1000.0,
) -> float:
    """Return the sound pressure that full scale stands for [Pa].

    Parameters
    ----------
    samples : ndarray, shape (n,)
        A take with the calibrator on the microphone.
    sample_rate : int
        Rate [Hz].
    level_db : float
        The calibrator's level [dB re 20 µPa].
    frequency : float
        Its frequency [Hz].

    Examples
    --------
    >>> tone = 0.1 * np.sin(2 * np.pi * 1000 * np.arange(48000) / 48000)
    >>> round(pascal_per_unit(tone, 48000), 2)
    14.18
    """
    pressure = REFERENCE_PA * 10 ** (level_db / 20)
    return pressure / tone_level(samples, sample_rate, frequency)
