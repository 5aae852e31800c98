"""What a person may get wrong is told in one clear error."""

from typing import Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

from fields import FIELDS, load_field, train
from fields.data import prepare
from fields.evaluate import score
from fields.table import model_config
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
        (ConfigError, "'60s'; it must be a positive number", {"budget_s": "60s"}),
        (ConfigError, "steps is 2.5; .* whole number", {"steps": 2.5}),
        (ConfigError, "seed is 1.5", {"seed": 1.5}),
        (ConfigError, "seed is None", {"seed": None}),
        (ConfigError, "out is 3", {"out": 3}),
        (ConfigError, "name and value pairs", {"config": [1]}),
        (ConfigError, "100 is above 24", {"config": {"octaves": 100}}),
        (SignalError, "'fast' is not a number", {"sample_rate": "fast"}),
        (SignalError, "1e\\+09 Hz", {"sample_rate": 1e9}),
        (SignalError, "inf s", {"duration": float("inf")}),
        (DatasetError, "or a mask", {"rows": np.ones(3, dtype=bool)}),
        (DatasetError, "or a mask", {"rows": np.array([0.5])}),
    ],
)
def test_mistakes_are_told(grid, error, message, asked):
    with pytest.raises(error, match=message):
        train(grid, "inras", **{"steps": 1, **asked})


CHOICES = [
    (model, name, get_args(kind))
    for model in FIELDS
    for name, kind in get_type_hints(FIELDS[model].load_module().Config).items()
    if get_origin(kind) is Literal
]
FREE_TEXT = {("av-nerf", "weights"), ("av-nerf", "photos"), ("path", "geometry")}


@pytest.mark.parametrize(("model", "name", "choices"), CHOICES)
def test_unknown_choices_are_told_with_the_known(model, name, choices):
    assert getattr(model_config(model, {}), name) in choices
    for choice in choices:
        assert getattr(model_config(model, {name: choice}), name) == choice
    with pytest.raises(ConfigError, match=f"{name}: no 'nope'; known: {choices[0]}"):
        model_config(model, {name: "nope"})


def test_every_setting_that_is_a_name_lists_its_choices():
    free = {
        (model, name)
        for model in FIELDS
        for name, kind in get_type_hints(FIELDS[model].load_module().Config).items()
        if kind is str
    }
    assert free <= FREE_TEXT


@pytest.mark.parametrize("thing", [np.zeros((2, 3, 8)), "x.h5", None, [1, 2]])
def test_only_a_data_set_is_learned_from(thing):
    with pytest.raises(DatasetError, match=r"not from .*from_arrays"):
        train(thing, "nearest")


def test_a_mask_names_rows(grid):
    mask = np.arange(len(grid)) % 2 == 0
    masked = train(grid, "nearest", rows=mask)
    named = train(grid, "nearest", rows=np.flatnonzero(mask))
    query = grid.emitters[:5], grid.listeners[:5]
    np.testing.assert_array_equal(masked.predict(*query), named.predict(*query))


@pytest.mark.parametrize(
    ("error", "message", "emitters", "listeners"),
    [
        (SignalError, "not str", "here", np.ones(3)),
        (SignalError, "not list", [[1, 2], [1, 2, 3]], np.ones(3)),
        (SignalError, "complex", np.ones(3) + 1j, np.ones(3)),
        (SignalError, "finite", np.array([np.nan, 0, 0]), np.ones(3)),
        (SignalError, r"\(N, 3\)", np.ones(2), np.ones(3)),
        (TrainingError, "2 emitters against 3", np.ones((2, 3)), np.ones((3, 3))),
        (TrainingError, "0 emitters against 1", np.ones((0, 3)), np.ones(3)),
        (TrainingError, "emitter at 1e\\+09 m", np.full(3, 1e9), np.ones(3)),
    ],
)
def test_odd_queries_are_told(grid, error, message, emitters, listeners):
    field = train(grid, "nearest")
    with pytest.raises(error, match=message):
        field.predict(emitters, listeners)


@pytest.mark.parametrize("model", ["nearest", "inras"])
def test_models_without_patterns_refuse_self_supervision(grid, model):
    with pytest.raises(TrainingError, match="self-supervision"):
        train(grid, model, self_supervised=True, steps=1)


@pytest.mark.parametrize("thing", [None, np.zeros(3)])
def test_fields_are_opened_from_paths(thing):
    with pytest.raises(TrainingError, match="from the path"):
        load_field(thing)


@pytest.mark.parametrize("name", ["x.pt", "x.npz", "x.txt"])
def test_a_file_that_is_no_field_is_told(tmp_path, name):
    (tmp_path / name).write_text("junk")
    with pytest.raises(TrainingError, match="is no stored field") as told:
        load_field(tmp_path / name)
    assert "\n" not in str(told.value)
    assert "weights_only" not in str(told.value)


def test_a_spoiled_field_is_told_and_not_traced(grid, tmp_path):
    path = train(grid, "nearest").save(tmp_path / "field.npz")
    with np.load(path) as stored:
        kept = {name: stored[name] for name in stored if name != "responses"}
    np.savez(path, **kept)
    with pytest.raises(TrainingError, match="cannot be opened as a field 'nearest'"):
        load_field(path)


@pytest.mark.parametrize("spoil", [lambda a: a * np.nan, lambda a: a[:, :7]])
def test_what_is_no_response_is_not_scored(grid, spoil, monkeypatch):
    field, data = train(grid, "nearest"), prepare(grid)
    answer = field.predict
    monkeypatch.setattr(field, "predict", lambda *ends: spoil(answer(*ends)))
    with pytest.raises(TrainingError, match="nearest answers an array of shape"):
        score(field, data)
