"""The numbers of a report."""

import math
from dataclasses import replace

import numpy as np

from analysis.metrics import METRICS
from analysis.report.contents import (
    Coherence,
    Exclusion,
    MetricSummary,
    PairSummary,
    RoomSummary,
)
from analysis.report.quality import session_quality
from analysis.report.study import RoomStudy, pair_names
from analysis.statistics import Estimate, estimate_mean, ratio_of_means, superiority
from rir.arrays import FloatArray

__all__ = ["room_summary"]

TABLE_SYMBOLS = ("Amp", "Env", "T60", "C50", "EDT")
"""The metrics of the paper's verification table; the verdict rests on them."""


def room_summary(study: RoomStudy, rng: np.random.Generator) -> RoomSummary:
    """Return everything the report says of a room.

    Parameters
    ----------
    study : RoomStudy
        What was found out.
    rng : numpy.random.Generator
        Draws the bootstrap resamples.
    """
    room = study.distances
    metrics = {s: _metric_summary(s, study, rng) for s in room.paired}
    table = [metrics[s] for s in TABLE_SYMBOLS if s in metrics]
    return RoomSummary(
        room=room.room,
        mark=room.mark,
        flavour=room.flavour,
        n_pairs=len(room.pairs),
        n_unpaired=len(room.strangers),
        excluded=[Exclusion(pair, why) for pair, why in room.excluded],
        metrics=metrics,
        ratio=_geometric_mean([m.ratio for m in table]),
        position_mm=study.position_mm,
        ratio_without_outliers=_geometric_mean(
            [_ratio(m.unpaired.mean, m.paired_sound.mean) for m in table]
        ),
        typical=study.likeness.typical,
        unequal_patterns=study.likeness.share("pattern"),
        coherence=_coherence(study),
        quality=session_quality(study.dataset, room),
        pairs=[
            _pair_summary(study, k, n)
            for k, n in enumerate(pair_names(study.dataset, room))
        ],
    )


def _pair_summary(study: RoomStudy, k: int, name: str) -> PairSummary:
    room, fit = study.distances, study.likeness.fits[k]
    pair = room.pairs[k]
    emitter = study.dataset.emitters.positions[int(pair.forward[0])]
    listener = study.dataset.listeners.positions[int(pair.forward[0])]
    return PairSummary(
        pair=name,
        session=pair.session,
        takes=[len(pair.forward), len(pair.reverse)],
        a=[float(x) for x in emitter],
        b=[float(x) for x in listener],
        distances={
            s: float(METRICS[s].table_factor * values[k].mean())
            for s, values in room.paired.items()
        },
        gain_db=fit.gain_db,
        temperature_change_k=fit.temperature_change,
        logged_temperature_change_k=float(study.warming[k]),
        delay_us=1e6 * fit.delay,
        noise_db=[float(level) for level in study.likeness.noise_db[k]],
        faults=study.likeness.faults[k],
        note="; ".join(fault.words for fault in study.likeness.faults[k]),
    )


def _metric_summary(
    symbol: str, study: RoomStudy, rng: np.random.Generator
) -> MetricSummary:
    metric, room = METRICS[symbol], study.distances
    own = np.arange(len(room.pairs))[:, None]
    both = room.paired[symbol].mean(axis=1)
    strangers = room.unpaired[symbol]
    paired = estimate_mean(both, own, rng)
    unpaired = estimate_mean(strangers, room.strangers, rng)
    low, high = ratio_of_means(both, own, strangers, room.strangers, rng)
    sound = np.array([not found for found in study.likeness.faults])
    orders = [metric.table_factor * _nanmean(room.paired[symbol][:, k]) for k in (0, 1)]
    return MetricSummary(
        title=metric.title,
        unit=metric.table_unit,
        version=metric.flavour(room.flavour).version,
        paired=_scaled(paired, metric.table_factor),
        paired_sound=_scaled(
            estimate_mean(both[sound], own[sound], rng), metric.table_factor
        ),
        unpaired=_scaled(unpaired, metric.table_factor),
        floor=metric.table_factor * study.floor[symbol],
        paired_by_truth={"forward": orders[0], "reverse": orders[1]},
        ratio=_ratio(unpaired.mean, paired.mean),
        ratio_low=low,
        ratio_high=high,
        superiority=superiority(both, strangers),
    )


def _coherence(study: RoomStudy) -> Coherence:
    """Average the correlations over pairs, by octave and time window."""
    fits = study.likeness.fits
    longest = max(fits, key=lambda fit: len(fit.edges))
    return Coherence(
        octaves_hz=[float(f) for f in longest.centers],
        edges_ms=[1000 * float(t) for t in np.maximum(longest.edges, 0)],
        as_recorded=_mean_over([f.coherence for f in fits]),
        matched=_mean_over([f.matched for f in fits]),
    )


def _mean_over(tables: list[FloatArray]) -> list[list[float]]:
    wide = max(table.shape[1] for table in tables)
    padded = [
        np.pad(t, [(0, 0), (0, wide - t.shape[1])], constant_values=np.nan)
        for t in tables
    ]
    stacked = np.stack(padded)
    count = np.isfinite(stacked).sum(axis=0)
    total = np.nansum(stacked, axis=0)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return [[float(v) for v in row] for row in mean]


def _scaled(estimate: Estimate, factor: float) -> Estimate:
    return replace(
        estimate,
        mean=factor * estimate.mean,
        deviation=factor * estimate.deviation,
        median=factor * estimate.median,
        low=factor * estimate.low,
        high=factor * estimate.high,
    )


def _nanmean(values: FloatArray) -> float:
    kept = values[np.isfinite(values)]
    return float(kept.mean()) if len(kept) else math.nan


def _ratio(large: float, small: float) -> float:
    if not (math.isfinite(large) and math.isfinite(small)):
        return math.nan
    return large / small if small > 0 else math.inf


def _geometric_mean(ratios: list[float]) -> float:
    if all(math.isinf(r) for r in ratios):
        return math.inf if ratios else math.nan
    # A metric may be too coarse to tell the directions apart while others do.
    kept = [r for r in ratios if math.isfinite(r)]
    if not kept:
        return math.nan
    return math.exp(sum(math.log(max(r, 1e-12)) for r in kept) / len(kept))
