"""Made-up sessions with known faults, for trying out how faults are named.

A rigid-walled box of image sources with displaced ends and warmed air; nothing here
is a room simulator, only a response whose every arrival moves as it must.
"""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray
from rir.dataset import Dataset
from rir.physics import speed_of_sound

__all__ = ["FAULT_KINDS", "TrialBox", "trial_session"]

TYPICAL_PEAK = 0.4
"""Direct sound at 2.5 m: the room is as noisy for every pair."""

FAULT_KINDS = ("gain", "position", "temperature", "swapped", "noise")


@dataclass(frozen=True)
class TrialBox:
    """A box whose images reach through the whole response.

    Parameters
    ----------
    size : tuple of float
        Edges [m].
    reflection : float
        Pressure reflection factor of every wall.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Length of a response [s].
    """

    size: tuple[float, float, float] = (5.2, 4.1, 2.9)
    reflection: float = 0.82
    sample_rate: int = 32000
    duration: float = 0.3
    oversampling: int = 24

    def images(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return lattice shifts (k, 3) [m], signs (k, 3), and gains (k,)."""
        reach = 345 * self.duration + 6
        counts = [np.arange(-(n := int(reach / (2 * s)) + 1), n + 1) for s in self.size]
        cells = np.stack(np.meshgrid(*counts, indexing="ij"), -1).reshape(-1, 3)
        shifts, signs, gains = [], [], []
        for flips in np.ndindex(2, 2, 2):
            shift = 2 * cells * np.array(self.size)
            near = np.linalg.norm(shift, axis=1) < reach
            walls = np.abs(2 * cells[near] - flips).sum(axis=1)
            shifts.append(shift[near])
            signs.append(np.broadcast_to(1.0 - 2 * np.array(flips), (near.sum(), 3)))
            gains.append(self.reflection**walls)
        return np.concatenate(shifts), np.concatenate(signs), np.concatenate(gains)

    def response(
        self,
        emitter: FloatArray,
        listener: FloatArray,
        temperature_c: float = 20.0,
        facing: FloatArray | None = None,
    ) -> FloatArray:
        """Return a response; `facing` gives the emitter a cardioid pattern."""
        from scipy.fft import irfft, rfft

        shifts, signs, gains = self.images()
        # Listener images seen from the emitter: swapping the ends mirrors the ray.
        ray = shifts + signs * listener - emitter
        distance = np.linalg.norm(ray, axis=1)
        amplitude = gains / distance
        if facing is not None:
            amplitude = amplitude * 0.5 * (1 + ray @ facing / distance)
        count = round(self.duration * self.sample_rate)
        fine = self.oversampling * count
        delay = distance / speed_of_sound(temperature_c) * self.sample_rate
        index = np.rint(delay * self.oversampling).astype(int)
        inside = index < fine
        train = np.bincount(index[inside], amplitude[inside], minlength=fine)
        spectrum = np.asarray(rfft(train))[: count // 2 + 1]
        return np.asarray(irfft(spectrum * self._band(len(spectrum), count), count))

    def _band(self, bins: int, count: int) -> FloatArray:
        """Return the band of a loudspeaker, 80 Hz to 0.42 of the sample rate."""
        f = np.arange(bins) * self.sample_rate / count
        high = 1 / (1 + (f / (0.42 * self.sample_rate)) ** 64)
        return high * (f**4 / (f**4 + 80.0**4))


def trial_session(
    n_pairs: int,
    faults: dict[int, str],
    rng: np.random.Generator,
    *,
    noise_db: float = -60.0,
    gain_step_db: float = 0.5,
    offset_m: float = 0.005,
    warming_k: float = 0.3,
    directional: bool = False,
    box: TrialBox | None = None,
) -> Dataset:
    """Return a session whose pairs have the given faults.

    Healthy pairs scatter as a careful session does: 0.02 dB, 0.2 mm, 0.02 K.

    Parameters
    ----------
    n_pairs : int
        Pairs in the session.
    faults : dict of int to str
        Kind of fault by pair; a swapped pair exchanges its reverse take with that
        of the next pair.
    rng : numpy.random.Generator
        Draws places, scatter and noise.
    noise_db, gain_step_db, offset_m, warming_k : float
        Noise re the direct sound at 2.5 m, and the sizes of the faults.
    directional : bool
        Whether the emitter is a cardioid that faces one way.
    box : TrialBox, optional
        The room.
    """
    room = box or TrialBox()
    facing = np.array([1.0, 0.0, 0.0]) if directional else None
    forward, reverse, ends = [], [], []
    for pair in range(n_pairs):
        a, b = _places(room, rng)
        kind = faults.get(pair, "")
        moved = b + _direction(rng) * (
            offset_m if kind == "position" else abs(rng.normal(0, 0.0002))
        )
        warm = 20 + rng.normal(0, 0.02) + (warming_k if kind == "temperature" else 0.0)
        gain = rng.normal(0, 0.02) + (gain_step_db if kind == "gain" else 0.0)
        there = room.response(a, b, 20.0, facing)
        back = room.response(moved, a, warm, facing) * 10 ** (gain / 20)
        floors = [noise_db, noise_db + (25.0 if kind == "noise" else 0.0)]
        forward.append(_noisy(there, floors[0], rng))
        reverse.append(_noisy(back, floors[1], rng))
        ends.append((a, b))
    for pair, kind in faults.items():
        if kind == "swapped":
            other = (pair + 1) % n_pairs
            reverse[pair], reverse[other] = reverse[other], reverse[pair]
    places = np.array(ends)
    return Dataset.from_arrays(
        np.concatenate([forward, reverse]),
        np.concatenate([places[:, 0], places[:, 1]]),
        np.concatenate([places[:, 1], places[:, 0]]),
        sample_rate=room.sample_rate,
        room_name="trial box",
        session="trial",
        columns={
            "pair_id": np.tile(np.arange(n_pairs), 2),
            "direction": np.repeat(["AB", "BA"], n_pairs),
        },
    )


def _places(room: TrialBox, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    while True:
        a, b = rng.uniform(0.5, np.array(room.size) - 0.5, (2, 3))
        if np.linalg.norm(a - b) > 0.8:
            return a, b


def _direction(rng: np.random.Generator) -> FloatArray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _noisy(
    samples: FloatArray, floor_db: float, rng: np.random.Generator
) -> FloatArray:
    rms = TYPICAL_PEAK * 10 ** (floor_db / 20)
    return samples + rms * rng.standard_normal(len(samples))
