"""Gain patterns by name, or from SOFA and balloon files."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from rir import GainPattern, Registry
from rir.arrays import FloatArray
from rir.bands import octave_centers
from rir.errors import ConfigError
from rir.files.sofa import open_sofa, rate_of
from rir.pose import from_spherical

__all__ = ["PATTERNS", "load_gain"]

PATTERNS: Registry[GainPattern] = Registry("gain pattern")
PATTERNS.add("omni")(GainPattern.omni())
PATTERNS.add("subcardioid")(GainPattern.first_order(0.7))
PATTERNS.add("cardioid")(GainPattern.cardioid())
PATTERNS.add("supercardioid")(GainPattern.first_order(0.366))
PATTERNS.add("hypercardioid")(GainPattern.first_order(0.25))
PATTERNS.add("figure-of-eight")(GainPattern.first_order(0.0))

_CENTERS = octave_centers()


def load_gain(name_or_path: str | Path, order: int = 4) -> GainPattern:
    """Return a pattern by name, or fit one to a file.

    Parameters
    ----------
    name_or_path : str or Path
        One of `PATTERNS`; a SOFA file of a directivity (GeneralTF or FreeField
        impulse responses); or a balloon: text rows of azimuth [°], elevation [°]
        and one amplitude gain, or one per octave from 125 Hz, comma separated.
    order : int
        Order of the fit.

    Raises
    ------
    ConfigError
        If the file cannot be read as one.
    UnknownNameError
        If it is neither a name nor a file.

    Notes
    -----
    A file's pattern is scaled to a gain of 1 to the front, per band.
    """
    text = str(name_or_path)
    if Path(text).suffix.lower() == ".sofa":
        return _fitted(*_read_sofa(text), order)
    if Path(text).suffix.lower() in (".csv", ".txt"):
        return _fitted(*_read_balloon(text), order)
    return PATTERNS[text]


def _read_balloon(path: str) -> tuple[FloatArray, FloatArray]:
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    rows = [re.split(r"[,;\s]+", line.strip()) for line in lines if line.strip()]
    rows = [row for row in rows if not row[0].startswith("#") and _is_number(row[0])]
    try:
        table = np.array(rows, dtype=float)
    except ValueError as error:
        raise ConfigError(f"{path} is not a table of numbers: {error}") from error
    if table.ndim != 2 or table.shape[1] not in (3, 2 + len(_CENTERS)):
        raise ConfigError(
            f"{path} needs rows of azimuth, elevation and 1 or {len(_CENTERS)} gains"
        )
    return from_spherical(table[:, 0], table[:, 1]), table[:, 2:]


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[-+0-9.eE]+", text) is not None


def _read_sofa(path: str) -> tuple[FloatArray, FloatArray]:
    """Return directions and octave gains of a SOFA directivity."""
    sofa = open_sofa(path, ConfigError)
    if hasattr(sofa, "Data_IR"):
        responses = np.asarray(sofa.Data_IR, dtype=float)
        spectra = np.abs(np.fft.rfft(responses, axis=-1))
        frequencies = np.asarray(
            np.fft.rfftfreq(responses.shape[-1], 1 / rate_of(sofa))
        )
    else:
        spectra = np.abs(np.asarray(sofa.Data_Real) + 1j * np.asarray(sofa.Data_Imag))
        frequencies = np.asarray(sofa.N, dtype=float).ravel()
    # directions lie on the axis that has many entries: measurements or receivers
    many = spectra.shape[0] > 1
    places = np.asarray(sofa.SourcePosition if many else sofa.ReceiverPosition)
    places = places.reshape(len(places), -1)[:, :3]
    gains = spectra[:, 0] if many else spectra[0]
    return from_spherical(places[:, 0], places[:, 1]), _octaves(gains, frequencies)


def _octaves(gains: FloatArray, frequencies: Any) -> FloatArray:
    """Return the root mean square gain in each octave, shape (directions, 7)."""
    columns = []
    for center in _CENTERS:
        inside = np.abs(np.log2(np.maximum(frequencies, 1e-9) / center)) <= 0.5
        if not inside.any():
            inside = np.abs(frequencies - center) == np.abs(frequencies - center).min()
        columns.append(np.sqrt(np.mean(gains[:, inside] ** 2, axis=1)))
    return np.stack(columns, axis=1)


def _fitted(directions: FloatArray, gains: FloatArray, order: int) -> GainPattern:
    while order > 0 and len(directions) < (order + 1) ** 2:
        order -= 1
    bands = _CENTERS if gains.shape[1] == len(_CENTERS) else None
    fitted = GainPattern.fit(directions, gains, order, bands)
    front = fitted.gain(np.array([1.0, 0.0, 0.0]))
    if np.any(np.abs(front) < 1e-6):
        raise ConfigError(
            "the pattern has no gain to the front (azimuth 0, elevation 0)"
        )
    return GainPattern(fitted.coefficients / front[:, None], fitted.bands)
