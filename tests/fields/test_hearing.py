# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fields import train
from fields.hearing import Hrtf, hear_binaural, read_hrtf
from fields.render.rays import even_directions
from rir import GainPattern, Poses
from rir.pose import Pose


@pytest.fixture(scope="module")
def field(grid):
    small = {"rays": 24, "shells": 8, "width": 16, "channels": 8}
    return train(grid, model="avr", steps=3, config=small)


EMITTER = np.array([1.0, 1.0, 1.2])


def test_omni_pattern_changes_nothing(field):
    listener = Pose.at(3.0, 2.0, 1.4, yaw_deg=30)
    plain = field.predict(EMITTER, listener)
    heard = field.predict(EMITTER, listener, listener_gain=GainPattern.omni())
    assert_allclose(heard, plain, atol=1e-5 * np.abs(plain).max())


def test_banded_pattern_equals_the_broadband_one_it_repeats(field):
    listener = Pose.at(3.0, 2.0, 1.4, yaw_deg=30)
    row = GainPattern.cardioid().coefficients
    banded = GainPattern(np.repeat(row, 3, axis=0), np.array([500.0, 1000, 2000]))
    plain = field.predict(EMITTER, listener, listener_gain=GainPattern.cardioid())
    heard = field.predict(EMITTER, listener, listener_gain=banded)
    assert_allclose(heard, plain, atol=1e-4 * np.abs(plain).max())


def test_cardioid_turned_away_does_not_hear_the_direct_sound(field):
    place = np.array([3.0, 1.0, 1.2])
    toward = Poses.of(Pose.facing(place, EMITTER))
    away = Poses.of(Pose.facing(place, 2 * place - EMITTER))
    first = slice(0, int(2.0 * field.network.samples_a_metre) + 3)
    heard = [
        field.predict(EMITTER, one, listener_gain=GainPattern.cardioid())[0, first]
        for one in (toward, away)
    ]
    assert np.abs(heard[1]).max() < 0.05 * np.abs(heard[0]).max()


def test_a_head_without_shape_hears_the_omni_response(field):
    directions = even_directions(100).double().numpy()
    taps = np.zeros((100, 2, 4))
    taps[:, :, 0] = 1.0
    rate = field.frame.sample_rate
    heard = hear_binaural(field, EMITTER, [3.0, 2, 1.4], Hrtf(directions, taps, rate))
    plain = field.predict(EMITTER, np.array([3.0, 2, 1.4]))
    assert heard.shape == (1, 2, field.frame.n_samples)
    tolerance = 2e-2 * np.abs(plain).max()
    assert_allclose(heard[:, 0], plain, atol=tolerance)


def test_measured_head_hears_left_more_on_the_left(field):
    root = os.environ.get("RESOUNDING_DATA", "../shared/data")
    file = Path(root) / "hrtf_kemar" / "MIT_KEMAR_normal_pinna.sofa"
    pytest.importorskip("sofar")
    if not file.exists():
        pytest.skip("no measured HRTF here")
    hrtf = read_hrtf(file)
    # The emitter stands to the left of a head that looks along +x.
    heard = hear_binaural(field, [3.0, 3.0, 1.4], Pose.at(3.0, 1.0, 1.4), hrtf)
    first = slice(0, int(2.0 * field.network.samples_a_metre) + 12)
    left, right = np.square(heard[0, :, first]).sum(axis=-1)
    assert left > 2 * right
