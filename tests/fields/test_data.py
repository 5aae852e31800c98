import numpy as np
import pytest
from numpy.testing import assert_allclose

from fields.data import prepare
from fields.frame import SceneFrame
from rir import Dataset, GainPattern
from rir.errors import SignalError


def one_row(samples, sample_rate=48000, distance=2.0):
    return Dataset.from_arrays(
        np.asarray(samples)[None],
        np.zeros((1, 3)),
        np.array([[distance, 0, 0]]),
        sample_rate=sample_rate,
    )


def test_resampling_removes_what_the_new_rate_cannot_hold():
    times = np.arange(4800) / 48000
    high = prepare(one_row(np.sin(2 * np.pi * 15000 * times)), sample_rate=16000)
    low = prepare(one_row(np.sin(2 * np.pi * 1000 * times)), sample_rate=16000)
    inner = slice(200, 1400)
    level = high.frame.scale * np.abs(high.responses[0, inner]).max()
    kept = low.frame.scale * np.abs(low.responses[0, inner]).max()
    assert level < 1e-2 * kept


def test_resampling_keeps_the_level_of_the_filter():
    data = prepare(one_row(np.eye(1, 4800, 2400)[0]), sample_rate=16000)
    spectrum = np.abs(np.fft.rfft(data.frame.scale * data.responses[0]))
    assert_allclose(spectrum[:400], 1.0, atol=2e-3)


def test_direct_sound_is_one_over_distance_after_scaling():
    data = prepare(one_row(7e5 * np.eye(1, 100, 10)[0], distance=4.0))
    assert_allclose(data.responses[0].max(), 0.25, rtol=1e-6)
    assert_allclose(data.frame.scale * 0.25, 7e5, rtol=1e-6)


@pytest.mark.parametrize("amplitude", [1e-12, 1.0, 1e6])
def test_any_amplitude_gives_the_same_training_rows(amplitude):
    row = np.random.default_rng(0).standard_normal(64)
    data = prepare(one_row(amplitude * row))
    assert_allclose(data.responses[0], prepare(one_row(row)).responses[0], rtol=1e-5)


def test_silence_has_scale_one():
    data = prepare(one_row(np.zeros(16)))
    assert data.frame.scale == 1.0
    assert_allclose(data.responses, 0.0)


def test_rows_with_nan_are_named():
    row = np.ones(16)
    row[3] = np.nan
    with pytest.raises(SignalError, match=r"hold NaN or infinity \(first: 0\)"):
        prepare(one_row(row))


def test_duration_crops_from_the_emission_on():
    data = prepare(one_row(np.ones(4800)), duration=0.05)
    assert data.frame.n_samples == 2400


def test_frame_comes_back_from_plain_values(grid):
    frame = prepare(grid).frame
    again = SceneFrame.from_dict(frame.as_dict())
    assert_allclose(again.surface_points, frame.surface_points)
    assert again.scale == frame.scale
    assert again.mark == "SIMULATED"


def test_frame_keeps_the_patterns():
    dataset = Dataset.from_arrays(
        np.ones((1, 8)), np.zeros((1, 3)), np.ones((1, 3)), sample_rate=8000,
        emitter_gain=GainPattern.cardioid(),
    )  # fmt: skip
    frame = SceneFrame.from_dict(prepare(dataset).frame.as_dict())
    assert frame.emitter_gain == GainPattern.cardioid()
    assert frame.listener_gain is None


def test_large_sets_go_to_a_memory_map(grid, tmp_path, monkeypatch):
    monkeypatch.setattr("rir.scaled_responses.IN_MEMORY_BYTES", 1000)
    data = prepare(grid, store=tmp_path)
    assert isinstance(data.responses, np.memmap)
    assert_allclose(data.responses, prepare(grid).responses)
