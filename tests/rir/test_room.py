from pathlib import Path

import numpy as np
import pytest

from rir import ConfigError, OutOfReachError, RoomSpec
from rir.physics import air_absorption, speed_of_sound


def box(**changes: object) -> RoomSpec:
    room = {
        "name": "box",
        "size_m": (6, 5, 3),
        "surfaces": {"all": {"absorption": 0.2}},
    }
    return RoomSpec.model_validate(room | changes)


def test_the_speed_of_sound_goes_with_the_root_of_absolute_temperature() -> None:
    # an ideal gas: c² is proportional to t + 273.15, so c vanishes at absolute zero
    assert speed_of_sound(-273.15) == 0.0
    for t in (-20.0, 15.0, 35.0):
        ratio = speed_of_sound(t) / speed_of_sound(20.0)
        np.testing.assert_allclose(ratio, np.sqrt((t + 273.15) / 293.15), rtol=1e-14)
    # ISO 9613-1:1993, annex A; this form of its constants is 0.015 m/s off at most
    np.testing.assert_allclose(speed_of_sound(20.0), 343.2, atol=0.02)


def test_eyring_of_the_uniform_box() -> None:
    # S = 126 m², V = 90 m³: 24 ln 10 V / (c S ln(1/0.8)).
    expected = 24 * np.log(10) * 90 / (speed_of_sound(20.0) * 126 * np.log(1.25))
    np.testing.assert_allclose(box().eyring_t60(air=False), expected)


def test_air_shortens_the_reverberation_at_high_frequency() -> None:
    times = box().eyring_t60()
    assert np.all(np.diff(times) < 0)
    np.testing.assert_allclose(times[[3, 6]], [0.508, 0.393], atol=2e-3)


@pytest.mark.parametrize(
    ("humidity", "table"),
    [
        (50.0, [0.44, 1.31, 2.73, 4.66, 9.89, 29.7, 105.0]),
        (30.0, [0.61, 1.42, 2.51, 5.01, 14.1, 48.9, 168.0]),
    ],
)
def test_air_absorption_follows_the_standard(
    humidity: float, table: list[float]
) -> None:
    # ISO 9613-1:1993, table 1, at 20 °C and exact midband frequencies [dB/km].
    centers = 1000 * 10 ** (0.3 * np.arange(-3, 4))
    np.testing.assert_allclose(
        1000 * air_absorption(centers, 20.0, humidity), table, rtol=0.02
    )


def test_surfaces_fall_back_from_wall_to_sides_to_all() -> None:
    surfaces = {"all": {"absorption": 0.1}, "walls": {"absorption": 0.2}, "x1": "brick"}
    absorption = box(surfaces=surfaces).absorption[:, 0]
    np.testing.assert_allclose(absorption, [0.2, 0.03, 0.2, 0.2, 0.1, 0.1])


def test_every_mistake_is_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "room.yaml"
    path.write_text(
        "name: x\nsize_m: [4, 3]\nsurfaces: {all: brickk, floor: {absorption: 2}}\n"
        "air: {temperature: 21}\n"
    )
    with pytest.raises(ConfigError) as caught:
        RoomSpec.load(path)
    message = str(caught.value)
    assert "4 mistakes" in message
    assert "size_m.2: Field required" in message
    assert "no material 'brickk' (did you mean 'brick'?)" in message
    assert "surfaces.floor.absorption.0" in message
    assert "air.temperature: unknown key (did you mean 'temperature_c'?)" in message


def test_mistakes_in_seats_are_told_by_the_keys_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "room.yaml"
    floor = "floor: {absorption: 0.5, seats: %s}"
    for seats, told in (
        ("{row_m: 0}", "floor.seats.row_m: Input should be greater than 0 (got 0)"),
        ("{backs: 1}", "floor.seats.backs: unknown key"),
        ("5", "floor.seats: should hold keys and values, not an int"),
    ):
        stated = f"all: brick, {floor % seats}"
        path.write_text(f"name: x\nsize_m: [4, 3, 2]\nsurfaces: {{{stated}}}\n")
        with pytest.raises(ConfigError) as caught:
            RoomSpec.load(path)
        assert str(caught.value).splitlines()[1:] == [f"  surfaces.{told}"]


def test_a_missing_surface_is_named() -> None:
    with pytest.raises(ValueError, match="no surface is stated for floor, ceiling"):
        box(surfaces={"walls": "brick"})


def test_positions_are_checked_against_walls_and_furniture() -> None:
    room = box(furniture=[{"name": "table", "low": (1, 1, 0), "high": (2, 2, 0.8)}])
    room.check_inside((3, 3, 1.5), clearance=0.3)
    with pytest.raises(OutOfReachError, match=r"not 0.3 m inside box \(6 × 5 × 3 m\)"):
        room.check_inside((0.1, 3, 1.5), clearance=0.3)
    with pytest.raises(OutOfReachError, match="0.10 m from table; keep 0.3 m"):
        room.check_inside((1.5, 1.5, 0.9), clearance=0.3)


def test_a_room_survives_its_own_yaml(tmp_path: Path) -> None:
    from rir.config import dump_yaml

    room = box(surfaces={"all": "brick", "floor": {"absorption": 0.3}})
    path = tmp_path / "room.yaml"
    path.write_text(dump_yaml(room))
    assert RoomSpec.load(path) == room
