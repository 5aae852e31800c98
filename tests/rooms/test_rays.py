import numpy as np
import pytest

from rir.errors import SceneError
from rooms.mesh import MeshGeometry, find_paths
from rooms.rays import trace_energy
from rooms.rays.patches import find_patches
from rooms.rays.population import resampled

FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
C = 343.2
A, B = [[1.7, 3.1, 1.4]], [[4.1, 1.3, 1.9]]


def traced(room, absorption, scattering, *, places=(A, B), bands=1, **changes):
    options = {
        "rays": 4000,
        "duration": 0.5,
        "time_step": 0.001,
        "speed_of_sound": C,
        "skip_specular_up_to": -1,
    }
    shape = (room.surfaces, bands)
    return trace_energy(
        room,
        np.broadcast_to(absorption, shape),
        np.broadcast_to(scattering, shape),
        *places,
        **{**options, **changes},
    )


@pytest.mark.parametrize("scattering", [0.1, 0.5, 0.9])
def test_lossless_room_keeps_its_energy(scattering):
    room = MeshGeometry.extruded(FLOOR, 3)
    result = traced(room, 0.0, scattering, rays=24_000)
    late = result.energy[0, 0, 0, 100:].mean()
    np.testing.assert_allclose(late, 4 * np.pi * C * 0.001 / room.volume, rtol=0.02)


def test_free_field_energy_is_one_over_distance_squared():
    room = MeshGeometry.box((60, 50, 40))
    places = [[20, 20, 20]], [[28, 26, 20]]
    result = traced(room, 1.0, 0.0, places=places, rays=400_000, duration=0.04)
    np.testing.assert_allclose(result.energy.sum(), 1 / 100, rtol=0.03)
    heard = np.nonzero(result.energy[0, 0, 0])[0]
    np.testing.assert_allclose(heard.mean() * 0.001, 10 / C, atol=0.001)


@pytest.mark.parametrize("rays", [1, 37, 4000])
def test_exchanging_the_ends_changes_no_bit(rays):
    room = MeshGeometry.extruded(FLOOR, 3)
    rng = np.random.default_rng(4)
    tables = rng.uniform(0, 0.6, (2, room.surfaces, 3))
    places = np.array([*A, *B, [0.5, 0.05, 0.4]])
    options = {"rays": rays, "duration": 0.2, "time_step": 0.002, "speed_of_sound": C}
    there = trace_energy(room, tables[0], tables[1], places[:1], places[1:], **options)
    back = trace_energy(room, tables[0], tables[1], places[1:], places[:1], **options)
    np.testing.assert_array_equal(there.energy, back.energy.swapaxes(0, 1))
    np.testing.assert_array_equal(there.error, back.error.swapaxes(0, 1))
    assert there.energy.shape == (1, 2, 3, 100)


def test_no_order_is_counted_twice_where_images_end():
    room = MeshGeometry.box((4.5, 5, 4))
    absorption, scattering, totals = 0.2, 0.1, []
    reflection = np.full((6, 1), np.sqrt((1 - absorption) * (1 - scattering)))
    places = [[1.5, 3.1, 1.4]], [[3.1, 1.4, 2.3]]
    for order in range(5):
        rest = traced(
            room,
            absorption,
            scattering,
            places=places,
            skip_specular_up_to=order,
            rays=30_000,
        )
        paths = find_paths(room, places[0][0], places[1], max_order=order)
        totals.append(rest.energy.sum() + np.sum(paths.gains(reflection) ** 2))
    assert 10 * np.log10(max(totals) / min(totals)) < 0.1


def test_diffuse_room_decays_as_eyring_says():
    room = MeshGeometry.box((6, 5, 3))
    energy = traced(room, 0.2, 0.5, rays=20_000, duration=0.8).energy[0, 0, 0]
    left = np.cumsum(energy[::-1])[::-1]
    level = 10 * np.log10(left / left[0], where=left > 0, out=np.full(800, -np.inf))
    use = (level < -5) & (level > -35)
    slope = np.polyfit(np.arange(800)[use] * 0.001, level[use], 1)[0]
    eyring = 24 * np.log(10) * room.volume / (-C * room.areas.sum() * np.log(0.8))
    np.testing.assert_allclose(-60 / slope, eyring, rtol=0.05)


