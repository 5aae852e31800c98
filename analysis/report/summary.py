"""The numbers of a report, as plain data: what the JSON file holds."""

import math
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.metrics import METRICS
from analysis.reciprocity import RoomDistances
from analysis.statistics import Estimate, estimate_mean, ratio_of_means, superiority

__all__ = ["room_summary", "verdict", "without_nan"]

FloatArray = NDArray[np.float64]

TABLE_SYMBOLS = ("Amp", "Env", "T60", "C50", "EDT")
"""The metrics of the paper's verification table; the verdict rests on them."""


def room_summary(room: RoomDistances, rng: np.random.Generator) -> dict[str, Any]:
    """Return everything the table of a room says.

    Parameters
    ----------
    room : RoomDistances
        Distances of the room.
    rng : numpy.random.Generator
        Draws the bootstrap resamples.
    """
    metrics = {s: _metric_summary(s, room, rng) for s in room.paired}
    ratios = [metrics[s]["ratio"] for s in TABLE_SYMBOLS if s in metrics]
    return {
        "room": room.room,
        "mark": room.mark,
        "flavour": room.flavour,
        "n_pairs": len(room.pairs),
        "n_unpaired": len(room.strangers),
        "excluded": [{"pair": p, "reason": why} for p, why in room.excluded],
        "metrics": metrics,
        "ratio": _geometric_mean(ratios),
        "pairs": [
            {
                "pair": f"{pair.session}/{pair.pair_id}",
                "takes": [len(pair.forward), len(pair.reverse)],
                "distances": {
                    s: _scaled(METRICS[s].table_factor, room.paired[s][k].mean())
                    for s in room.paired
                },
            }
            for k, pair in enumerate(room.pairs)
        ],
    }


def _metric_summary(
    symbol: str, room: RoomDistances, rng: np.random.Generator
) -> dict[str, Any]:
    metric = METRICS[symbol]
    own = np.arange(len(room.pairs))[:, None]
    both = room.paired[symbol].mean(axis=1)
    paired = estimate_mean(both, own, rng)
    unpaired = estimate_mean(room.unpaired[symbol], room.strangers, rng)
    low, high = ratio_of_means(both, own, room.unpaired[symbol], room.strangers, rng)
    orders = [_nanmean(room.paired[symbol][:, k]) for k in (0, 1)]
    return {
        "title": metric.title,
        "unit": metric.table_unit,
        "version": metric.flavour(room.flavour).version,
        "paired": _in_table_unit(paired, metric.table_factor),
        "unpaired": _in_table_unit(unpaired, metric.table_factor),
        "paired_by_truth": {
            "forward": _scaled(metric.table_factor, orders[0]),
            "reverse": _scaled(metric.table_factor, orders[1]),
        },
        "ratio": _ratio(unpaired.mean, paired.mean),
        "ratio_low": low,
        "ratio_high": high,
        "superiority": superiority(both, room.unpaired[symbol]),
    }


def _in_table_unit(estimate: Estimate, factor: float) -> dict[str, Any]:
    values = asdict(estimate)
    for key in ("mean", "deviation", "median", "low", "high"):
        values[key] *= factor
    return values


def _scaled(factor: float, value: float) -> float:
    return float(factor * value)


def _nanmean(values: FloatArray) -> float:
    kept = values[np.isfinite(values)]
    return float(kept.mean()) if len(kept) else math.nan


def _ratio(large: float, small: float) -> float:
    if not (math.isfinite(large) and math.isfinite(small)):
        return math.nan
    return large / small if small > 0 else math.inf


def _geometric_mean(ratios: list[float]) -> float:
    kept = [r for r in ratios if not math.isnan(r)]
    if not kept:
        return math.nan
    if any(math.isinf(r) for r in kept):
        return math.inf
    return math.exp(sum(math.log(max(r, 1e-12)) for r in kept) / len(kept))


def verdict(summary: dict[str, Any]) -> str:
    """Return what a room shows, in one sentence.

    Ten is about what the paper finds for equal omnidirectional devices.
    """
    ratio, room = summary["ratio"], f"{summary['room']} ({summary['mark']})"
    if math.isnan(ratio):
        return f"{room}: undetermined; no metric has both kinds of distance."
    if math.isinf(ratio):
        return f"{room}: reciprocal; swapped responses are equal."
    said = f"swapped responses are {ratio:.1f} times closer than un-paired ones"
    if ratio >= 5:
        return f"{room}: reciprocal; {said}."
    if ratio >= 2:
        return f"{room}: only partly reciprocal; {said}."
    return f"{room}: not reciprocal; {said}."


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
