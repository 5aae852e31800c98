"""Rows of simulated rooms as the path field takes them, for benchmarks and tests."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.regions import Regions
from rir import Poses
from rooms import Scene, simulate

CLEAR = ("patterns", "direct", "specular")
BENT = (*CLEAR, "diffraction")
ROUGH = (*BENT, "scattering", "late")
SPEED = 343.2


def upright(yaw: np.ndarray) -> np.ndarray:
    """Return orientations that are turned by a yaw only, shape (rows, 4)."""
    turns = np.zeros((len(yaw), 4))
    turns[:, 2], turns[:, 3] = np.sin(yaw / 2), np.cos(yaw / 2)
    return turns


def fit_rows(
    responses: np.ndarray,
    emitters: np.ndarray,
    listeners: np.ndarray,
    rate: float,
    speed: float = SPEED,
    yaw: np.ndarray | None = None,
) -> FitSet:
    """Return a set of one recording block: places (rows, 3), emitters turned by yaw."""
    turned = Poses.of(emitters) if yaw is None else Poses(emitters, upright(yaw))
    blocks = np.zeros(len(responses), dtype=np.int64)
    places = place_numbers(emitters)
    return FitSet(responses, turned, Poses.of(listeners), rate, speed, places, blocks)


def simulated(
    scene: Scene,
    emitters: np.ndarray,
    yaws: np.ndarray,
    listeners: np.ndarray,
    *,
    rate: int,
    duration: float,
    effects: Sequence[str] = CLEAR,
    max_order: int | None = None,
) -> np.ndarray:
    """Return responses of emitters (E, 3) to listeners (E, L, 3): (E * L, samples)."""
    made = []
    for place, turn, mine in zip(emitters, upright(yaws), listeners, strict=True):
        found = simulate(
            scene,
            Poses(place[None], turn[None]),
            Poses.of(mine),
            sample_rate=rate,
            duration=duration,
            effects=list(effects),
            max_order=max_order,
        )
        made.append(found.responses[0])
    return np.concatenate(made)


def spoiled(
    scene: Scene,
    emitters: np.ndarray,
    yaws: np.ndarray,
    listeners: np.ndarray,
    rng: np.random.Generator,
    *,
    rate: int,
    duration: float,
    effects: Sequence[str],
    max_order: int,
    jitter: float,
    noise_db: float,
) -> FitSet:
    """Simulate rows, add noise, and state both places `jitter` metres wrong."""
    sound = simulated(
        scene,
        emitters,
        yaws,
        listeners,
        rate=rate,
        duration=duration,
        effects=effects,
        max_order=max_order,
    )
    level = 10 ** (noise_db / 20) * np.sqrt((sound**2).mean())
    sound = sound + level * rng.standard_normal(sound.shape)
    first = emitters + jitter * rng.standard_normal(emitters.shape)
    second = listeners.reshape(-1, 3)
    second = second + jitter * rng.standard_normal(second.shape)
    count = listeners.shape[1]
    first = first.repeat(count, axis=0)
    return fit_rows(sound, first, second, rate, yaw=yaws.repeat(count))


def loudspeaker(samples: int, rate: float) -> np.ndarray:
    """Return a response over frequency: a high-pass, and a roll-off from 7 kHz."""
    hertz = np.fft.rfftfreq(samples, 1 / rate)
    ratio = 1j * hertz / 60.0
    high_pass = ratio**2 / (1 + np.sqrt(2) * ratio + ratio**2)
    edge = np.cos(0.5 * np.pi * np.clip((hertz - 7000) / 1000, 0, 1)) ** 2
    return high_pass * edge


def level_errors(truth: np.ndarray, answer: np.ndarray) -> np.ndarray:
    """Return the normalised squared error of each row, in decibels."""
    power = np.maximum((truth**2).sum(axis=1), 1e-300)
    return 10 * np.log10(((truth - answer) ** 2).sum(axis=1) / power + 1e-30)


@dataclass(frozen=True, eq=False)
class BoxRegions(Regions):
    """Hold regions that are known boxes.

    A place inside a box has its flag, any other that of the nearest box.

    Parameters
    ----------
    corners : ndarray, shape (regions, 2, 3)
        Low and high, metres.
    """

    corners: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray) -> "BoxRegions":
        """Return regions that are boxes of given corners."""
        return cls(corners.mean(axis=1), np.eye(len(corners)), corners)

    def __call__(self, positions: np.ndarray) -> np.ndarray:
        """Return shares of regions, shape (places, regions)."""
        low, high = self.corners[:, 0], self.corners[:, 1]
        out = np.maximum(low - positions[:, None], positions[:, None] - high)
        nearest = np.argmin(np.linalg.norm(np.maximum(out, 0), axis=-1), axis=1)
        return self.shares[nearest]
