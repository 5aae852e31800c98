"""Gain patterns in the wave equation, against closed forms."""

import numpy as np
import pytest

from rir import GainPattern, Pose
from rooms import Scene, simulate
from rooms.multipoles import Moments, transfer
from rooms.wave_grid import WaveGrid

SIZE = np.array([2.0, 1.6, 1.3])
HERE, THERE = np.array([0.43, 0.52, 0.37]), np.array([1.48, 1.11, 0.83])
STILL = np.array([[0.0, 0, 0, 1]])


def mode_shapes(numbers, place):
    """Return the shapes of all modes of a rigid box and their gradients."""
    k = np.pi * numbers / SIZE
    waves, slopes = np.cos(k * place), -k * np.sin(k * place)
    shape = waves.prod(axis=1)
    gradient = [
        slopes[:, a] * waves[:, (a + 1) % 3] * waves[:, (a + 2) % 3] for a in range(3)
    ]
    return shape, np.stack(gradient, axis=1)


def modal_response(times, c, emitting, listening):
    """Return the sum over modes of a rigid box; 1/d in the free field.

    h(t) = 4 pi c² / V sum_n p_n(s) p_n(r) / L_n sin(w_n t) / w_n, where devices are
    weights of the pressure and of its gradient.
    """
    counts = np.ceil(1500 * 2 * SIZE / c).astype(int)
    grid = np.meshgrid(*(np.arange(n) for n in counts), indexing="ij")
    numbers = np.stack(grid, axis=-1).reshape(-1, 3)[1:]
    w = c * np.linalg.norm(np.pi * numbers / SIZE, axis=1)
    weight = np.prod(np.where(numbers > 0, 2.0, 1.0), axis=1)
    ends = [
        (shape * device[0] + gradient @ np.array(device[1:]))
        for device, (shape, gradient) in (
            (emitting, mode_shapes(numbers, HERE)),
            (listening, mode_shapes(numbers, THERE)),
        )
    ]
    strength = 4 * np.pi * c**2 / SIZE.prod() * weight * ends[0] * ends[1] / w
    mean = 4 * np.pi * c**2 / SIZE.prod() * emitting[0] * listening[0] * times
    return np.sin(np.outer(times, w)) @ strength + mean


@pytest.mark.parametrize(
    ("emitting", "listening"),
    [
        ((1, 0, 0, 0), (1, 0, 0, 0)),
        ((0, 1, 0, 0), (1, 0, 0, 0)),
        ((0, 0, 0.6, 0.8), (0.5, 0.1, -0.2, 0.3)),
    ],
    ids=["two monopoles", "a dipole", "dipole to a mixture"],
)
def test_devices_in_a_rigid_box_are_the_gradients_of_the_modal_sum(
    emitting, listening, faded_spectrum
):
    scene = Scene.shoebox(SIZE, absorption=0.0)
    grid, c = WaveGrid(scene, 700.0), scene.speed_of_sound

    def cells(device, place):
        parts = [grid.pressure(place[None])]
        parts += [grid.slope(place[None], axis) for axis in range(3)]
        where = np.concatenate([part[0][0] for part in parts])
        weights = [w * part[1][0] for w, part in zip(device, parts, strict=True)]
        return where, np.concatenate(weights)

    source, (ears, weights) = cells(emitting, HERE), cells(listening, THERE)
    low = grid.march(*source, ears[None], weights[None], 0.15)[0]
    times = np.arange(0, 0.15, 1 / 6000)
    exact = modal_response(times, c, emitting, listening) / 6000
    f = np.arange(40.0, 240.0, 1.0)
    made = faded_spectrum(low, grid.sample_rate, f)
    wanted = faded_spectrum(exact, 6000, f)
    assert np.linalg.norm(made - wanted) < 0.05 * np.linalg.norm(wanted)


@pytest.mark.parametrize("angle_deg", [0, 60, 90, 180])
def test_a_cardioid_in_the_free_field_is_a_monopole_and_a_dipole(angle_deg):
    scene = Scene.shoebox((14, 14, 14), absorption=0.5)
    grid, k = WaveGrid(scene, 100.0), 2 * np.pi / scene.speed_of_sound
    f, angle = np.arange(40.0, 66.0), np.radians(angle_deg)
    middle = np.full(3, 7.03)
    ear = middle + 2 * np.array([np.cos(angle), np.sin(angle), 0])
    moments = (
        Moments.of(GainPattern.cardioid(), STILL, f),
        Moments.of(GainPattern.omni(), STILL, f),
    )
    made = transfer(grid, (middle, ear[None]), moments, f, 0.03)[0]
    near = 1 + 1 / (1j * k * f * 2)
    wanted = (0.5 + 0.5 * np.cos(angle) * near) * np.exp(-1j * k * f * 2) / 2
    np.testing.assert_allclose(made, wanted, atol=0.04 * np.abs(wanted).max() + 0.01)


def lot(**changes):
    outline = [(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)]
    return Scene.extruded(outline, 2.5, {"all": {"absorption": 0.2}}, **changes)


LOW = {"sample_rate": 2000, "duration": 0.2, "effects": ["patterns", "modes"]}


def test_exchanging_the_ends_with_their_patterns_changes_nothing():
    bands = 125.0 * 2.0 ** np.arange(7, dtype=np.float64)
    rng = np.random.default_rng(4)
    odd = GainPattern(rng.normal(size=(7, 9)), bands)
    ends = Pose.at(1, 0.8, 1.1, yaw_deg=40), Pose.at(3.2, 0.7, 1.6, pitch_deg=-70)
    there = lot(emitter_gain=odd, listener_gain=GainPattern.cardioid())
    back = lot(emitter_gain=GainPattern.cardioid(), listener_gain=odd)
    one = simulate(there, *ends, **LOW).responses
    other = simulate(back, *reversed(ends), **LOW).responses
    assert np.linalg.norm(one - other) < 1e-8 * np.linalg.norm(one)


def test_a_device_without_gain_is_silent_at_low_frequencies_too():
    none = GainPattern(np.zeros((1, 4)), np.array([1000.0]))
    scene = lot(emitter_gain=none)
    made = simulate(scene, [1, 0.8, 1.1], [[3.2, 0.7, 1.6]], **LOW).responses
    np.testing.assert_array_equal(made, 0.0)


def test_turning_a_dipole_away_from_a_mode_silences_it():
    # between hard walls 3 m apart, the first mode along y moves air along y only
    scene = Scene.extruded([(0, 0), (2, 0), (2, 3), (0, 3)], 1.9, 0.01)
    grid, f = WaveGrid(scene, 120.0), np.array([57.2])
    place, ear = np.array([1.0, 1.5, 0.95]), np.array([[1.0, 0.1, 0.95]])
    omni, dipole = GainPattern.omni(), GainPattern.first_order(0.0)
    heard = {}
    for yaw in (0, 90):
        turn = Pose.at(0, 0, 0, yaw_deg=yaw).orientation[None]
        ends = Moments.of(dipole, turn, f), Moments.of(omni, STILL, f)
        heard[yaw] = abs(transfer(grid, (place, ear), ends, f, 0.4)[0, 0])
    assert heard[0] < 0.03 * heard[90]