def test_bands_of_one_ray_are_as_if_each_were_traced_alone():
    room = MeshGeometry.extruded(FLOOR, 3)
    absorption, scattering = np.array([0.1, 0.3, 0.5]), np.array([0.05, 0.2, 0.7])
    joint = traced(room, absorption, scattering, bands=3, rays=20_000)
    for band in range(3):
        alone = traced(room, absorption[band], scattering[band], rays=20_000)
        error = np.hypot(joint.total_error[0, 0, band], alone.total_error[0, 0, 0])
        gap = joint.energy[0, 0, band].sum() - alone.energy.sum()
        assert abs(gap) < 4 * error


def test_few_rays_are_enough_where_all_is_smooth():
    room = MeshGeometry.extruded(FLOOR, 3)
    wanted = traced(room, 0.2, 0.3, rays=60_000, seed=9).energy[0, 0, 0]
    got = traced(room, 0.2, 0.3, rays=2000).energy[0, 0, 0]
    ratio = got.reshape(-1, 25).sum(axis=1)[1:10] / wanted.reshape(-1, 25).sum(1)[1:10]
    np.testing.assert_allclose(10 * np.log10(ratio), 0, atol=0.5)


def test_patches_cover_the_surfaces_once():
    for room in (MeshGeometry.box((6, 5, 3)), MeshGeometry.extruded(FLOOR, 3)):
        for count in (1, 50, 700):
            patches = find_patches(room, count)
            np.testing.assert_allclose(patches.area.sum(), room.areas.sum())
            assert len(patches) < 2 * count + 3 * len(room.faces)
    both = MeshGeometry.from_arrays(room.vertices + room.origin, room.faces[:-2])
    open_area = find_patches(both, 300).area.sum()
    np.testing.assert_allclose(open_area, 2 * both.face_areas.sum())


def test_error_is_honest_and_falls_with_the_rays():
    room = MeshGeometry.extruded(FLOOR, 3)
    few = [traced(room, 0.2, 0.3, rays=800, seed=k) for k in range(24)]
    totals = [result.energy.sum() for result in few]
    stated = np.sqrt(np.mean([result.total_error[0, 0, 0] ** 2 for result in few]))
    assert 0.5 < np.std(totals, ddof=1) / stated < 2
    many = traced(room, 0.2, 0.3, rays=40_000)
    assert many.total_error.sum() < stated / 4


def test_what_no_ray_reaches_stays_silent_and_what_is_dead_finite():
    room = MeshGeometry.box((6, 5, 3))
    dead = traced(room, 1.0, 0.5, skip_specular_up_to=0)
    np.testing.assert_array_equal(dead.energy, 0)
    same = traced(room, 0.3, 0.3, places=(A, A))
    assert np.all(np.isfinite(same.energy))
    wall = traced(room, 0.3, 0.3, places=([[0, 2, 1]], [[6, 5, 3]]))
    assert np.all(np.isfinite(wall.energy))
    assert wall.energy.sum() > 0
    open_room = MeshGeometry.from_arrays(room.vertices + room.origin, room.faces[:-2])
    assert np.all(np.isfinite(traced(open_room, 0.1, 0.2).energy))


@pytest.mark.parametrize("scale", [0.01 / 6, 100 / 6])
def test_sizes_scale(scale):
    room = MeshGeometry.extruded(np.array(FLOOR) * scale, 3 * scale)
    places = np.array(A) * scale, np.array(B) * scale
    times = {"duration": 0.1 * scale, "time_step": 0.001 * scale}
    result = traced(room, 0.2, 0.2, places=places, rays=20_000, **times)
    plain = traced(MeshGeometry.extruded(FLOOR, 3), 0.2, 0.2, rays=20_000, duration=0.1)
    total, wanted = result.energy.sum() * scale**2, plain.energy.sum()
    error = np.hypot(result.total_error.sum() * scale**2, plain.total_error.sum())
    assert abs(total - wanted) < 4 * error + 0.02 * wanted
    assert error < 0.2 * wanted


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"rays": 0}, "1 or more rays"),
        ({"batches": 0}, "batches"),
        ({"duration": 0.0}, "must be positive"),
        ({"time_step": np.nan}, "must be positive"),
    ],
)
def test_useless_budgets_are_refused(changes, match):
    with pytest.raises(SceneError, match=match):
        traced(MeshGeometry.box((6, 5, 3)), 0.2, 0.2, **changes)


def test_useless_shares_are_refused():
    room = MeshGeometry.box((6, 5, 3))
    options = {"rays": 10, "duration": 0.1, "time_step": 0.01, "speed_of_sound": C}
    with pytest.raises(SceneError, match="6 surfaces"):
        trace_energy(room, np.ones((5, 1)), np.ones((6, 1)), A, B, **options)
    with pytest.raises(SceneError, match="0…1"):
        trace_energy(room, np.full((6, 1), 2.0), np.ones((6, 1)), A, B, **options)


