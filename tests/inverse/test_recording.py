"""Air of recording blocks, places of rows and a listener nobody described."""

from dataclasses import replace

import numpy as np
import pytest

from fields.frame import SceneFrame
from fields.models.path import Config, PathField
from inverse.find import room_in_rows
from inverse.paths.air import (
    A_KELVIN,
    at_one_temperature,
    read_block_air,
    speed_at,
    stretched,
)
from inverse.paths.places import correct_places
from inverse.paths.recording import find_listener, fit_air
from inverse.paths.resumed import resumed
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.unexplained import unexplained_energy
from inverse.search import PriorKnowledge, SearchSettings
from rir import Dataset, GainPattern, Poses
from rir.errors import SignalError
from rir.physics import speed_of_sound
from rir.recording_blocks import recording_blocks

RATE = 16000
KELVIN = np.array([-0.25, -0.1, 0.05, 0.3])


def test_sessions_and_runs_of_takes_are_blocks():
    rows = np.arange(40)
    columns = {
        "take_no": rows,
        "time_utc": np.array([f"2026-01-01T10:{59 - row:02d}:00Z" for row in rows]),
        "temperature_c": np.full(40, 21.0),
    }
    one = Dataset.from_arrays(
        np.zeros((40, 1, 8)),
        np.ones((40, 3)),
        np.zeros((1, 3)),
        sample_rate=8000,
        columns=columns,
    )
    found = recording_blocks(one)
    np.testing.assert_array_equal(found.blocks, np.repeat([1, 0], 20))
    np.testing.assert_array_equal(found.temperatures, 21.0)
    np.testing.assert_array_equal(found.rows(rows[:3]).blocks, [1, 1, 1])


def test_stretching_moves_arrivals_about_the_latency():
    at, n = np.array([100.3, 401.7]), 600
    lag = np.arange(n) - 20
    sound = np.asarray(np.sinc(0.8 * (lag - at[:, None])), dtype=np.float64)
    later = np.sinc(0.8 * (lag - 1.002 * at[:, None]))
    moved = stretched(sound, 1.002, 20.0)
    np.testing.assert_allclose(moved[:, 50:550], later[:, 50:550], atol=3e-3)


def test_logged_temperatures_bring_rows_to_their_mean(box_set):
    warm = np.where(np.arange(len(box_set)) < 60, 19.0, 21.0)
    told = at_one_temperature(replace(box_set, temperatures=warm))
    np.testing.assert_allclose(told.speed_of_sound, speed_of_sound(20.0))
    # cold air is slower: what it brought late comes earlier in mean air
    cold = stretched(box_set.responses[:1], speed_of_sound(19) / speed_of_sound(20))
    np.testing.assert_allclose(told.responses[0], cold[0], atol=1e-7)
    same = replace(box_set, temperatures=np.full(len(box_set), 20.0))
    assert at_one_temperature(same) is same


def test_air_outside_rooms_is_refused():
    with pytest.raises(SignalError, match="120"):
        speed_at(120.0)


@pytest.fixture(scope="module")
def drifting(make_box_rows):
    """A box whose air changes from block to block of every emitter's rows."""
    inside, parts = make_box_rows.__globals__, []
    for kelvin in KELVIN:
        speed = inside["SPEED"]
        inside["SPEED"] = speed_of_sound(20.0 + kelvin)
        parts.append(make_box_rows())
        inside["SPEED"] = speed
    blocks = np.arange(len(parts[0])) % 4
    responses = np.array([parts[b].responses[r] for r, b in enumerate(blocks)])
    return replace(parts[0], responses=responses, blocks=blocks)


def test_drift_of_half_a_kelvin_is_recovered(drifting):
    heard = room_in_rows(drifting, SearchSettings(late=False))
    speeds = np.array([one["speed_of_sound"] for one in heard.report()["blocks"]])
    wanted = np.array([speed_of_sound(20.0 + kelvin) for kelvin in KELVIN])
    np.testing.assert_allclose(speeds, wanted, atol=0.05 * A_KELVIN * 343)
    assert heard.unexplained < 5e-3


def test_one_air_is_left_alone(box_set):
    mixed = replace(box_set, blocks=np.arange(len(box_set)) % 3)
    fitted = found_room(box_set)
    settled = fit_air(mixed, fitted)
    assert settled.fitted is fitted
    assert settled.air is None
    told = fitted.predict(mixed.emitters, mixed.listeners, mixed.n_samples)
    found = read_block_air(mixed, told, fitted.room.latency_s)
    np.testing.assert_allclose(found.changes, 0, atol=0.01 * A_KELVIN)


