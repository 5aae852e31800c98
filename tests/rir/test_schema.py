"""Versions of stored files: older ones are brought up to date, others are refused."""

from typing import Any

import pytest

from rir.errors import DatasetError, TrainingError
from rir.schema import Schema


def with_kelvin(old: dict[str, Any]) -> dict[str, Any]:
    return {**old, "kelvin": [value + 273.15 for value in old["celsius"]]}


def without_celsius(old: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in old.items() if name != "celsius"}


LOG = Schema(
    "thermometer log", 3, {1: with_kelvin, 2: without_celsius}, format="thermo"
)


def test_each_older_version_is_brought_up_to_date_step_by_step() -> None:
    first = {"format": "thermo", "schema": 1, "celsius": [0.0, 20.0]}
    third = {"format": "thermo", "schema": 3, "kelvin": [273.15, 293.15]}
    second = {**third, "schema": 2, "celsius": [0.0, 20.0]}
    for written in (first, second, third):
        before = dict(written)
        assert LOG.open(written, "log") == third
        assert written == before, "the file's own content is left as it is"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"format": "thermo", "schema": 4}, "of version 4; this program reads up to 3"),
        ({"format": "resounding-report", "schema": 1}, "its format is 'resounding-rep"),
        ({"schema": 1}, "is no thermometer log: it says no format"),
        ({"format": "thermo"}, "is no thermometer log: it says no version"),
        ({"format": "thermo", "schema": "new"}, "it says no version"),
        ({"format": "thermo", "schema": 0}, "it says no version"),
        ({"format": "thermo", "schema": 1.5}, "it says no version"),
        ({"format": "thermo", "schema": float("inf")}, "it says no version"),
        ([1, 2], "a.log is no thermometer log"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(content: Any, words: str) -> None:
    with pytest.raises(DatasetError, match=r"^a\.log is ") as raised:
        LOG.open(content, "a.log")
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_kind_may_have_files_without_a_number_and_an_error_of_its_own() -> None:
    field = Schema("field", 1, unnumbered=1, error=TrainingError)
    assert field.open({"model": "path"}, "f.npz") == {"model": "path"}
    assert field.stamp == {"schema": 1}
    with pytest.raises(TrainingError, match="field of version 2"):
        field.open({"schema": 2}, "f.npz")


def test_a_version_that_nothing_migrates_is_a_mistake_of_the_program() -> None:
    with pytest.raises(ValueError, match="every version before the last migrates"):
        Schema("log", 3, {1: with_kelvin})
