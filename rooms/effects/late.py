"""The late tail: all energy that no path describes singly, as random plane waves.

Each wave has a twin with departure and arrival exchanged, and the draw depends on
the room and the seed only, never on the positions. So A to B equals B to A with
any patterns, and neighbouring places hear related tails, as in a diffuse field.
"""

from functools import lru_cache

import numpy as np

from rir.physics import decibels
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.effects.handover import STEP, flow_of, handover_time
from rooms.geometry import Shoebox
from rooms.scene import Scene
from rooms.sound import Budget, Sound, Waves

__all__ = ["LATE"]

_WAVES_PER_SAMPLE = 0.5
"""With the twins, one arrival per sample: dense enough to sound like noise."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Verdict:
    """Judge by the share of energy that leaves the listed paths."""
    if not np.any(scene.scattering) and budget.max_order is None:
        return Verdict(False, "every image is listed and nothing scatters")
    areas = scene.geometry.areas
    mean = float((areas @ scene.scattering / areas.sum()).max())
    error = float(-decibels(max(1 - mean, 1e-3)) * 2)
    on = error > tolerance.level_db / 10 or budget.max_order is not None
    reason = f"surfaces scatter up to {mean:.2f} of each reflection"
    return Verdict(on, reason, {"level_db": error, "reverberation_percent": 100.0})


@lru_cache(maxsize=4)
def _draw(
    seed: int, count: int, spacing: float, start: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Draw times, two directions and a sign for each wave."""
    rng = np.random.Generator(np.random.Philox(key=seed))
    time = start + spacing * (np.arange(count) + rng.random(count))
    ways = rng.standard_normal((2, count, 3))
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    sign = np.where(rng.random(count) < 0.5, -1.0, 1.0)
    return time, ways[0], ways[1], sign


def apply(scene: Scene, sound: Sound) -> None:
    """Add waves carrying the scattered energy and that of the images not listed."""
    if not isinstance(scene.geometry, Shoebox):
        return
    flow, budget = flow_of(scene, sound), sound.budget
    energy = flow.scattered + flow.beyond
    if sound.lattice is not None:
        after = flow.times >= handover_time(scene, sound)
        energy = energy + np.where(after[:, None], flow.images, 0.0)
    if not np.any(energy):
        return
    across = float(np.linalg.norm(scene.geometry.size)) / scene.speed_of_sound
    spacing = 1 / (_WAVES_PER_SAMPLE * budget.sample_rate)
    count = int(np.ceil((budget.duration + 2 * across) / spacing))
    time, one, other, sign = _draw(budget.seed, count, spacing, -across)
    amplitude = np.sqrt(energy * spacing / 2)
    center = scene.geometry.center
    sound.waves = Waves(time, one, other, sign, amplitude, STEP, center)


LATE = Effect("late", "diffuse tail of random plane waves", needed, apply)
