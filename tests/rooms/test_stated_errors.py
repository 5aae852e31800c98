"""The stated error is the whole error: every cause that is known counts."""

import json
from pathlib import Path

import numpy as np
import pytest

from rir import Dataset
from rooms import Scene, plan_effects, simulate
from rooms.display import error_lines
from rooms.predict import differences, predict_parameters
from rooms.stated_errors import ERROR_KINDS, together
from rooms.writing import write_simulation

RUN = {"sample_rate": 4000, "duration": 0.3}
ENDS = [1.2, 3.1, 1.4], [4.1, 1.3, 1.7]


def box(absorption: float = 0.3, scattering: float = 0.1) -> Scene:
    return Scene.shoebox((6, 5, 3), absorption=absorption, scattering=scattering)


def test_no_simulation_is_free_of_error():
    made = simulate(box(), *ENDS, **RUN)
    assert made.error_parts["sampling"] == dict.fromkeys(ERROR_KINDS, 0.0)
    assert made.errors["clarity_db"] > 0.1
    assert "wall data" in " ".join(error_lines(made))


def test_causes_add_as_independent_errors():
    made = simulate(box(), *ENDS, **RUN)
    for kind in ERROR_KINDS:
        squares = sum(part[kind] ** 2 for part in made.error_parts.values())
        assert made.errors[kind] == pytest.approx(squares**0.5)
    assert together([])["level_db"] == 0.0


def test_a_decay_cut_short_is_told():
    long, short = (
        simulate(box(0.1), *ENDS, sample_rate=4000, duration=duration)
        for duration in (1.2, 0.1)
    )
    assert long.error_parts["length"]["reverberation_percent"] < 1
    assert short.error_parts["length"]["reverberation_percent"] > 20


def test_sound_that_never_decays_is_cut_wherever_it_ends():
    made = simulate(box(0.0, 0.0), *ENDS, effects=["direct", "specular"], **RUN)
    assert made.error_parts["length"]["reverberation_percent"] == 100
    assert 20 < made.errors["level_db"] < np.inf


def test_silence_before_the_first_sound_is_told():
    made = simulate(box(), *ENDS, sample_rate=4000, duration=1 / 4000)
    assert error_lines(made)[0] == "no sound arrives within 0.00025 s at 1 of 1 pairs"
    assert "no sound" not in " ".join(error_lines(simulate(box(), *ENDS, **RUN)))


def test_what_is_left_off_counts_whoever_left_it_off():
    made = simulate(box(), *ENDS, effects=["direct", "specular"], **RUN)
    assert made.error_parts["left off"]["reverberation_percent"] > 1
    plan = plan_effects(box(), **RUN)
    assert simulate(box(), *ENDS, plan=plan, **RUN).error_parts["left off"]


def test_wall_data_count_as_a_prediction_with_other_data_does():
    scene, heard = box(0.3, 0.0), np.ones(7, dtype=bool)
    made = simulate(scene, *ENDS, sample_rate=32000, duration=0.6)
    bent = box(0.33, 0.0)
    change = differences(
        predict_parameters(scene, 0.6), predict_parameters(bent, 0.6), heard
    )
    stated = made.error_parts["wall data"]
    for kind in ERROR_KINDS:
        assert stated[kind] == pytest.approx(change[kind], rel=0.01)


def test_errors_are_stored_with_what_they_are_errors_of(tmp_path: Path):
    made = simulate(box(), *ENDS, **RUN)
    path = write_simulation(made, box(), *ENDS, tmp_path / "made.npz")
    story = json.loads(str(np.load(path)["plan"]))
    assert story["error_parts"]["wall data"] == made.error_parts["wall data"]
    path = write_simulation(made, box(), *ENDS, tmp_path / "made.h5")
    assert Dataset.open(path).sessions[0]["errors"] == pytest.approx(made.errors)
