"""What a person may get wrong is told in one clear error."""

import numpy as np
import pytest

from fields import load_field, train
from rir.errors import ConfigError, DatasetError, SignalError, TrainingError


@pytest.mark.parametrize(
    ("error", "message", "asked"),
    [
        (ConfigError, "budget_s is 0", {"budget_s": 0.0}),
        (ConfigError, "budget_s is nan", {"budget_s": float("nan")}),
        (ConfigError, "steps is -1", {"steps": -1}),
        (ConfigError, "seed is -5", {"seed": -5}),
        (ConfigError, "'x' is not int", {"config": {"width": "x"}}),
        (ConfigError, "True is not int", {"config": {"width": True}}),
        (ConfigError, "0 is below 1", {"config": {"width": 0}}),
        (ConfigError, "-1 is below 0", {"config": {"octaves": -1}}),
        (SignalError, "sample rate -3", {"sample_rate": -3}),
        (SignalError, "duration -1", {"duration": -1.0}),
        (DatasetError, "0 to 47", {"rows": np.array([0, 99])}),
        (DatasetError, "0 responses", {"rows": np.array([], dtype=int)}),
        (TrainingError, "no device", {"device": "tpu"}),
    ],
)
def test_mistakes_are_told(grid, error, message, asked):
    with pytest.raises(error, match=message):
        train(grid, "inras", **{"steps": 1, **asked})


@pytest.mark.parametrize("model", ["nearest", "inras"])
def test_models_without_patterns_refuse_self_supervision(grid, model):
    with pytest.raises(TrainingError, match="self-supervision"):
        train(grid, model, self_supervised=True, steps=1)


@pytest.mark.parametrize("name", ["x.pt", "x.npz", "x.txt"])
def test_a_file_that_is_no_field_is_told(tmp_path, name):
    (tmp_path / name).write_text("junk")
    with pytest.raises(TrainingError, match="is no stored field"):
        load_field(tmp_path / name)
