"""Every effect of the table, and the physics of those that stand alone."""

from pathlib import Path

import numpy as np
import pytest

import rooms.effects
from rir import GainPattern, Pose, Poses
from rir.errors import SceneError, SignalError
from rooms import Scene, simulate
from rooms.conformance import check_effect
from rooms.effects import EFFECTS
from rooms.hardware import DeviceResponse, Hardware
from rooms.motion import render_moving
from rooms.wave_grid import WaveGrid

SIZE = np.array([4.0, 3.0, 2.5])
OUTLINE = [(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)]
A, B = Pose.at(0.7, 2.3, 1.1, 30), Pose.at(3.1, 0.9, 1.5, 160)
SURFACES = {"absorption": 0.3, "scattering": 0.2}


def box(**changes):
    return Scene.shoebox(SIZE, absorption=0.3, scattering=0.2, **changes)


def lot(**changes):
    return Scene.extruded(OUTLINE, 2.5, {"all": SURFACES}, **changes)


def test_every_file_is_in_the_table():
    folder = Path(rooms.effects.__file__).parent
    helpers = {"__init__", "effect", "handover", "traced", "bent"}
    files = {path.stem for path in folder.glob("*.py")} - helpers
    assert files == set(EFFECTS)


@pytest.mark.parametrize("name", list(EFFECTS))
def test_every_effect_conforms(name):
    check_effect(name, rays=400 if name in ("late", "scattering") else None)


def test_all_effects_together_are_reciprocal_in_any_room():
    emit, hear = GainPattern.cardioid(), GainPattern.first_order(0.2)
    effects = [name for name in EFFECTS if name != "hardware"]
    run = {"sample_rate": 8000, "duration": 0.12, "effects": effects, "rays": 500}
    there = simulate(lot(emitter_gain=emit, listener_gain=hear), A, B, **run)
    back = simulate(lot(emitter_gain=hear, listener_gain=emit), B, A, **run)
    error = np.linalg.norm(there.responses - back.responses)
    assert error < 10 ** (-120 / 20) * np.linalg.norm(there.responses)


def test_a_mesh_box_is_a_shoebox():
    from rooms.mesh import MeshGeometry

    mesh = Scene.of_geometry(MeshGeometry.box(SIZE), 0.3)
    run = {"sample_rate": 8000, "duration": 0.1, "effects": ["direct", "specular"]}
    one = simulate(mesh, A, B, max_order=4, **run).responses
    two = simulate(Scene.shoebox(SIZE, absorption=0.3), A, B, max_order=4, **run)
    np.testing.assert_allclose(one, two.responses, atol=1e-7)


def test_traced_tail_of_a_box_agrees_with_its_closed_form():
    scene = Scene.shoebox(SIZE, absorption=0.25, scattering=0.5)
    run = {"sample_rate": 8000, "duration": 0.3, "max_order": 3}
    names = ["direct", "specular", "scattering", "late"]
    closed = simulate(scene, A, B, effects=names, **run).responses[0, 0]
    traced = simulate(scene, A, B, effects=names, rays=20000, **run).responses[0, 0]
    for start in (200, 600, 1000, 1400):
        part = slice(start, start + 400)
        level = np.sum(traced[part] ** 2) / np.sum(closed[part] ** 2)
        assert abs(10 * np.log10(level)) < 1.5


@pytest.mark.parametrize("order", [0, 1, 3, 5])
def test_no_order_is_counted_twice_where_images_hand_over_to_rays(order):
    scene = Scene.shoebox(SIZE, absorption=0.2, scattering=0.3)
    names = ["direct", "specular", "scattering", "late"]
    run = {"sample_rate": 16000, "duration": 0.25, "effects": names, "seed": 3}
    energy = []
    for seed in range(4):
        run["seed"] = seed
        made = simulate(scene, A, B, max_order=order, rays=20000, **run).responses
        spectrum = np.abs(np.fft.rfft(made[0, 0])) ** 2
        energy.append(spectrum[500:].mean())
    # the closed form at a high order lists nearly all images one by one
    run["seed"] = 0
    whole = simulate(scene, A, B, max_order=40, **run).responses[0, 0]
    expected = (np.abs(np.fft.rfft(whole)) ** 2)[500:].mean()
    assert abs(10 * np.log10(np.mean(energy) / expected)) < 0.4


def test_grid_and_images_agree_below_the_crossover(faded_spectrum):
    scene = Scene.shoebox(SIZE, absorption=0.0)
    grid = WaveGrid(scene, 400.0)
    low = grid.responses(A.position, B.position[None], 0.25)[0]
    high = simulate(
        scene, A, B, sample_rate=4000, duration=0.25, effects=["direct", "specular"]
    ).responses[0, 0]
    f = np.arange(30, 160, 1.0)
    one = faded_spectrum(low, grid.sample_rate, f)
    two = faded_spectrum(high, 4000, f)
    assert np.linalg.norm(one - two) < 0.1 * np.linalg.norm(two)


