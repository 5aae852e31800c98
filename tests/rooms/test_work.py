"""A plan works no finer than its tolerance asks for."""

from typing import Any

import numpy as np
import pytest

from rir import GainPattern
from rooms import Scene, plan_effects, simulate
from rooms.effects import Tolerance
from rooms.effort import spread_errors
from rooms.energy_flow import energy_flow
from rooms.kernels.patterns import cell_directions, looked_up
from rooms.sound import Work

RUN = {"sample_rate": 4000, "duration": 0.4}
ENDS = [1.2, 3.1, 1.4], [[4.1, 1.3, 1.7], [2.5, 2.2, 1.1]]


def box(**options: Any) -> Scene:
    return Scene.shoebox((6, 5, 3), absorption=0.25, scattering=0.3, **options)


def test_effects_by_name_are_computed_as_finely_as_can_be():
    assert plan_effects(box(), only=["direct", "specular"], **RUN).work == Work()
    assert plan_effects(box(), everything=True, **RUN).work == Work()


def test_a_tolerance_buys_work():
    strict, loose = (
        plan_effects(box(), tolerance=Tolerance.of({"clarity_db": db}), **RUN).work
        for db in (0.01, 1.0)
    )
    assert strict.moments == 8
    assert loose.moments == 4
    assert loose.images_until < strict.images_until


@pytest.mark.parametrize("scattering", [0.0, 0.3])
def test_waves_take_over_the_energy_of_images(scattering: float):
    scene = Scene.shoebox((6, 5, 3), absorption=0.25, scattering=scattering)
    plan = plan_effects(scene, tolerance=Tolerance.of({"clarity_db": 4.0}), **RUN)
    whole = plan_effects(scene, only=plan.on, **RUN)
    assert plan.work.images_until < 0.2
    few, all_of = (
        np.abs(np.fft.rfft(simulate(scene, *ENDS, plan=p, **RUN).responses)) ** 2
        for p in (plan, whole)
    )
    # far below, images of one sign add up to a pressure that no wave has
    high = np.fft.rfftfreq(1600, 1 / 4000) > 350
    change = few[..., high].sum(axis=-1) / all_of[..., high].sum(axis=-1)
    assert np.abs(10 * np.log10(change)).max() < 0.5


def test_the_middle_of_a_cell_finds_its_cell():
    ways = cell_directions(8)
    rows = [looked_up(np.eye(3), 8, *way) for way in ways]
    assert rows == list(range(len(ways)))


def test_gains_from_a_table_are_reciprocal():
    scene = box(
        emitter_gain=GainPattern.cardioid(), listener_gain=GainPattern.first_order(0.3)
    )
    back = box(emitter_gain=scene.listener_gain, listener_gain=scene.emitter_gain)
    plan = plan_effects(scene, **RUN)
    assert plan.work.directions > 0
    one, other = ENDS[0], ENDS[1][0]
    there = simulate(scene, one, other, plan=plan, **RUN).responses
    assert np.array_equal(there, simulate(back, other, one, plan=plan, **RUN).responses)


def test_walls_that_return_nothing_can_be_predicted():
    scene = Scene.shoebox((4.2, 3.1, 2.5), absorption=1.0, scattering=0.5)
    assert "specular" not in plan_effects(scene, **RUN).on
    rough = Scene.shoebox((4.2, 3.1, 2.5), absorption=0.5, scattering=0.9)
    assert "specular" in plan_effects(rough, **RUN).on


@pytest.mark.parametrize("last", [0.06, 0.1143, 0.125, 0.13])
def test_scattered_energy_is_told_at_any_time(last: float):
    # transport knows powers of two, and its own end rounds what comes just before
    some, more = (
        energy_flow(box(), np.array([last, *later]), scattering=box().scattering)
        for later in ([], [0.4])
    )
    np.testing.assert_allclose(some.scattered[0], more.scattered[0], rtol=0.01)


def test_draws_without_late_sound_are_clear_not_unknown():
    energy = np.zeros((1, 1, 200))
    energy[..., 5] = 1.0
    error = np.zeros_like(energy)
    error[..., 100] = 1e-3  # half of the draws have late sound, half none
    errors = spread_errors(energy, error, np.zeros_like(energy), 1e-3)
    assert 0.1 < errors["clarity_db"] < 30.0
    assert spread_errors(energy, 0 * error, 0 * error, 1e-3)["clarity_db"] == 0.0
