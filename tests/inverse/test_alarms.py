"""Data sets that deceive: what is answered, and which alarm is raised."""

from dataclasses import replace

import numpy as np

from inverse.find import room_in_rows
from inverse.rows.fitset import place_numbers
from inverse.rows.proof import prove
from rir import Poses


def error_db(acoustics, rows):
    told = acoustics.predict(rows.emitters, rows.listeners, rows.n_samples)
    assert np.isfinite(told).all()
    left = ((told - rows.responses) ** 2).sum() / (rows.responses**2).sum()
    return 10 * np.log10(left)


def moved(rows, spread_m, seed=2):
    rng = np.random.default_rng(seed)
    first = rows.emitters.positions
    number = rows.places
    steps = spread_m * rng.standard_normal((number.max() + 1, 3))
    second = rows.listeners.positions + spread_m * rng.standard_normal(first.shape)
    return replace(
        rows,
        emitters=Poses(first + steps[number], rows.emitters.orientations),
        listeners=Poses(second, rows.listeners.orientations),
        places=place_numbers(first + steps[number]),
    )


def test_one_label_in_a_hundred_swapped_does_not_spoil_the_room(box_set, unseen_set):
    responses = np.array(box_set.responses)
    responses[[7, 80]] = responses[[80, 7]]
    acoustics = room_in_rows(replace(box_set, responses=responses))
    assert acoustics.report()["walls"] == 6
    assert error_db(acoustics, unseen_set) < -20
    assert any("2 of 120 responses do not fit" in one for one in acoustics.alarms)


def test_three_centimetres_off_the_walls_are_found_and_the_doubt_is_told(
    make_box_rows, unseen_set
):
    acoustics = room_in_rows(moved(make_box_rows(listeners=15), 0.03))
    report = acoustics.report()
    assert report["unexplained"] > 0.05
    ends = unseen_set.emitters, unseen_set.listeners, unseen_set.n_samples
    scores = prove(unseen_set, {"told": acoustics.predict(*ends)}).scores["told"]
    assert scores["STFT"] < 1.6
    planes = np.array(report.get("planes", np.empty((0, 4))))
    # what is called a wall is one, to the doubt of the places
    truth = [(axis, end) for axis in range(3) for end in (0.0, (5.0, 4.0, 2.8)[axis])]
    for plane in planes:
        axis = int(np.argmax(np.abs(plane[:3])))
        where = plane[3] / plane[axis]
        assert min(abs(where - end) for k, end in truth if k == axis) < 0.15
    assert acoustics.alarms


def test_noise_alone_holds_no_wall_and_is_said_to(box_set):
    rng = np.random.default_rng(3)
    acoustics = room_in_rows(
        replace(box_set, responses=rng.standard_normal(box_set.responses.shape))
    )
    assert acoustics.report()["walls"] == 0
    assert any("no direct sound" in one for one in acoustics.alarms)


def test_reverberation_without_early_sound_holds_no_wall(box_set):
    rng = np.random.default_rng(4)
    rows = box_set
    times = np.arange(rows.n_samples) / rows.sample_rate
    onset = rows.distances / rows.speed_of_sound
    noise = rng.standard_normal(rows.responses.shape) * np.exp(-20 * times)
    noise[times < onset[:, None]] = 0
    acoustics = room_in_rows(replace(rows, responses=noise))
    assert acoustics.report()["walls"] == 0
    told = acoustics.predict(rows.emitters, rows.listeners, rows.n_samples)
    level = 10 * np.log10((told**2).sum() / (noise**2).sum())
    assert abs(level) < 1.5
    assert acoustics.alarms


def test_coincident_ends_are_left_out_and_answered(box_set):
    second = np.array(box_set.listeners.positions)
    second[:5] = box_set.emitters.positions[:5]
    rows = replace(box_set, listeners=Poses(second, box_set.listeners.orientations))
    acoustics = room_in_rows(rows)
    told = acoustics.predict(rows.emitters[:5], rows.listeners[:5], rows.n_samples)
    assert np.isfinite(told).all()
    assert acoustics.report()["walls"] == 6


def test_the_same_place_for_all_rows_is_told_to_be_too_little(box_set):
    place = np.tile([2.0, 2.0, 1.2], (len(box_set), 1))
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(box_set), 1))
    rows = replace(
        box_set,
        emitters=Poses(place, still),
        listeners=Poses(place, still),
        places=place_numbers(place),
    )
    acoustics = room_in_rows(rows)
    assert acoustics.report()["walls"] == 0
    assert any("too few" in one for one in acoustics.alarms)
    told = acoustics.predict(rows.emitters[:2], rows.listeners[:2], rows.n_samples)
    assert np.isfinite(told).all()
