"""Scattered sound of boxes: energy, exchange, corners, and other engines."""

import numpy as np
import pytest

from rooms import Scene, simulate
from rooms.effects.late import draw_waves
from rooms.energy_flow import energy_flow
from rooms.mesh import MeshGeometry
from rooms.rays import trace_energy
from rooms.transport import FINE, Detail, find_places, pair_energy, transport_of
from rooms.transport.fans import place_rays

SIZE = np.array([5.0, 4.0, 3.0])
C = 343.2
QUICK = Detail(wall_rays=4096, volume_rays=16384)
UNEVEN = np.array([0.1, 0.3, 0.05, 0.2, 0.4, 0.15])[:, None]
ROUGH = np.array([0.2, 0.6, 0.1, 0.9, 0.3, 0.5])[:, None]


def pair(box, one, other, steps=120):
    first, second = find_places(box, np.array([one, other]))
    return pair_energy(box, first, second, 0.002, steps)


def test_exchange_of_the_ends_changes_no_bit():
    absorption = np.hstack([UNEVEN, UNEVEN[::-1]])
    box = transport_of(SIZE, absorption, np.hstack([ROUGH, ROUGH]), C, 0.24, QUICK)
    a, b = [0.3, 3.9, 1.1], [4.2, 0.02, 2.98]
    np.testing.assert_array_equal(pair(box, a, b), pair(box, b, a))


@pytest.mark.parametrize("scattering", [0.1, 1.0])
def test_what_loses_nothing_fills_the_room_evenly(scattering):
    walls = np.zeros((6, 1)), np.full((6, 1), scattering)
    box = transport_of(SIZE, *walls, C, 0.5, FINE)
    energy = box.mean_energy()[-20:-5, 0] * np.prod(SIZE) / (4 * np.pi * C)
    left = 0.0
    if scattering < 1:
        scene = Scene.shoebox(SIZE, absorption=0.0, scattering=scattering)
        flow = energy_flow(scene, box.times[-20:-5], scattering=scene.scattering)
        left = flow.images[:, 0] * np.prod(SIZE) / (4 * np.pi * scene.speed_of_sound)
    np.testing.assert_allclose(10 * np.log10(energy + left), 0, atol=0.02)


def test_fully_absorbing_and_smooth_walls_send_nothing():
    for absorption, scattering in ((1.0, 0.5), (0.2, 0.0)):
        walls = np.full((6, 1), absorption), np.full((6, 1), scattering)
        box = transport_of(SIZE, *walls, C, 0.1, QUICK)
        assert not np.any(pair(box, [1, 1, 1], [2, 2, 2], 40))


@pytest.mark.parametrize("gap", [0.02, 0.2, 1.0])
def test_one_scattering_in_a_corner_is_that_of_a_fine_grid(gap):
    """One wall scatters and two beside it mirror: images, summed over points."""
    mirrors = np.full((6, 1), 1.0)
    mirrors[[0, 2]], mirrors[4] = 0.25, 0.4
    rough = np.zeros((6, 1))
    rough[4] = 1.0
    box = transport_of(SIZE, mirrors, rough, C, 0.1, FINE)
    one, other = np.array([gap, 2 * gap, gap]), np.array([2 * gap, gap, 1.5 * gap])
    found = pair(box, one, other, 50).sum() * 0.002
    # substitution u^3 makes points dense in the corner, where both ends are
    u = (np.arange(1500) + 0.5) / 1500
    x, y = SIZE[0] * u**3, SIZE[1] * u**3
    area = 3 * SIZE[0] * u[:, None] ** 2 * 3 * SIZE[1] * u**2 / 1500**2

    def irradiance(place):
        total = 0.0
        for a, keeps in ((place[0], 1.0), (-place[0], 0.75)):
            for b, also in ((place[1], 1.0), (-place[1], 0.75)):
                square = (x[:, None] - a) ** 2 + (y - b) ** 2 + place[2] ** 2
                total = total + keeps * also * place[2] / (4 * np.pi * square**1.5)
        return total

    exact = 16 * np.pi * 0.6 * np.sum(irradiance(one) * irradiance(other) * area)
    assert abs(10 * np.log10(found / exact)) < 0.1


@pytest.mark.parametrize("end", [5.0, 7.0, 12.0])
def test_rays_of_a_place_tell_how_large_the_end_of_a_corridor_is_seen(end):
    """A wall of half sides a, b at d: 4 asin(ab / sqrt((a² + d²)(b² + d²)))."""
    ways, weights = place_rays(np.array([2.4, 16.0, 2.0]), FINE.place_rays)
    ahead = ways[:, 1] > 1e-3
    beside, up = (np.abs(ways[ahead, k] / ways[ahead, 1]) * end for k in (0, 2))
    seen = 4 * np.pi * weights[ahead][(beside < 1.2) & (up < 1.0)].sum()
    sides = np.sqrt((1.2**2 + end**2) * (1.0 + end**2))
    assert abs(seen / (4 * np.arcsin(1.2 / sides)) - 1) < 0.03
    assert weights.max() * len(weights) < 9
    even = place_rays(np.ones(3), FINE.place_rays)[1]
    np.testing.assert_allclose(even, 1 / FINE.place_rays)


