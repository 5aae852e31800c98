"""Simulated room-acoustic parameters against those that were measured in the room."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rir.errors import ConfigError

if TYPE_CHECKING:
    from rich.table import Table

__all__ = [
    "Deviation",
    "Measured",
    "check_comparable",
    "compare_parameters",
    "deviation_table",
    "read_measured",
]

Values = dict[tuple[str, str, str], FloatArray]
"""Values per octave, by source, receiver and parameter."""

_UNITS = {
    "EDT": {"s": 1.0, "ms": 1e-3},
    "T20": {"s": 1.0, "ms": 1e-3},
    "T30": {"s": 1.0, "ms": 1e-3},
    "TS": {"ms": 1.0, "s": 1e3},
    "C50": {"dB": 1.0},
    "C80": {"dB": 1.0},
    "D50": {"%": 1.0, "1": 100.0, "": 100.0},
    "G": {"dB": 1.0},
}
"""Units that a file may state, the first of which is shown, and their sizes in it."""

_FROM_SI = {"TS": 1e3, "D50": 100.0}
"""What turns values of `rooms.parameters` into the unit shown, where it is another."""

_NEVER_NEGATIVE = ("EDT", "T20", "T30", "TS", "D50")

_OFF = 0.1  # octaves: centres are rounded, as 125 and 63 Hz are

_COLUMNS = ("source", "receiver", "parameter", "unit")
_MEASURED = ("", "measured", "measurement")
"""How the column `entry` calls what was measured."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What a file holds of a room.

    Parameters
    ----------
    bands : ndarray, shape (bands,)
        Octave centres [Hz].
    values : dict
        Measured values per octave, in the unit shown; NaN where there are none.
    entries : dict
        Those of other entries of a round robin, by name.
    """

    bands: FloatArray
    values: Values
    entries: dict[str, Values] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far one parameter is from what was measured.

    Parameters
    ----------
    parameter, unit : str
        Name, and unit of the errors.
    mean_error : float
        Mean of the absolute error over pairs and octaves.
    signed : ndarray, shape (bands,)
        Mean error per octave.
    count : int
        Values compared.
    rank, entries : int
        Place among the entries, the simulation counted; 1 of 1 without others.
    """

    parameter: str
    unit: str
    mean_error: float
    signed: FloatArray
    count: int
    rank: int
    entries: int


