"""What a report says, as typed records; its JSON file holds them field by field."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from analysis.likeness.faults import PairFault, Typical
from analysis.statistics import Estimate
from rir.errors import DatasetError
from rir.schema import Schema

__all__ = [
    "REPORT",
    "Coherence",
    "Exclusion",
    "MetricSummary",
    "PairSummary",
    "Report",
    "RoomSummary",
    "SessionQuality",
    "Span",
    "load_report",
    "report_json",
    "without_nan",
]

REPORT = Schema("reciprocity report", 1, format="resounding-report")


@dataclass(frozen=True)
class Span:
    """Least, middle and largest number of a column; NaN where there is none."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class Exclusion:
    """A pair that could not be compared, and why."""

    pair: str
    reason: str


@dataclass(frozen=True)
class MetricSummary:
    """One metric over the pairs of a room, in the unit of the report's tables.

    Parameters
    ----------
    paired, paired_sound, unpaired : Estimate
        Distance of swapped responses, of those of pairs without fault, and of
        strangers.
    floor : float
        Distance that noise, temperature and places alone would leave.
    paired_by_truth : dict of str to float
        Mean distance with the ``forward`` and the ``reverse`` response as truth.
    ratio, ratio_low, ratio_high : float
        Un-paired over paired, with its 95 % interval.
    superiority : float
        Chance that an un-paired distance exceeds a paired one.
    """

    title: str
    unit: str
    version: str
    paired: Estimate
    paired_sound: Estimate
    unpaired: Estimate
    floor: float
    paired_by_truth: dict[str, float]
    ratio: float
    ratio_low: float
    ratio_high: float
    superiority: float


@dataclass(frozen=True)
class Coherence:
    """Correlation of the directions by octave and time window, mean over pairs."""

    octaves_hz: list[float]
    edges_ms: list[float]
    as_recorded: list[list[float]]
    matched: list[list[float]]


@dataclass(frozen=True)
class SessionQuality:
    """How good a session was, from what it logged of itself."""

    sessions: list[str]
    takes: int
    takes_rejected: int
    takes_used: int
    sample_rate_hz: int
    duration_s: float
    noise_floor_db: Span
    logged: dict[str, Span]


@dataclass(frozen=True)
class PairSummary:
    """One pair: places [m], distances, what the fit found, and what is wrong."""

    pair: str
    session: str
    takes: list[int]
    a: list[float]
    b: list[float]
    distances: dict[str, float]
    gain_db: float
    temperature_change_k: float
    logged_temperature_change_k: float
    delay_us: float
    noise_db: list[float]
    faults: list[PairFault]
    note: str


@dataclass(frozen=True)
class RoomSummary:
    """Everything the report says of a room.

    Parameters
    ----------
    ratio, ratio_without_outliers : float
        Geometric mean of the table's metrics, of all pairs and of those without
        fault.
    position_mm : float
        Repeatability of places that the floor was predicted with.
    unequal_patterns : float
        Share of the pairs whose difference is that of unequal gain patterns.
    """

    room: str
    mark: str
    flavour: str
    n_pairs: int
    n_unpaired: int
    excluded: list[Exclusion]
    metrics: dict[str, MetricSummary]
    ratio: float
    position_mm: float
    ratio_without_outliers: float
    typical: Typical
    unequal_patterns: float
    coherence: Coherence
    quality: SessionQuality
    pairs: list[PairSummary]


@dataclass(frozen=True)
class Report:
    """The whole report; `methods` tells how each thing was found."""

    title: str
    software: str
    created_utc: str
    mark: str
    verdicts: list[str]
    methods: dict[str, str]
    rooms: list[RoomSummary]


def report_json(report: Report) -> str:
    """Return the text of ``report.json``."""
    return json.dumps(without_nan({**REPORT.stamp, **asdict(report)}), indent=1) + "\n"


def load_report(path: str | Path) -> Report:
    """Read ``report.json``, or the one in a report's folder.

    Raises
    ------
    DatasetError
        If it is not a report, or newer than this program.
    """
    place = Path(path)
    place = place / "report.json" if place.is_dir() else place
    try:
        written = json.loads(place.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DatasetError(f"cannot read {place} as a report: {error}") from error
    present = _with_nan(REPORT.open(written, place))
    try:
        return TypeAdapter(Report).validate_python(present)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise DatasetError(f"{place} is broken at {where}: {first['msg']}") from error


def _with_nan(value: Any) -> Any:
    """Return plain data with NaN for null, as JSON has no word for it."""
    if isinstance(value, dict):
        return {key: _with_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_nan(item) for item in value]
    return math.nan if value is None else value


def without_nan(value: Any) -> Any:
    """Return plain data with null for every number that is not finite.

    Examples
    --------
    >>> without_nan({"a": [1.0, float("nan")]})
    {'a': [1.0, None]}
    """
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
