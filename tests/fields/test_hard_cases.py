# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
"""Odd inputs give finite losses and gradients, or one clear error."""

import numpy as np
import pytest

from fields import FIELDS, train
from rir import Dataset
from rir.errors import SignalError

RATE = 8000
PLACES = np.array([[1.0, 1.0, 1.2], [3.0, 1.0, 1.4], [2.0, 2.5, 1.0], [3.5, 2.5, 1.6]])


def responses(count, n_samples=160, seed=0):
    rng = np.random.default_rng(seed)
    decay = np.exp(-np.arange(n_samples) / 40)
    return rng.standard_normal((count, n_samples)) * decay


def dataset(samples, emitters=None, listeners=None):
    count = len(samples)
    first = np.resize(PLACES, (count, 3)) if emitters is None else emitters
    second = np.resize(PLACES[::-1], (count, 3)) if listeners is None else listeners
    return Dataset.from_arrays(samples, first, second, sample_rate=RATE)


def with_silent_row():
    samples = responses(4)
    samples[1] = 0.0
    return samples


def loud_beside_quiet():
    return responses(4) * np.array([1e6, 1e-12, 1.0, 1.0])[:, None]


CASES = {
    "ends at one place": lambda: dataset(responses(4), listeners=PLACES),
    "listener on a wall": lambda: dataset(
        responses(4), listeners=PLACES * np.array([0.0, 1.0, 1.0])
    ),
    "silence": lambda: dataset(np.zeros((4, 160))),
    "one silent response": lambda: dataset(with_silent_row()),
    "amplitude 1e-12": lambda: dataset(1e-12 * responses(4)),
    "amplitude 1e6": lambda: dataset(1e6 * responses(4)),
    "amplitudes far apart": lambda: dataset(loud_beside_quiet()),
    "one response": lambda: dataset(responses(1)),
    "one emitter": lambda: dataset(responses(4), emitters=np.tile(PLACES[0], (4, 1))),
    "duplicate poses": lambda: dataset(
        responses(4), np.tile(PLACES[0], (4, 1)), np.tile(PLACES[1], (4, 1))
    ),
    "half precision": lambda: dataset(responses(4).astype(np.float16)),
    "0.02 s": lambda: dataset(responses(4, 160)),
    "1 s": lambda: dataset(responses(4, RATE)),
    "one sample": lambda: dataset(responses(4, 1)),
}


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("model", list(FIELDS))
def test_odd_data_train_without_harm(model, case):
    data = CASES[case]()
    field = train(data, model=model, exchange=True, steps=2)
    answer = field.predict(data.emitters, data.listeners)
    assert answer.shape == (len(data), data.n_samples)
    assert np.isfinite(answer).all()
    if FIELDS[model].neural:
        assert field.report["skipped_steps"] == 0
        assert field.report["mended_steps"] == 0


@pytest.mark.parametrize("model", list(FIELDS))
def test_nan_is_one_clear_error(model):
    samples = responses(4)
    samples[2, 5] = np.nan
    with pytest.raises(SignalError, match="first: 2"):
        train(dataset(samples), model=model, steps=1)


@pytest.mark.parametrize("form", ["pattern", "teacher", "paper", "contrastive"])
@pytest.mark.parametrize("case", ["ends at one place", "silence", "one response"])
def test_self_supervision_bears_odd_data(form, case):
    field = train(CASES[case](), model="avr", self_supervised=form, steps=2)
    assert field.report["skipped_steps"] == 0


def test_random_small_models_stay_finite():
    rng = np.random.default_rng(8)
    settings = {
        "inras": {"width": 8, "depth": 1, "bounce_points": 3},
        "naf": {"width": 8, "depth": 2, "grid_features": 2},
        "av-nerf": {"width": 8, "depth": 1, "view_rows": 2, "view_columns": 3},
        "avr": {"rays": 5, "shells": 4, "width": 8, "channels": 3, "proposals": 2},
        "diffrir": {"order": 1, "axial_order": 1, "directions": 8},
    }
    for seed in range(40):
        model = list(settings)[seed % len(settings)]
        count, length = rng.integers(1, 5), int(rng.integers(1, 90))
        scale = 10.0 ** rng.uniform(-12, 6)
        emitters, listeners = rng.uniform(-9, 9, (2, count, 3))
        data = dataset(scale * responses(count, length, seed), emitters, listeners)
        field = train(data, model=model, config=settings[model], steps=1, seed=seed)
        assert field.report["mended_steps"] == 0
        assert np.isfinite(field.predict(emitters, listeners)).all()
