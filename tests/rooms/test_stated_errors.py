"""The stated error is the whole error: every cause that is known counts."""

import json
from pathlib import Path

import numpy as np
import pytest

from rir import Dataset
from rooms import Scene, plan_effects, simulate
from rooms.display import error_lines
from rooms.effort import decay_parameters
from rooms.predict import differences, predict_parameters
from rooms.stated_errors import ERROR_KINDS, together
from rooms.wave_chance import independent_pairs, waves_errors
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


def test_the_chance_of_waves_is_what_seeds_differ_by():
    """Level, C50 and T of octaves at places of a box, over seeds of its waves."""
    scene, places = box(0.25, 0.5), [[4.1, 1.3, 1.7], [2.5, 4.2, 0.9], [5.1, 3.3, 2.2]]
    run = {"sample_rate": 4000, "duration": 0.4}
    effects = ["direct", "specular", "scattering", "late"]
    found, octaves = [], (250, 500, 1000)
    seeds = [
        simulate(scene, ENDS[0], places, effects=effects, seed=seed, **run)
        for seed in range(16)
    ]
    for made in seeds:
        heard = [octave_energies(made.responses[0], each) for each in octaves]
        found.append(decay_parameters(np.stack(heard, axis=1), 0.001, 0.01))
    found = np.array(found)
    spread = np.sqrt(np.mean(found.var(axis=0, ddof=1), axis=1))
    spread[2:] *= 100 / found[:, 2:].mean(axis=(0, 2))
    made = seeds[0]
    assert made.budget is not None
    stated = waves_errors(scene, made.plan, made.budget)[:, 1:4]
    # 48 places and seeds tell a spread to a tenth, and octaves are not sharp
    np.testing.assert_allclose(
        spread[:3].mean(axis=1), stated[:3].mean(axis=1), rtol=0.3
    )
    assert made.errors["clarity_db"] >= made.error_parts["waves"]["clarity_db"]
    assert made.mean_errors["clarity_db"] < made.errors["clarity_db"]


def octave_energies(responses, center):
    """Return energies of an octave per millisecond, at 4 kHz."""
    from scipy.signal import butter, sosfiltfilt

    edges = center / 2**0.5, center * 2**0.5
    band = butter(3, edges, "band", fs=4000, output="sos")
    return (sosfiltfilt(band, responses) ** 2).reshape(len(responses), -1, 4).sum(-1)


def test_near_places_stray_alike_and_far_ones_on_their_own():
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3), axis=-1).reshape(-1, 3)
    near, far = np.array([30.0]), np.array([0.2])
    assert independent_pairs(grid[:1], grid, far)[0] == pytest.approx(64, rel=0.1)
    assert independent_pairs(grid[:1], grid, near)[0] < 1.5
    one, other = (independent_pairs(grid[:n], grid, far)[0] for n in (1, 8))
    assert other == pytest.approx(8 * one, rel=0.1)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("emitters", [np.empty((0, 3)), [[2.0, 2, 1]]])
def test_no_pairs_and_short_responses_have_finite_errors(emitters):
    scene = Scene.shoebox((6, 5, 3), absorption=0.2, scattering=0.3)
    # shorter than the 50 ms that clarity counts as early
    made = simulate(scene, emitters, [[4, 4, 2]], sample_rate=8000, duration=0.04)
    assert np.isfinite(list(made.mean_errors.values())).all()
