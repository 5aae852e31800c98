"""Spend as much work as an accuracy asks for, or a time allows."""

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.physics import decibels
from rooms.sound import Budget, Sound

__all__ = [
    "Target",
    "listed_energy",
    "parse_accuracy",
    "sampling_errors",
    "spread_errors",
]

_KINDS = {
    "C50": "clarity_db",
    "T60": "reverberation_percent",
    "EDT": "early_decay_percent",
    "LEVEL": "level_db",
}
_UNITS = {"C50": "dB", "T60": "%", "EDT": "%", "LEVEL": "dB"}
_PAIRS = 8  # tell the mean error of any number of pairs to a tenth of it
_DRAWS = 24  # tell a standard error to a seventh of it
_FIRST_RAYS = 4000  # enough to estimate their own chance error
_MOST_RAYS = 4_000_000  # a thousand times that: a thirtieth of the error
_CLEAREST = 30.0  # dB: late sound of a thousandth of the energy is not heard


def parse_accuracy(text: str | Mapping[str, float] | None) -> dict[str, float]:
    """Return error limits by kind from words such as "C50 0.1 dB, T60 1 %".

    Raises
    ------
    SignalError
        If a part is not a known quantity, a number and its unit.

    Examples
    --------
    >>> parse_accuracy("C50 0.1 dB, T60 1 %")
    {'clarity_db': 0.1, 'reverberation_percent': 1.0}
    """
    if text is None:
        return {}
    if isinstance(text, Mapping):
        text = ", ".join(f"{name} {value}" for name, value in text.items())
    limits = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\w+)\s+([0-9.eE+-]+)\s*(dB|%)?\s*", part)
        name = match.group(1).upper() if match else ""
        if match is None or name not in _KINDS:
            raise SignalError(
                f"cannot read the accuracy {part.strip()!r}; write, for instance,"
                f" 'C50 0.1 dB' (known: {', '.join(_KINDS)})"
            )
        if match.group(3) not in (None, _UNITS[name]):
            raise SignalError(
                f"{name} is stated in {_UNITS[name]}, not {match.group(3)}"
            )
        limits[_KINDS[name]] = float(match.group(2))
    if not all(limit > 0 for limit in limits.values()):
        raise SignalError("an accuracy must be a positive number")
    return limits


@dataclass(frozen=True)
class Target:
    """When to stop: errors small enough, or time used up."""

    limits: dict[str, float]
    """Largest errors by kind; empty for none."""
    seconds: float | None = None
    """Processor time that may be spent [s]."""

    @property
    def open_ended(self) -> bool:
        """Whether neither accuracy nor time was asked for."""
        return not self.limits and self.seconds is None

    def met(self, errors: dict[str, float]) -> bool:
        """Tell whether every limited error is small enough."""
        return all(
            errors.get(kind, 0.0) <= limit for kind, limit in self.limits.items()
        )

    def pursue(
        self,
        budget: Budget,
        attempt: Callable[[Budget], dict[str, float]],
        clock: Callable[[], float] = time.process_time,
    ) -> Budget:
        """Attempt with more and more rays until the target is met; return the last.

        Each attempt traces four times the rays of the one before, so the sum of all
        is a third more than the last alone. With a time only, the last attempt is
        the largest that is expected to fit.
        """
        start = clock()
        rays = budget.rays or budget.work.rays or _FIRST_RAYS
        while True:
            budget = replace(budget, rays=rays)
            before = clock()
            errors = attempt(budget)
            took = clock() - before
            if self.limits and self.met(errors):
                return budget
            if not errors or rays >= _MOST_RAYS:
                return budget
            late = self.seconds is not None and (
                clock() - start + 4 * took > self.seconds
            )
            if late:
                return budget
            rays *= 4


