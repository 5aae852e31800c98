from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from capture.config import SessionConfig
from capture.devices.stage import set_stage
from capture.interfaces import AudioInterface, Recording
from capture.plan import build_plan
from capture.session.preflight import (
    Preflight,
    find_loopback,
    lock_settings,
    short_sweep,
)
from rir import InterfaceError

MakeConfig = Callable[..., SessionConfig]


class Bent:
    """An interface whose channels are changed on the way in."""

    def __init__(
        self, inner: AudioInterface, change: Callable[[np.ndarray], np.ndarray]
    ) -> None:
        self._inner = inner
        self._change = change
        self.sample_rate, self.n_inputs = inner.sample_rate, inner.n_inputs
        self.loopback, self.simulated = inner.loopback, inner.simulated

    def play_record(
        self, signal: np.ndarray, n_samples: int, *, label: str, output: int = 0
    ) -> Recording:
        take = self._inner.play_record(signal, n_samples, label=label, output=output)
        return Recording(self._change(take.samples), take.sample_rate)

    def describe(self) -> dict[str, Any]:
        return self._inner.describe()

    def close(self) -> None:
        self._inner.close()


def check(
    config: SessionConfig, change: Callable[[np.ndarray], np.ndarray] = np.copy
) -> Preflight:
    stage = set_stage(config)
    stage.mover.place(build_plan(config).moves[0])
    return Preflight.of(Bent(stage.open_interface(), change), config)


def test_a_good_set_up_is_found_and_locked(make_config: MakeConfig) -> None:
    config = make_config(simulation={"noise_db": -60.0})
    found = check(config)
    assert found.problems == []
    assert found.lines[0] == "loopback found on input 2"
    settings = lock_settings(config, found)
    assert settings["sweep"]["amplitude_dbfs"] == found.amplitude_dbfs
    assert -40 <= found.amplitude_dbfs <= -3


def test_a_loopback_on_another_input_is_named(make_config: MakeConfig) -> None:
    found = check(make_config(), lambda samples: samples[::-1])
    assert "loopback is on input 1, but input 2 is configured" in found.problems[0]


def test_a_missing_loopback_is_told(make_config: MakeConfig) -> None:
    found = check(make_config(), lambda samples: samples[[0, 0]])
    assert "no input carries the loopback" in found.problems[0]


def test_a_quiet_microphone_is_told(make_config: MakeConfig) -> None:
    scale = np.array([[1e-3], [1.0]])
    found = check(make_config(), lambda samples: samples * scale)
    assert "turn the microphone preamplifier up" in found.problems[0]


def test_a_limiter_is_told(make_config: MakeConfig) -> None:
    found = check(make_config(), lambda s: np.stack((np.tanh(6 * s[0]) / 3, s[1])))
    assert "depends on the level" in found.problems[-1]


def test_no_level_means_nothing_to_lock(make_config: MakeConfig) -> None:
    found = check(make_config(), lambda samples: samples * 1e4)
    assert "turn the input gain down" in found.problems[-1]
    with pytest.raises(InterfaceError, match="no level was found"):
        lock_settings(make_config(), found)


def test_reverberation_is_no_loopback(make_config: MakeConfig) -> None:
    config = make_config()
    played = short_sweep(config, -12.0)
    rng = np.random.default_rng(0)
    response = rng.standard_normal(4000) * np.exp(-np.arange(4000) / 800)
    room = np.convolve(played, response)[: len(played)]
    assert find_loopback(np.stack((room, 0.1 * np.roll(played, 99))), played) == 1
    assert find_loopback(room[None], played) is None
    assert find_loopback(np.zeros((2, len(played))), played) is None