def test_places_are_corrected_within_their_sigma(box_set, unseen_set):
    rng = np.random.default_rng(5)
    moves = 0.003 * rng.standard_normal((len(box_set), 6))
    wrong = replace(
        box_set,
        emitters=_by(box_set.emitters, moves[:, :3]),
        listeners=_by(box_set.listeners, moves[:, 3:]),
    )
    fitted = resumed(wrong, found_room(box_set), count=60)
    corrected = correct_places(wrong, fitted, 0.003)
    told = corrected.report()
    np.testing.assert_allclose(told["rms_m"], 0.003, rtol=0.25)
    assert corrected.after < 0.1 * corrected.before
    before, after = (
        unexplained_energy(unseen_set, one) for one in (fitted, corrected.fitted)
    )
    assert after < 0.5 * before
    assert correct_places(wrong, fitted, 0.0).fitted is fitted


def found_room(rows):
    fitted = room_in_rows(rows, SearchSettings(late=False)).fitted
    if fitted is None:
        pytest.fail("no room was found in a clean box")
    return fitted


def listened(pattern, seed):
    """Return a box heard through a pattern that is turned at random."""
    from rooms import Scene, simulate

    rng = np.random.default_rng(seed)
    size = np.array([5.0, 4.0, 2.8])
    scene = Scene.shoebox(
        size,
        absorption=np.tile([[0.2], [0.3], [0.25], [0.35], [0.5], [0.3]], (1, 7)),
        emitter_gain=GainPattern.cardioid(),
        listener_gain=pattern,
    )
    places, parts = rng.uniform(0.6, size - 0.6, (4, 3)), []
    turns = rng.standard_normal((160, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    ends = Poses(rng.uniform(0.4, size - 0.4, (160, 3)), turns)
    for k, place in enumerate(places):
        mine = slice(40 * k, 40 * k + 40)
        made = simulate(
            scene,
            Poses(place[None], turns[k : k + 1]),
            ends[mine],
            sample_rate=RATE,
            duration=0.05,
            effects=["patterns", "direct", "specular"],
        )
        parts.append(made.responses[0])
    first = Poses(places.repeat(40, axis=0), turns[:4].repeat(40, axis=0))
    return FitSet(
        np.concatenate(parts),
        first,
        ends,
        RATE,
        speed_of_sound(20.0),
        place_numbers(first.positions),
        np.zeros(160, dtype=np.int64),
    )


def test_a_cardioid_microphone_is_found_and_an_omni_is_not():
    rows = listened(GainPattern.cardioid(), 3)
    heard = room_in_rows(rows, SearchSettings(late=False))
    wanted = np.zeros(9)
    cardioid = GainPattern.cardioid().coefficients[0]
    wanted[: len(cardioid)] = cardioid / cardioid[0] * np.sqrt(4 * np.pi)
    found = heard.report()["listener_pattern"]
    np.testing.assert_allclose(found, wanted, atol=0.05)
    assert heard.unexplained < 0.01
    rows = listened(GainPattern.omni(), 4)
    plain = room_in_rows(
        rows, SearchSettings(late=False), PriorKnowledge(listening=GainPattern.omni())
    )
    blind = room_in_rows(rows, SearchSettings(late=False))
    assert "listener_pattern" not in blind.report()
    told = (one.report()["reflection"] for one in (blind, plain))
    np.testing.assert_array_equal(*told)


def test_a_listener_that_never_turned_is_left_alone(box_set):
    from inverse.paths.recording import RecordedRoom

    fitted = found_room(box_set)
    settled = RecordedRoom(fitted)
    assert find_listener(box_set, settled) is settled


def test_answers_for_warmer_air_come_earlier(box_set, unseen_set, make_box_rows):
    found = room_in_rows(box_set, SearchSettings(late=False))
    heard = replace(found, recording={"temperature_c": 20.0})
    ends = np.concatenate([box_set.emitters.positions, box_set.listeners.positions])
    frame = SceneFrame(
        low=ends.min(axis=0),
        high=ends.max(axis=0),
        sample_rate=RATE,
        n_samples=box_set.n_samples,
        speed_of_sound=speed_of_sound(20.0),
        scale=1.0,
        surface_points=np.empty((0, 6)),
        simulated=True,
    )
    field, inside = PathField(heard, frame, Config()), make_box_rows.__globals__
    cold = inside["SPEED"]
    inside["SPEED"] = speed_of_sound(24.0)
    warm = make_box_rows(emitters=2, listeners=10, seed=9)
    inside["SPEED"] = cold
    asked = unseen_set.emitters, unseen_set.listeners
    told = field.predict_exactly(*asked, temperature_c=24.0)
    share = ((told - warm.responses) ** 2).sum() / (warm.responses**2).sum()
    assert share < 0.005
    same = field.predict_exactly(*asked, temperature_c=20.0)
    np.testing.assert_allclose(same, field.predict_exactly(*asked), atol=1e-9)
    assert PathField(heard, frame, Config()).report["sd"]["walls_m"] < 1e-3


def _by(poses, moves):
    return Poses(poses.positions + moves, poses.orientations)