def read_measured(path: str | Path) -> Measured:
    """Read measured parameters from a CSV.

    Its columns are ``source,receiver,parameter,unit`` and one per octave, called by its
    centre in Hz. A column ``entry``, if there is one, names the entry of a round robin
    that computed a row; it is empty, or "measured", in rows of the measurement.

    Raises
    ------
    ConfigError
        If the file is no such table; names the line.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigError(f"there is no file of measured values {path}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"cannot read {path.name}: {error}; save it as text in UTF-8"
        ) from error
    lines = csv.reader(io.StringIO(text, newline=""))
    head = [name.strip() for name in next(lines, [])]
    lower = [name.lower() for name in head]
    lacking = [name for name in _COLUMNS if name not in lower]
    if lacking:
        raise ConfigError(
            f"{path.name} lacks the column {lacking[0]!r}; its first line must be"
            f" {','.join(_COLUMNS)},125,250,… (octaves in Hz)"
        )
    octaves = {k: _band(name) for k, name in enumerate(head) if _band(name) > 0}
    if not octaves:
        raise ConfigError(f"{path.name} has no column of an octave, such as 1000")
    tables: dict[str, Values] = {}
    for number, line in enumerate(lines, start=2):
        if any(cell.strip() for cell in line):
            _read_row(f"{path.name}, line {number}", line, lower, octaves, tables)
    if not tables:
        raise ConfigError(
            f"{path.name} ends after its first line; below it stands a line for each"
            " pair and parameter, as S1,R1,T30,s,0.81,0.75,…"
        )
    measured = tables.pop("", {})
    if not measured:
        raise ConfigError(f"{path.name} holds no measured values, only entries")
    return Measured(np.array(list(octaves.values())), measured, tables)


def _band(name: str) -> float:
    """Return the octave that a column is called by [Hz], 0 if it is none."""
    try:
        return float(name.lower().removesuffix("hz"))
    except ValueError:
        return 0.0


def _read_row(
    where: str,
    line: list[str],
    head: list[str],
    octaves: dict[int, float],
    tables: dict[str, Values],
) -> None:
    """Add one row of a file to the table of its entry."""
    if len(line) != len(head):
        raise ConfigError(f"{where} has {len(line)} cells; the first has {len(head)}")
    cells = dict(zip(head, (cell.strip() for cell in line), strict=True))
    parameter = cells["parameter"].upper()
    if parameter not in _UNITS:
        known = ", ".join(_UNITS)
        raise ConfigError(
            f"{where}: unknown parameter {cells['parameter']!r}; known are {known}"
        )
    sizes = _UNITS[parameter]
    if cells["unit"] not in sizes:
        known = " or ".join(repr(unit) for unit in sizes)
        raise ConfigError(
            f"{where}: the unit of {parameter} is {known}, not {cells['unit']!r}"
        )
    try:
        values = [float(line[k]) if line[k].strip() else np.nan for k in octaves]
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from error
    entry = cells.get("entry", "")
    table = tables.setdefault("" if entry.lower() in _MEASURED else entry, {})
    key = cells["source"].lower(), cells["receiver"].lower(), parameter
    if key in table:
        raise ConfigError(f"{where}: {parameter} of this pair stands there twice")
    if parameter in _NEVER_NEGATIVE and np.any(np.less(values, 0)):
        raise ConfigError(
            f"{where}: {parameter} is never negative, not {np.nanmin(values)}"
        )
    table[key] = np.array(values) * sizes[cells["unit"]]


def compare_parameters(
    measured: Measured,
    found: dict[str, FloatArray],
    names: tuple[Sequence[str], Sequence[str]],
    bands: FloatArray,
) -> list[Deviation]:
    """Compare parameters of simulated responses with measured ones.

    An entry is ranked by its mean absolute error over the values it states.

    Parameters
    ----------
    measured : Measured
        What the file holds.
    found : dict
        As of `rooms.parameters.hall_parameters`, each (sources, receivers, bands).
    names : tuple of sequence of str
        Names of the sources and of the receivers.
    bands : ndarray, shape (bands,)
        Octave centres of `found` [Hz].

    Raises
    ------
    ConfigError
        If no measured pair or octave was simulated, or a column is no octave.
    """
    check_comparable(measured, names, bands)
    sources, receivers = ([name.lower() for name in some] for some in names)
    octave, fits = _nearest(measured.bands, bands), _simulated(measured.bands, bands)
    ours: Values = {}
    for key in measured.values:
        source, receiver, parameter = key
        if source in sources and receiver in receivers:
            row = found[parameter][sources.index(source), receivers.index(receiver)]
            ours[key] = np.where(fits, row[octave], np.nan) * _FROM_SI.get(parameter, 1)
    return [
        row
        for parameter in _UNITS
        if (row := _deviation(parameter, measured, ours)) is not None
    ]


def check_comparable(
    measured: Measured,
    names: tuple[Sequence[str], Sequence[str]],
    bands: FloatArray,
) -> None:
    """Raise `ConfigError` if no measured pair or octave is simulated."""
    numbers = np.log2(measured.bands / 1000.0)
    strange = np.abs(numbers - np.rint(numbers)) >= _OFF
    if np.any(strange) or not np.any(_simulated(measured.bands, bands)):
        stated = ", ".join(f"{f:g}" for f in measured.bands[strange | ~np.any(strange)])
        known = ", ".join(f"{f:g}" for f in bands)
        why = "are no octaves" if np.any(strange) else "are not simulated"
        raise ConfigError(
            f"measured columns of {stated} Hz {why}; octaves simulated are {known} Hz"
        )
    sources, receivers = ({name.lower() for name in some} for some in names)
    if not any(s in sources and r in receivers for s, r, _ in measured.values):
        pairs = sorted({f"{s} to {r}" for s, r, _ in measured.values})
        raise ConfigError(
            f"no measured pair is simulated: the file has {', '.join(pairs[:4])}…;"
            f" sources are {', '.join(names[0])}, receivers {', '.join(names[1])}"
        )


def _nearest(measured: FloatArray, bands: FloatArray) -> list[int]:
    """Return the octave nearest to each of some frequencies."""
    return [int(np.argmin(np.abs(np.log(bands / f)))) for f in measured]


def _simulated(measured: FloatArray, bands: FloatArray) -> NDArray[np.bool_]:
    """Tell which frequencies are those of octaves that were simulated."""
    near = np.asarray(bands)[_nearest(measured, bands)]
    return np.abs(np.log2(near / measured)) < _OFF


def _deviation(parameter: str, measured: Measured, ours: Values) -> Deviation | None:
    """Return how far one parameter is, None where nothing can be compared."""
    errors = _errors(parameter, measured.values, ours)
    known = np.isfinite(errors)
    if not known.any():
        return None
    mean = float(np.abs(errors[known]).mean())
    others = [
        float(np.nanmean(np.abs(theirs)))
        for entry in measured.entries.values()
        if np.isfinite(theirs := _errors(parameter, measured.values, entry)).any()
    ]
    count = known.sum(axis=0)
    signed = np.where(known, errors, 0.0).sum(axis=0) / np.maximum(count, 1)
    return Deviation(
        parameter,
        next(iter(_UNITS[parameter])),
        mean,
        np.where(count > 0, signed, np.nan),
        int(known.sum()),
        1 + sum(other < mean for other in others),
        1 + len(others),
    )


def _errors(parameter: str, truth: Values, values: Values) -> FloatArray:
    """Return what values exceed the measured ones by, shape (pairs, bands)."""
    width = len(next(iter(truth.values())))
    rows = [
        values[key] - wanted
        for key, wanted in truth.items()
        if key[2] == parameter and key in values
    ]
    return np.array(rows).reshape(-1, width)


def deviation_table(rows: list[Deviation], bands: FloatArray) -> "Table":
    """Return errors per parameter, and per octave with their sign."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    title = "SIMULATED against measured: mean |error|, signed error per octave"
    table = Table(title=title, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in ("", "mean", "values", "rank", *(f"{f:g} Hz" for f in bands)):
        table.add_column(name, justify="right")
    for row in rows:
        digits = 2 if row.unit in ("s", "dB") else 1
        rank = f"{row.rank} of {row.entries}" if row.entries > 1 else "-"
        table.add_row(
            f"{row.parameter} {row.unit}",
            f"{row.mean_error:.{digits}f}",
            str(row.count),
            rank,
            *(f"{x:+.{digits}f}" if np.isfinite(x) else "-" for x in row.signed),
        )
    return table
