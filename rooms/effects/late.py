"""The late tail: all energy that no path describes singly, as random plane waves.

Each wave has a twin with departure and arrival exchanged, and the draw depends on
the room and the seed only, never on the positions. So A to B equals B to A with
any patterns, and neighbouring places hear related tails, as in a diffuse field.
"""

from functools import lru_cache

import numpy as np

from rir.physics import REFERENCE_TEMPERATURE_C, speed_of_sound
from rooms.effects import scattering
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.effects.handover import flow_energy, missing_energy
from rooms.effects.traced import traced_energy
from rooms.scene import Scene
from rooms.sound import Budget, Sound, Waves

__all__ = ["LATE", "draw_waves"]

_WAVES_PER_SAMPLE = 0.5
"""With the twins, one arrival per sample: dense enough to sound like noise."""

_DIRECTION_STEPS = 1.1673039782614187 ** -np.arange(1.0, 5.0)
"""Steps between the directions of waves, which fill both spheres evenly: powers of the
root of x^5 = x + 1 (M. Roberts, The unreasonable effectiveness of quasirandom
sequences, 2018)."""


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the energy that the listed images leave out."""
    errors = missing_energy(scene, budget)
    if not errors:
        return Need(False, "every image is listed and nothing scatters")
    why = "scattered" if np.any(scene.scattering) else "high-order"
    cost = 2e-7 * budget.n_samples
    if scattering.needed(scene, budget, tolerance).on:
        return Need(True, "it carries what scattering takes", errors, cost)
    return judged(tolerance, errors, f"{why} energy in no listed path", cost)


@lru_cache(maxsize=4)
def draw_waves(
    seed: int, count: int, spacing: float, start: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Draw times, two directions and a sign for each wave.

    Chance is that of signs: directions drawn one by one would arrive in clumps, which
    all listeners of an emitter hear.
    """
    # one stream per quantity: a longer response begins with the same waves
    times, ways, signs = (
        np.random.Generator(np.random.Philox(key=[seed % 2**64, stream]))
        for stream in range(3)
    )
    time = start + spacing * (np.arange(count) + times.random(count))
    index = np.arange(1, count + 1)[:, None]
    u = (ways.random(4) + index * _DIRECTION_STEPS) % 1
    up, turn = 2 * u[:, :2] - 1, 2 * np.pi * u[:, 2:]
    flat = np.sqrt(1 - up**2)
    way = np.stack([flat * np.cos(turn), flat * np.sin(turn), up], axis=-1)
    sign = np.where(signs.random(count) < 0.5, -1.0, 1.0)
    one, other = np.ascontiguousarray(np.swapaxes(way, 0, 1))
    return time, one, other, sign


def apply(scene: Scene, sound: Sound) -> None:
    """Add waves carrying the scattered energy and that of the images not listed."""
    budget = sound.budget
    boxed = scene.geometry.lattice and budget.rays is None
    energy, step = (flow_energy if boxed else traced_energy)(scene, sound)
    if not np.any(energy):
        return
    # Paths are drawn by length: in warmer air the same waves arrive sooner.
    sooner = speed_of_sound(REFERENCE_TEMPERATURE_C) / scene.speed_of_sound
    across = float(np.linalg.norm(scene.geometry.size)) / scene.speed_of_sound / sooner
    spacing = 1 / (_WAVES_PER_SAMPLE * budget.sample_rate)
    count = int(np.ceil((budget.duration / min(sooner, 1) + 2 * across) / spacing))
    time, one, other, sign = draw_waves(budget.seed, count, spacing, -across)
    time = sooner * time
    amplitude = np.sqrt(energy * spacing * sooner / 2)
    center = scene.geometry.center
    sound.waves = Waves(time, one, other, sign, amplitude, step, center)


LATE = Effect("late", "diffuse tail of random plane waves", needed, apply)