@pytest.mark.parametrize("height", [0.02, 0.3, 1.0])
def test_one_rough_wall_returns_the_integral_of_lambert(height):
    room = MeshGeometry.box((6, 5, 3))
    floor = int(np.argmin(room.corners[:, :, 2].mean(axis=1)))
    absorption = np.ones((room.surfaces, 1))
    absorption[room.face_surface[floor]] = 0.2
    a, b = np.array([2.9, 2.4, height]), np.array([3.1, 2.5, 1.3 * height])
    energy = trace_energy(
        room,
        absorption,
        np.ones_like(absorption),
        [a],
        [b],
        rays=20_000,
        duration=0.05,
        time_step=0.0001,
        speed_of_sound=C,
    ).energy[0, 0, 0]
    # finer where the places are
    x, y = (np.sinh(np.linspace(-6, 6, 1201)) for _ in range(2))
    x, y = (v * half / v[-1] for v, half in ((x, 3.0), (y, 2.5)))
    wide = np.outer(np.gradient(x), np.gradient(y))
    x, y = np.meshgrid(x + 3.0, y + 2.5, indexing="ij")
    spans = [np.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + p[2] ** 2) for p in (a, b)]
    flux = a[2] / spans[0] ** 3 * b[2] / spans[1] ** 3 * 0.8 / np.pi * wide
    np.testing.assert_allclose(energy.sum(), flux.sum(), rtol=0.02)
    late = (spans[0] + spans[1]) / C
    mean = np.sum(energy * (np.arange(500) + 0.5)) / energy.sum() * 0.0001
    np.testing.assert_allclose(mean, np.sum(flux * late) / flux.sum(), atol=3e-5)


def test_a_pair_does_not_depend_on_the_other_places():
    room = MeshGeometry.extruded(FLOOR, 3)
    many = np.random.default_rng(1).uniform(0.3, 2.3, (10, 3))
    many[4] = A[0]
    options = {"rays": 200, "duration": 0.1, "bands": 2}
    together = traced(room, 0.2, 0.4, places=(A, many), **options)
    for k in (0, 4, 9):
        alone = traced(room, 0.2, 0.4, places=(A, many[k : k + 1]), **options)
        np.testing.assert_array_equal(together.energy[:, k], alone.energy[:, 0])
        np.testing.assert_array_equal(together.error[:, k], alone.error[:, 0])


@pytest.mark.parametrize("bands", [1, 2, 3, 7, 8, 9, 21])
def test_any_number_of_bands_lies_side_by_side(bands):
    room = MeshGeometry.extruded(FLOOR, 3)
    absorption = np.linspace(0.1, 0.5, bands)
    # before rays are evened out by what all bands carry
    options = {"rays": 400, "duration": 0.04}
    joint = traced(room, absorption, 0.3, bands=bands, **options)
    last = traced(room, absorption[-1], 0.3, **options)
    wanted = last.energy[0, 0, 0]
    np.testing.assert_allclose(joint.energy[0, 0, -1], wanted, rtol=1e-4, atol=1e-9)


def test_evening_out_keeps_the_mean_of_every_band():
    rng = np.random.default_rng(2)
    energies = rng.exponential(1.0, (40, 2)) ** 3
    travellers = (
        np.zeros((40, 6)),
        np.zeros((40, 4)),
        np.arange(40, dtype=np.uint64),
        energies,
        np.ones((40, 2)),
    )
    sums, counts = np.zeros(2), []
    for chance in (np.arange(1000) + 0.5) / 1000:
        drawn = resampled(travellers, 40, 25, chance)
        sums += drawn[3].sum(axis=0) / 1000
        counts.append(len(drawn[2]))
        assert len(np.unique(drawn[2])) == len(drawn[2])
    np.testing.assert_allclose(sums, energies.sum(axis=0), rtol=0.002)
    assert set(counts) == {25}


def test_late_energy_above_a_dead_wall_is_not_left_to_a_few_rays():
    room = MeshGeometry.box((6, 5, 3))
    absorption = np.full((6, 1), 0.05)
    absorption[room.surface_names.index("ceiling")] = 0.6
    late = [
        traced(room, absorption, 0.3, seed=seed, duration=0.6).energy[..., 400:].sum()
        for seed in range(16)
    ]
    assert 4.34 * np.std(late, ddof=1) / np.mean(late) < 0.7
