"""Responses of a box by its mirror images, shared by the tests of this folder."""

import numpy as np
import pytest

from inverse.paths.oriented_box import OrientedBox
from inverse.rows.fitset import FitSet, place_numbers
from rir import Poses

RATE, SPEED = 16000, 343.2
SIZE = np.array([5.0, 4.0, 2.8])
WALLS = np.array([0.9, 0.8, 0.85, 0.8, 0.7, 0.85])


@pytest.fixture(scope="module")
def centred_box():
    """Return the box, its middle at the origin, all walls equally clear."""
    return OrientedBox(np.eye(3), SIZE / 2, -SIZE / 2, SIZE / 2, np.ones(6))


def box_rows(emitters=4, listeners=30, n_samples=800, seed=0, latency=0, yaw=True):
    """Return a set of a box whose emitter is a cardioid turned at random."""
    rng = np.random.default_rng(seed)
    ends, turns = [], []
    for _ in range(emitters):
        place = rng.uniform(0.5, SIZE - 0.5)
        angle = rng.uniform(0, 2 * np.pi) * yaw
        for _ in range(listeners):
            ends.append((place, rng.uniform(0.4, SIZE - 0.4)))
            turns.append(angle)
    first, second = np.array([e for e, _ in ends]), np.array([h for _, h in ends])
    angle = np.array(turns)
    responses = np.array(
        [
            box_response(e, h, a, n_samples, latency)
            for e, h, a in zip(first, second, angle, strict=True)
        ]
    )
    quaternions = np.zeros((len(angle), 4))
    quaternions[:, 2], quaternions[:, 3] = np.sin(angle / 2), np.cos(angle / 2)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(angle), 1))
    return FitSet(
        responses,
        Poses(first, quaternions),
        Poses(second, still),
        RATE,
        SPEED,
        place_numbers(first),
        np.zeros(len(first), dtype=np.int64),
    )


def box_response(emitter, listener, yaw, n_samples, latency=0):
    """Return one response, sinc pulses under a 64-sample Hann window."""
    most = max(6, int(n_samples * SPEED / RATE / (2 * SIZE.min())) + 1)
    m = np.arange(-most, most + 1)
    gaps, gains, signs = [], [], []
    for axis in range(3):
        both, gain, sign = [], [], []
        for parity in (0, 1):
            gap = listener[axis] - (1 - 2 * parity) * emitter[axis]
            both.append(gap - 2 * m * SIZE[axis])
            gain.append(
                WALLS[2 * axis] ** np.abs(m - parity) * WALLS[2 * axis + 1] ** np.abs(m)
            )
            sign.append(np.full(len(m), 1.0 - 2 * parity))
        gaps.append(np.concatenate(both))
        gains.append(np.concatenate(gain))
        signs.append(np.concatenate(sign))
    v = np.stack(np.meshgrid(*gaps, indexing="ij"), -1).reshape(-1, 3)
    g = np.einsum("i,j,k->ijk", *gains).ravel()
    s = np.stack(np.meshgrid(*signs, indexing="ij"), -1).reshape(-1, 3)
    length = np.linalg.norm(v, axis=1)
    near = length < (n_samples + 40) / RATE * SPEED
    v, g, s, length = v[near], g[near], s[near], length[near]
    leave = s * v / length[:, None]
    facing = leave[:, 0] * np.cos(yaw) + leave[:, 1] * np.sin(yaw)
    level = g / length * (0.5 + 0.5 * facing)
    at = length / SPEED * RATE + latency
    first = np.floor(at).astype(int) - 31
    taps = first[:, None] + np.arange(64)
    gap = taps - at[:, None]
    pulse = np.sinc(gap) * np.cos(0.5 * np.pi * np.clip(gap / 32, -1, 1)) ** 2
    out = np.zeros(n_samples + 200)
    keep = (taps >= 0) & (taps < len(out))
    np.add.at(out, taps[keep], (level[:, None] * pulse)[keep])
    return out[:n_samples]


@pytest.fixture(scope="session")
def box_set():
    """Four emitters with 30 listeners each, cardioids turned at random."""
    return box_rows()


@pytest.fixture(scope="session")
def unseen_set():
    """Other emitters of the same box."""
    return box_rows(emitters=2, listeners=10, seed=9)


@pytest.fixture(scope="session")
def make_box_rows():
    """Return the function that makes such sets."""
    return box_rows
