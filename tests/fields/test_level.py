"""The energy a field lacks is given back once, and the same everywhere."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from fields.data import prepare
from fields.layers.level import Level
from rir import Dataset


@dataclass
class Recorded:
    """A network that answers what it is given."""

    answers: torch.Tensor
    place: int = 0

    def render(self, query: Any) -> torch.Tensor:
        rows = slice(self.place, self.place + len(query))
        self.place += len(query)
        return self.answers[rows]


def bench(n_samples=800):
    rng = np.random.default_rng(0)
    responses = rng.standard_normal((40, n_samples)) * np.exp(
        -np.arange(n_samples) / 200
    )
    emitters, listeners = rng.uniform(0, 4, (2, 40, 3))
    return prepare(
        Dataset.from_arrays(responses, emitters, listeners, sample_rate=16000)
    )


def test_recovers_a_gain_over_time():
    data = bench()
    lacking = torch.linspace(1.0, 0.5, 800)
    level = Level(800, 16000)
    level.fit(Recorded(torch.tensor(np.array(data.responses)) * lacking), data)
    found = level.gain[40:-40] * lacking[40:-40]
    np.testing.assert_allclose(found, 1.0, rtol=0.01)


def test_leaves_exact_and_silent_answers_alone():
    data = bench()
    level = Level(800, 16000)
    level.fit(Recorded(torch.tensor(np.array(data.responses))), data)
    np.testing.assert_allclose(level.gain, 1.0, rtol=1e-4)
    level.fit(Recorded(torch.zeros(40, 800)), data)
    assert float(level.gain.max()) <= 4.0


def test_what_comes_before_the_direct_sound_changes_nothing():
    data = bench()
    arrivals = (
        16000
        / data.frame.speed_of_sound
        * np.linalg.norm(data.emitters.positions - data.listeners.positions, axis=1)
    )
    early = np.arange(800) < arrivals[:, None] - 80
    truth = np.array(data.responses)
    truth[early] = 0.02
    data = replace(data, responses=truth)
    level = Level(800, 16000)
    level.fit(Recorded(torch.tensor(np.where(early, 0.0, truth))), data)
    np.testing.assert_allclose(level.gain, 1.0, rtol=0.01)
