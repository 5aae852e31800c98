"""Acoustic parameters of files as one table."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.bands import band_parameters
from analysis.parameters import acoustic_parameters
from analysis.table.files import FileResponses, read_responses
from analysis.table.strength_column import FreeField, add_strength
from rir.bands import octave_centers, third_octave_centers
from rir.errors import SignalError

__all__ = ["BANDS", "SYMBOLS", "tabulate_files", "write_table"]

SYMBOLS = ("EDT", "T20", "T30", "C50", "C80", "D50", "TS", "DRR", "G")
UNITS = {"EDT": "s", "T20": "s", "T30": "s", "TS": "s", "D50": "1"}
BANDS = ("none", "octave", "third")


def tabulate_files(
    paths: Sequence[Path], bands: str = "none", reference: FreeField | None = None
) -> list[dict[str, Any]]:
    """Return one line for each response and band.

    Parameters
    ----------
    paths : sequence of Path
        Files or session folders.
    bands : {"none", "octave", "third"}
        Split into octaves 125 Hz to 8 kHz or third octaves 100 Hz to 8 kHz; always
        with a broadband line as well.
    reference : FreeField, optional
        The source in the free field, for G.

    Returns
    -------
    list of dict
        ``file``, ``response``, ``mark``, ``band_hz`` (None for broadband), the
        parameters (NaN where undetermined), ``flags``, ``reasons``.
    """
    if bands not in BANDS:
        raise SignalError(f"bands are {', '.join(BANDS)}; not {bands!r}")
    lines: list[dict[str, Any]] = []
    for path in paths:
        for part in read_responses(path):
            lines += _lines(part, bands, reference)
    return lines


def _centers(bands: str, sample_rate: int) -> NDArray[np.float64]:
    if bands == "none":
        return np.empty(0)
    wanted = octave_centers() if bands == "octave" else third_octave_centers(100, 8000)
    half = 2**0.5 if bands == "octave" else 2 ** (1 / 6)
    return wanted[wanted * half < sample_rate / 2]


def _lines(
    part: FileResponses, bands: str, reference: FreeField | None
) -> list[dict[str, Any]]:
    found = acoustic_parameters(part.samples, part.sample_rate)
    centers = _centers(bands, part.sample_rate)
    split = None
    if len(centers):
        split = band_parameters(
            part.samples,
            part.sample_rate,
            centers,
            fraction=1 if bands == "octave" else 3,
        )
    lines = []
    for row, label in enumerate(part.labels):
        head = {"file": part.file, "response": label, "mark": part.mark}
        lines.append(head | {"band_hz": None} | _values(found, (row,)))
        if split is not None:
            for k, center in enumerate(centers):
                lines.append(
                    head | {"band_hz": float(center)} | _values(split, (row, k))
                )
    add_strength(part, centers, reference, lines)
    return lines


def _values(found: Any, index: tuple[int, ...]) -> dict[str, Any]:
    values = {name: float(found[name][index]) for name in SYMBOLS if name != "G"}
    flags, reasons = found["flags"], found["reasons"]
    for k in index:
        flags, reasons = flags[k], reasons[k]
    return values | {"flags": list(flags), "reasons": dict(reasons)}


def write_table(lines: Sequence[dict[str, Any]], path: Path) -> Path:
    """Write the table as JSON or CSV, by the ending of the name.

    Raises
    ------
    SignalError
        If the ending is neither.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".json":
        clean = [
            {
                k: None if isinstance(v, float) and np.isnan(v) else v
                for k, v in x.items()
            }
            for x in lines
        ]
        path.write_text(json.dumps(clean, indent=1) + "\n", encoding="utf-8")
    elif path.suffix == ".csv":
        with path.open("w", newline="", encoding="utf-8") as out:
            writer = csv.writer(out)
            names = ("file", "response", "mark", "band_hz", *SYMBOLS)
            units = [
                f"{s} [{UNITS.get(s, 'dB')}]" if s in SYMBOLS else s for s in names
            ]
            writer.writerow([*units, "flags", "reasons"])
            for line in lines:
                why = "; ".join(f"{k}: {v}" for k, v in line["reasons"].items())
                cells = ["" if line[n] is None else line[n] for n in names]
                cells = ["" if c != c else c for c in cells]
                writer.writerow([*cells, " ".join(line["flags"]), why])
    else:
        raise SignalError(f"write the table to a .csv or .json file, not {path.name}")
    return path