def test_boxes_and_traced_meshes_agree():
    rng = np.random.default_rng(4)
    for absorption, scattering in ((UNEVEN, ROUGH), (ROUGH, UNEVEN[::-1])):
        ends = rng.uniform(0.2, 0.8, (4, 3)) * SIZE
        box = transport_of(SIZE, absorption, scattering, C, 0.24, FINE)
        traced = trace_energy(
            MeshGeometry.box(SIZE), absorption, scattering, ends[:1], ends[1:],
            rays=8000, duration=0.24, time_step=0.002, speed_of_sound=C,
            skip_specular_up_to=-1,
        )  # fmt: skip
        smooth = np.zeros_like(scattering)
        mirrors = trace_energy(
            MeshGeometry.box(SIZE), 1 - (1 - absorption) * (1 - scattering), smooth,
            ends[:1], ends[1:], rays=8000, duration=0.24, time_step=0.002,
            speed_of_sound=C, skip_specular_up_to=-1,
        )  # fmt: skip
        other = (traced.energy - mirrors.energy)[0, :, 0].sum(axis=0)
        ours = np.sum([pair(box, ends[0], end)[:, 0] for end in ends[1:]], 0) * 0.002
        for part in (slice(None), slice(10, 30), slice(30, 60)):
            assert abs(10 * np.log10(ours[part].sum() / other[part].sum())) < 0.25


def test_waveforms_carry_the_energy_they_are_asked_to():
    scene = Scene.shoebox(SIZE, absorption=0.3, scattering=0.7)
    ends = np.array([1.0, 1.2, 1.1]), np.array([3.5, 2.9, 1.7])
    made = [
        simulate(
            scene, *ends, sample_rate=8000, duration=0.2, seed=seed,
            effects=["specular", "scattering", "late"],
        ).responses[0, 0]
        for seed in range(12)
    ]  # fmt: skip
    box = transport_of(
        SIZE, scene.absorption, scene.scattering, scene.speed_of_sound, 0.2, FINE
    )
    one, other = find_places(box, np.array(ends))
    asked = pair_energy(box, one, other, 0.001, 200)[:, 0]
    quiet = simulate(
        scene, *ends, sample_rate=8000, duration=0.2, effects=["specular", "scattering"]
    ).responses[0, 0]
    late = np.mean([(h - quiet) ** 2 for h in made], axis=0).reshape(200, 8).sum(axis=1)
    for part in (slice(8, 25), slice(25, 60)):
        ratio = late[part].sum() / (asked[part].sum() * 0.001)
        assert ratio > 0.9  # the images that waves stand for come on top


def test_waves_arrive_more_evenly_than_if_drawn_one_by_one():
    """Counts in 20 ms, mean of 200 listeners of an emitter in a hall."""
    rng, size = np.random.default_rng(5), np.array([30.0, 20.0, 12.0])
    listeners = rng.uniform(-0.5, 0.5, (200, 3)) * size / C
    emitter = np.array([0.35, -0.3, 0.2]) * size / C

    def stray(time, one, other):
        delays = time[:, None] - (one @ emitter)[:, None] - other @ listeners.T
        counts = np.histogram(delays, bins=np.arange(0.0, 0.5, 0.02))[0]
        return np.std(counts / len(listeners))

    even, single = [], []
    for seed in range(4):
        time, one, other, sign = draw_waves(seed, 4000, 2.5e-4, -0.12)
        ways = rng.standard_normal((2, 4000, 3))
        ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
        even.append(stray(time, one, other))
        single.append(stray(time, *ways))
        assert abs(np.mean(sign)) < 0.05
    assert np.mean(even) < 0.5 * np.mean(single)


def test_waves_are_as_many_from_everywhere():
    """Sound at places d apart is alike as sin(kd) / kd, without any direction."""
    _, one, other, _ = draw_waves(8, 4000, 1.0, 0.0)
    for way in (one, other):
        np.testing.assert_allclose(way.T @ way / 4000, np.eye(3) / 3, atol=0.01)
        for apart in (0.7, 2.0, 4.5):
            heard = np.mean(np.exp(1j * apart * way), axis=0)
            np.testing.assert_allclose(heard, np.sinc(apart / np.pi), atol=0.03)
