from pathlib import Path

import numpy as np
import pytest

from capture.devices.sensors import (
    AskedAir,
    FileSensor,
    NoSensor,
    SimulatedAir,
    parse_air,
)
from rir import Environment


class Air:
    def __init__(self) -> None:
        self.set: list[float] = []

    def set_air(self, temperature_c: float) -> None:
        self.set.append(temperature_c)


def test_simulated_air_belongs_to_the_take_and_the_world_hears_it() -> None:
    world = Air()
    sensor = SimulatedAir(world, Environment(20.0, 50.0, 101.0), sigma_c=0.1, seed=1)
    first, again = (sensor.read("P01_AB_1") for _ in range(2))
    assert first == again
    assert world.set == [first.temperature_c] * 2
    drawn = [sensor.read(f"P{n:02d}_AB_1").temperature_c for n in range(400)]
    np.testing.assert_allclose(np.std(drawn), 0.1, rtol=0.15)
    np.testing.assert_allclose(np.mean(drawn), 20.0, atol=0.02)


def test_a_file_is_read_afresh_for_each_take(tmp_path: Path) -> None:
    path = tmp_path / "air.txt"
    told: list[str] = []
    sensor = FileSensor(path, told.append)
    path.write_text("20.1 44\n20.2, 45, 100.9\n\n")
    assert sensor.read("a") == Environment(20.2, 45.0, 100.9)
    path.write_text("20.4\n")
    assert sensor.read("b").temperature_c == 20.4
    assert np.isnan(sensor.read("b").humidity_percent)
    assert told == []


@pytest.mark.parametrize("text", [None, "", "warm\n", "900\n"])
def test_what_cannot_be_read_is_no_number(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "air.txt"
    if text is not None:
        path.write_text(text)
    told: list[str] = []
    assert np.isnan(FileSensor(path, told.append).read("P01_AB_1").temperature_c)
    assert told[0].startswith("P01_AB_1 has no temperature")


def test_the_operator_is_asked_once_a_pair() -> None:
    answers = iter(["warm", "21.5 40", ""])
    sensor = AskedAir(lambda _: next(answers))
    assert sensor.read("P01_AB_1") == Environment(21.5, 40.0)
    assert sensor.read("P01_BA_1") == Environment(21.5, 40.0)
    assert np.isnan(sensor.read("P02_AB_1").temperature_c)


def test_nobody_measures_nothing() -> None:
    assert np.isnan(NoSensor().read("a").temperature_c)
    assert parse_air("20.5") != Environment()