def test_the_grid_is_symmetric_and_refuses_too_much():
    grid = WaveGrid(lot(), 250.0)
    there = grid.responses(A.position, B.position[None], 0.05)
    back = grid.responses(B.position, A.position[None], 0.05)
    np.testing.assert_allclose(there, back, atol=1e-12 * np.abs(there).max())
    with pytest.raises(SceneError, match="lower the crossover"):
        WaveGrid(Scene.shoebox((50, 40, 20)), 1000.0)


def test_a_partition_lets_its_share_through():
    from rooms.mesh import MeshGeometry

    room = MeshGeometry.box(SIZE)
    sheet = np.array([[2, 0, 0], [2, 3, 0], [2, 3, 2.5], [2, 0, 2.5]], float)
    count = len(room.vertices)
    faces = [[0, 1, 2], [0, 2, 3]]
    geometry = MeshGeometry.from_arrays(
        np.concatenate([room.vertices + room.origin, sheet]),
        np.concatenate([room.faces, np.array(faces) + count]),
        ["wall"] * len(room.faces) + ["sheet"] * 2,
    )
    materials = {"wall": 1.0, "sheet": {"absorption": 1.0, "transmission": 0.01}}
    scene = Scene.of_geometry(geometry, materials)
    ends = Pose.at(1, 1.1, 1.2), Pose.at(3, 1.4, 1.3)
    run = {"sample_rate": 8000, "duration": 0.03}
    result = simulate(scene, *ends, effects=["direct", "transmission"], **run)
    distance = ends[0].distance(ends[1])
    total = abs(np.fft.rfft(result.responses[0, 0])[20])
    np.testing.assert_allclose(total, 0.1 / distance, rtol=0.02)


def test_devices_filter_with_minimum_phase():
    f = [100.0, 1000.0, 4000.0]
    device = DeviceResponse(np.array(f), np.array([0.0, -6.0, -12.0]))
    pulse = np.zeros(2048)
    pulse[100] = 1.0
    heard = device.filtered(pulse, 16000)
    spectrum = np.abs(np.fft.rfft(heard, 16000))
    np.testing.assert_allclose(
        20 * np.log10(spectrum[[1000, 4000]]), [-6, -12], atol=0.1
    )
    assert np.abs(heard[:95]).max() < 1e-3 * np.abs(heard).max()


def test_a_fast_clock_stretches_and_noise_has_its_level():
    rate, n = 16000, 16000
    tone = np.sin(2 * np.pi * 1000 * np.arange(n) / rate)
    rng = np.random.default_rng(0)
    late = Hardware(drift_ppm=100.0).heard(tone, rate, rng)
    expected = np.sin(2 * np.pi * 1000 / (1 + 1e-4) * np.arange(n) / rate)
    np.testing.assert_allclose(late[100:-100], expected[100:-100], atol=1e-4)
    noisy = Hardware(noise_db=-60.0).heard(np.zeros(n), rate, rng)
    np.testing.assert_allclose(20 * np.log10(noisy.std()), -60, atol=0.2)


def test_a_stated_chain_switches_hardware_on():
    chain = Hardware(DeviceResponse(np.array([1000.0]), np.array([-6.0])))
    plain = simulate(box(), A, B, sample_rate=8000, duration=0.05)
    through = simulate(box(hardware=chain), A, B, sample_rate=8000, duration=0.05)
    assert "hardware" in through.plan.on
    factor = 10 ** (-6 / 20)
    np.testing.assert_allclose(through.responses, factor * plain.responses, atol=1e-9)


def test_a_moving_emitter_is_heard_with_its_doppler_shift():
    rate, speed, tone = 8000, 10.0, 500.0
    scene = Scene.shoebox((60, 30, 30), absorption=1.0)
    moments = np.linspace(0, 1, 201)
    path = np.column_stack(
        [10 + speed * moments, np.full(201, 15.0), np.full(201, 15.0)]
    )
    signal = np.sin(2 * np.pi * tone * np.arange(rate) / rate)
    heard = render_moving(
        scene, Poses(path), moments, [40, 15, 15], signal,
        sample_rate=rate, duration=0.12, effects=["direct"],
    )[0]  # fmt: skip
    part = heard[2000:6000] * np.hanning(4000)
    spectrum = np.abs(np.fft.rfft(part, 65536))
    peak = np.argmax(spectrum) * rate / 65536
    expected = tone / (1 - speed / scene.speed_of_sound)
    np.testing.assert_allclose(peak, expected, atol=0.5)
    with pytest.raises(SignalError, match="as many ascending times"):
        render_moving(
            scene, Poses(path), moments[:5], [40, 15, 15], signal,
            sample_rate=rate, duration=0.1,
        )  # fmt: skip


def test_a_moving_emitter_is_told():
    assert any("5 m/s" in remark for remark in box(emitter_speed=5.0).remarks)
    assert not any("moves" in remark for remark in box().remarks)