def sampling_errors(sound: Sound) -> dict[str, float]:
    """Return the standard errors of what was traced; zero where nothing was."""
    if sound.traced is None or not len(sound.listeners):
        kinds = ("level_db", "clarity_db", "reverberation_percent")
        return dict.fromkeys((*kinds, "early_decay_percent"), 0.0)
    histogram, step = sound.traced, sound.traced.time_step
    energy = histogram.energy[0]
    paths, arrival = listed_energy(sound, step, energy.shape[-1])
    some = slice(None, None, max(1, len(energy) // _PAIRS))
    error = histogram.error[0][some]
    return spread_errors(energy[some], error, paths[some], step, arrival[some])


def listed_energy(
    sound: Sound, step: float, bins: int
) -> tuple[FloatArray, FloatArray]:
    """Return the energy of paths, (listeners, bands, bins), and first arrivals [s]."""
    paths = np.zeros((len(sound.listeners), len(sound.scene.bands), bins))
    for arrivals in sound.arrivals:
        at = (arrivals.delay / step).astype(int)
        inside = at < bins
        for band in range(paths.shape[1]):
            where = arrivals.listener[inside], np.full(inside.sum(), band), at[inside]
            np.add.at(paths, where, arrivals.gain[inside, band] ** 2)
    way = np.linalg.norm(sound.listeners.positions - sound.emitter.position, axis=1)
    return paths, way / sound.scene.speed_of_sound


def spread_errors(
    energy: FloatArray,
    error: FloatArray,
    paths: FloatArray,
    step: float,
    arrival: FloatArray | float = 0.0,
) -> dict[str, float]:
    """Return what the standard error of a histogram does to the parameters.

    Parameters
    ----------
    energy, error : ndarray, shape (pairs, bands, bins)
        Traced energy per bin and its standard error.
    paths : ndarray, shape (pairs, bands, bins)
        Energy per bin of the paths listed singly, which is exact.
    step : float
        Width of a bin [s].
    arrival : ndarray, shape (pairs,)
        When the direct sound comes [s].

    Returns
    -------
    dict
        Standard errors, the mean over pairs and the worst octave: "level_db",
        "clarity_db", "reverberation_percent", "early_decay_percent".
    """
    rng = np.random.default_rng(0)
    chance = rng.standard_normal((_DRAWS, *energy.shape))
    drawn = np.maximum(energy + error * chance, 0) + paths
    arrivals = np.tile(np.broadcast_to(arrival, len(energy)), _DRAWS)
    flat = drawn.reshape(-1, *energy.shape[1:])
    values = decay_parameters(flat, step, arrivals)
    values = values.reshape(len(values), _DRAWS, len(energy), -1)
    # a draw may leave nothing after the early sound, and be infinitely clear
    values[1] = np.clip(values[1], -_CLEAREST, _CLEAREST)
    with np.errstate(invalid="ignore", divide="ignore"):
        center, spread = values.mean(axis=1), values.std(axis=1)
        kinds = {
            "level_db": spread[0],
            "clarity_db": spread[1],
            "reverberation_percent": 100 * spread[2] / center[2],
            "early_decay_percent": 100 * spread[3] / center[3],
        }
    return {kind: _worst(values) for kind, values in kinds.items()}


def _worst(values: FloatArray) -> float:
    """Return the mean over pairs in the octave where it is largest."""
    known = np.where(np.isfinite(values), values, 0.0)
    return float(known.mean(axis=0).max(initial=0.0))


def decay_parameters(
    energy: FloatArray, step: float, arrival: FloatArray | float = 0.0
) -> FloatArray:
    """Return level, clarity, T and EDT, each (pairs, bands), stacked.

    Parameters
    ----------
    energy : ndarray, shape (pairs, bands, bins)
        Energy per bin since the emission.
    step : float
        Width of a bin [s].
    arrival : ndarray, shape (pairs,)
        When the direct sound comes [s]; clarity counts from there (ISO 3382-1).
    """
    left = np.cumsum(energy[..., ::-1], axis=-1)[..., ::-1]
    total = np.maximum(left[..., 0], 1e-300)
    early = np.maximum(1, np.round((0.05 + np.asarray(arrival)) / step).astype(int))
    last = np.minimum(early, left.shape[-1] - 1)
    last = np.broadcast_to(last, left.shape[:1])[:, None, None]
    late = np.maximum(np.take_along_axis(left, last, axis=-1)[..., 0], 1e-300)
    curve = np.maximum(decibels(left / total[..., None]), -200.0)
    clarity = decibels(np.maximum(total - late, 1e-300) / late)
    return np.stack(
        [
            decibels(total),
            clarity,
            _fitted(curve, step, -5, -35),
            _fitted(curve, step, 0.1, -10),
        ]
    )


def _fitted(curve: FloatArray, step: float, high: float, low: float) -> FloatArray:
    """Return the decay time between two levels by least squares [s]."""
    inside = (curve <= high) & (curve >= low)
    count = np.maximum(inside.sum(axis=-1), 1)
    times = step * np.arange(curve.shape[-1])
    mean_t = (inside * times).sum(axis=-1) / count
    mean_l = (inside * curve).sum(axis=-1) / count
    away = np.where(inside, times - mean_t[..., None], 0.0)
    slope = (away * (curve - mean_l[..., None])).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        fitted = -60 * (away**2).sum(axis=-1) / slope
    return np.where(count >= 3, fitted, np.nan)
