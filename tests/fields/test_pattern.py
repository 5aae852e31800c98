# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import numpy as np
import pytest
from numpy.testing import assert_allclose

from fields.data import prepare
from fields.pattern import fit_emitter_pattern
from fields.training.schedule import step_random
from rir import Dataset, GainPattern, Pose, Poses

RATE, SPEED = 16000, 343.2


def directional_set(pattern, count=80, noise=0.0, seed=0):
    """Free-field responses of a turned directional emitter."""
    rng = np.random.default_rng(seed)
    emitters = [
        Pose.at(*rng.uniform(-0.5, 0.5, 3), yaw_deg=rng.uniform(0, 360))
        for _ in range(count)
    ]
    turns = rng.standard_normal((count, 3))
    offsets = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    distances = rng.uniform(0.8, 2.0, (count, 1))
    places = np.array([pose.position for pose in emitters])
    listeners = places + distances * offsets
    gains = np.array(
        [
            pattern.gain(pose.to_local(offset))[0]
            for pose, offset in zip(emitters, offsets, strict=True)
        ]
    )
    times = np.arange(320)
    delay = distances / SPEED * RATE
    level = gains[:, None] / distances
    responses = level * np.sinc(times - delay) + noise * rng.standard_normal(
        (count, 320)
    )
    # A box far away keeps the gate open.
    corners = np.array([[-20.0, -20, -20], [20, 20, 20]])
    return Dataset.from_arrays(
        np.vstack([responses, np.zeros((2, 320))]),
        Poses(
            np.vstack([places, corners]),
            np.vstack([[p.orientation for p in emitters], np.eye(4)[[3, 3]]]),
        ),
        Poses.of(np.vstack([listeners, corners[::-1]])),
        sample_rate=RATE,
    )


@pytest.mark.parametrize(
    "pattern", [GainPattern.omni(), GainPattern.cardioid(), GainPattern.first_order(0)]
)
def test_pattern_is_recovered_from_responses(pattern):
    data = prepare(directional_set(pattern))
    found = fit_emitter_pattern(data)
    directions = np.random.default_rng(1).standard_normal((50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    recovered = data.frame.scale * found.pattern.gain(directions)
    assert_allclose(recovered, pattern.gain(directions), atol=0.01)


def test_pattern_bears_noise():
    data = prepare(directional_set(GainPattern.cardioid(), noise=1e-3))
    found = fit_emitter_pattern(data)
    front, back = found.pattern.gain(np.array([[1.0, 0, 0], [-1.0, 0, 0]]))[:, 0]
    assert_allclose(data.frame.scale * np.array([front, back]), [1, 0], atol=0.02)


def test_too_few_responses_give_no_pattern():
    data = prepare(directional_set(GainPattern.omni(), count=2))
    assert fit_emitter_pattern(data) is None


def test_random_axes_are_rotations():
    import torch

    from fields.selfsupervised.poses import random_axes

    axes = random_axes(20, step_random(0, 0))
    assert_allclose(
        (axes.transpose(1, 2) @ axes).numpy(), np.tile(np.eye(3), (20, 1, 1)), atol=1e-5
    )
    assert_allclose(torch.linalg.det(axes).numpy(), 1.0, atol=1e-5)
