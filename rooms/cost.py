"""What accuracy costs in a scene: error against seconds, knob by knob.

The files are those of `analysis.cost`, which draws and compares them.
"""

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import Poses
from rir.physics import decibels
from rir.records import software_version
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.simulation import simulate

__all__ = ["Curve", "measure_knobs"]

FloatArray = NDArray[np.float64]
_RAYS = (1000, 4000, 16000, 64000)
_ORDERS = (1, 3, 6, 10, 17, 30)
_MESH_ORDERS = (0, 1, 2, 3, 4, 5)
_BEST_RAYS = 256_000


@dataclass(frozen=True)
class Curve:
    """Settings of one knob with their seconds per pair and error.

    Parameters
    ----------
    knob : str
        What was turned.
    points : tuple of (setting, seconds, error)
        Error in C50 [dB], the mean over octaves and pairs.
    """

    knob: str
    points: tuple[tuple[str, float, float], ...]

    @property
    def front(self) -> list[int]:
        """Points that no other beats in both ways, cheapest first."""
        kept = [
            k
            for k, (_, s, e) in enumerate(self.points)
            if not any(
                (t <= s and d <= e and (t < s or d < e)) for _, t, d in self.points
            )
        ]
        return sorted(kept, key=lambda k: self.points[k][1])

    @property
    def knee(self) -> int:
        """The recommended point: farthest under the line between the front's ends."""
        front = self.front
        if len(front) < 3:
            return front[-1]
        x = [math.log(max(self.points[k][1], 1e-9)) for k in front]
        y = [math.log(max(self.points[k][2], 1e-9)) for k in front]
        wide, tall = x[-1] - x[0], y[0] - y[-1]
        if not wide or not tall:
            return front[0]
        depth = [
            (y[0] - b) / tall - (a - x[0]) / wide for a, b in zip(x, y, strict=True)
        ]
        return front[int(np.argmax(depth))]

    @property
    def sentence(self) -> str:
        """The recommendation in words."""
        setting, seconds, error = self.points[self.knee]
        return (
            f"{self.knob} {setting}: {error:.2g} dB of C50 costs"
            f" {1000 * seconds:.3g} ms a pair here"
        )

    def plain(self) -> dict[str, Any]:
        """Return the curve as plain data in the format of `analysis.cost`."""
        points = [
            {
                "setting": setting,
                **dict.fromkeys(("seconds", "seconds_low", "seconds_high"), seconds),
                **dict.fromkeys(("error", "error_low", "error_high"), error),
                "repeats": 1,
                "on_front": k in self.front,
            }
            for k, (setting, seconds, error) in enumerate(self.points)
        ]
        head = {"format": "resounding-cost", "schema": 1}
        body = {"knob": self.knob, "quantity": "C50", "unit": "dB", "points": points}
        rest = {"seconds_of": "CPU", "knee": self.knee, "sentence": self.sentence}
        return {**head, "software": software_version(), **body, **rest}

    def save(self, path: str | Path) -> Path:
        """Write the curve as JSON."""
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(json.dumps(self.plain(), indent=1) + "\n", encoding="utf-8")
        return target


def clarity_per_octave(
    responses: FloatArray, sample_rate: int, centers: FloatArray
) -> FloatArray:
    """Return C50 per response and octave [dB], shape (..., bands)."""
    from rooms.bands import band_weights

    n = responses.shape[-1]
    weights = band_weights(tuple(map(float, centers)), sample_rate, 2 * n)
    spectra = np.fft.rfft(responses, 2 * n)[..., None, :] * weights
    energy = np.fft.irfft(spectra, 2 * n)[..., :n] ** 2
    first = np.argmax(np.abs(responses) > 0.1 * np.abs(responses).max(), axis=-1)
    split = first[..., None, None] + round(0.05 * sample_rate)
    early = np.where(np.arange(n) < split, energy, 0.0).sum(axis=-1)
    late = energy.sum(axis=-1) - early
    return decibels(np.maximum(early, 1e-30) / np.maximum(late, 1e-30))


def measure_knobs(
    scene: Scene,
    emitters: Poses,
    listeners: Poses,
    *,
    sample_rate: int,
    duration: float,
    clock: Callable[[], float] = time.process_time,
) -> list[Curve]:
    """Measure error against seconds for each knob that matters in a scene.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    emitters, listeners : Poses
        The pairs to take the mean over.
    sample_rate, duration : float
        Rate [Hz] and length [s] of the reference.
    clock : callable
        Answers processor seconds.

    Returns
    -------
    list of Curve
        Reflection order; rays, unless the scene needs none; length; and whether
        octaves are told apart.
    """
    boxed = isinstance(scene.geometry, Shoebox)
    fixed = {"sample_rate": sample_rate, "duration": duration}
    best = {} if boxed else {"rays": _BEST_RAYS, "max_order": _MESH_ORDERS[-1]}
    heard = scene.bands[scene.bands < sample_rate / 2]

    def run(**options: Any) -> tuple[float, FloatArray]:
        all_options = {**fixed, **best, **options}
        simulate(scene, emitters[:1], listeners[:1], **all_options)  # warm caches
        start = clock()
        made = simulate(scene, emitters, listeners, **all_options)
        took = (clock() - start) / (len(emitters) * len(listeners))
        return took, clarity_per_octave(made.responses, sample_rate, heard)

    run(duration=0.05)  # compiling is not part of the cost
    _, truth = run()

    def curve(knob: str, settings: Sequence[tuple[str, dict[str, Any]]]) -> Curve:
        points = []
        for name, options in settings:
            took, clarity = run(**options)
            points.append((name, took, float(np.mean(np.abs(clarity - truth)))))
        return Curve(knob, tuple(points))

    orders = _ORDERS if boxed else _MESH_ORDERS
    curves = [curve("order", [(f"{n}", {"max_order": n}) for n in orders])]
    if not boxed:
        curves.append(curve("rays", [(f"{n}", {"rays": n}) for n in _RAYS]))
    shares = (0.125, 0.25, 0.5, 0.75)
    lengths = [(f"{s * duration:.2f} s", {"duration": s * duration}) for s in shares]
    return [*curves, curve("length", lengths)]
