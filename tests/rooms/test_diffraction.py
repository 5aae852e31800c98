import numpy as np
import pytest

from rir.errors import SceneError
from rooms.diffraction import diffracted_paths, find_edges
from rooms.diffraction.utd import diffraction_coefficient
from rooms.mesh import MeshGeometry, find_paths

C = 343.2
OCTAVES = 125.0 * 2 ** np.arange(7)
FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
HORSESHOE = [(0, 0), (8, 0), (8, 6), (5.5, 6), (5.5, 3), (2.5, 3), (2.5, 6), (0, 6)]
OPTIONS = {"bands": OCTAVES, "speed_of_sound": C}
PLAIN = {**OPTIONS, "max_mirrors": 0}

WEDGE_STEPS = 40001  # of 0.0007 of the distance along the edge


def wedge_pressure(opening, emitter, listener, frequencies, speed_of_sound):
    """Return the exact pressure bent by a long rigid wedge; free field is 1/d.

    Biot, Tolstoy and Medwin, as in U. P. Svensson, R. I. Fred, J. Vanderkooy, JASA
    106, 2331 (1999), equations 5, 6. An end is its distance from the edge [m], angle
    from the first face [rad], and place along the edge [m].
    """
    reach = 400.0  # m along the edge, where the integral has faded out
    nu = np.pi / opening
    (rs, ts, zs), (rr, tr, zr) = emitter, listener
    apex = (zs * rr + zr * rs) / (rs + rr)
    # close steps at the apex, where the integrand peaks near shadow boundaries
    narrow = 1e-4 * (rs + rr)
    end = np.arcsinh(reach / narrow)
    u = np.linspace(-end, end, WEDGE_STEPS)
    z, weight = apex + narrow * np.sinh(u), narrow * np.cosh(u) * (u[1] - u[0])
    fade = np.clip((reach - np.abs(z - apex)) / (0.9 * reach), 0, 1)
    weight *= np.sin(np.pi / 2 * fade) ** 2
    m, way = np.hypot(rs, z - zs), np.hypot(rr, z - zr)
    stretch = (m * way + (z - zs) * (z - zr)) / (rs * rr)
    eta = np.arccosh(np.maximum(stretch, 1.0))
    beta = np.zeros_like(z)
    for phi in (np.pi + ts + tr, np.pi + ts - tr, np.pi - ts + tr, np.pi - ts - tr):
        beta += np.sin(nu * phi) / (np.cosh(nu * eta) - np.cos(nu * phi))
    k = 2 * np.pi * np.asarray(frequencies, dtype=float) / speed_of_sound
    waves = np.exp(-1j * k[:, None] * (m + way))
    return -nu / (4 * np.pi) * waves @ (beta * weight / (m * way))


def utd(opening, one, other, near=2.0, far=2.0, frequencies=OCTAVES):
    k = 2 * np.pi * frequencies / C
    bend = diffraction_coefficient(
        opening, one, other, 1.0, near * far / (near + far), k
    )
    wave = np.exp(-1j * k * (near + far))
    return bend * wave / np.sqrt(near * far * (near + far))


@pytest.mark.parametrize("opening", [2 * np.pi, 1.5 * np.pi])
@pytest.mark.parametrize("one", [0.05, 0.3, np.pi / 4, 1.2])
def test_utd_is_within_a_third_of_a_decibel_of_btm_in_the_shadow(opening, one):
    for other in np.linspace(np.pi + one + 0.02, opening - 0.02, 12):
        exact = wedge_pressure(opening, (2, one, 0), (2, other, 0), OCTAVES, C)
        error = 20 * np.log10(np.abs(utd(opening, one, other) / exact))
        assert np.abs(error).max() < 0.3


@pytest.mark.parametrize("opening", [2 * np.pi, 1.5 * np.pi])
def test_utd_is_close_to_btm_in_the_light(opening):
    for other in np.linspace(0.1, np.pi + 0.25, 12):
        exact = wedge_pressure(opening, (2, 0.3, 0), (2, other, 0), OCTAVES, C)
        straight = np.sqrt(8 - 8 * np.cos(other - 0.3))
        error = np.abs(utd(opening, 0.3, other) - exact) * straight
        assert error.max() < 10 ** (0.3 / 20) - 1


def test_pressure_is_continuous_across_the_shadow_boundary():
    k = 2 * np.pi * OCTAVES / C
    total = []
    for other in np.pi + 0.8 + np.array([-1e-4, 1e-4]):
        lit = other - 0.8 < np.pi
        distance = np.sqrt(8 - 8 * np.cos(other - 0.8))
        direct = np.exp(-1j * k * distance) / distance if lit else 0
        total.append(utd(2 * np.pi, 0.8, other) + direct)
    np.testing.assert_allclose(total[0], total[1], atol=2e-3)


def test_on_the_shadow_boundary_half_the_pressure_is_left_at_high_frequency():
    bent = np.abs(utd(2 * np.pi, 0.8, np.pi + 0.8, frequencies=np.array([16_000.0])))
    np.testing.assert_allclose(20 * np.log10(4 * bent), -6, atol=0.3)


def test_exchanging_the_ends_changes_no_bit():
    room = MeshGeometry.extruded(HORSESHOE, 3)
    a, b = [1, 5, 1], [7, 5, 1.5]
    there = diffracted_paths(room, a, [b], **PLAIN)
    back = diffracted_paths(room, b, [a], **PLAIN)
    assert there.order.tolist() == [2]
    np.testing.assert_allclose(back.length, there.length, rtol=1e-12)
    np.testing.assert_allclose(back.gain, there.gain, rtol=1e-10)
    np.testing.assert_allclose(back.departure, there.arrival, atol=1e-9)


def test_way_around_a_corner_unfolds_to_the_shortest():
    room = MeshGeometry.extruded(FLOOR, 3)
    ways = diffracted_paths(room, [1, 4.5, 1], [[5.5, 1, 1.5]], **PLAIN)
    flat = np.hypot(2, 2) + np.hypot(2.5, 1.5)
    np.testing.assert_allclose(ways.length, np.hypot(flat, 0.5))
    assert ways.order.tolist() == [1]
    assert len(find_paths(room, [1, 4.5, 1], [[5.5, 1, 1.5]], max_order=0)) == 0


def test_convex_rooms_have_no_edges_and_no_ways():
    room = MeshGeometry.box((6, 5, 3))
    assert len(find_edges(room)) == 0
    ways = diffracted_paths(room, [1, 1, 1], [[5, 4, 2]], **OPTIONS)
    assert len(ways) == 0
    assert ways.gain.shape == (0, 7)


def test_screen_bends_at_its_free_rim_only(screened_box):
    room = screened_box(3)
    rims = find_edges(room, least_opening_deg=300)
    assert len(rims) == 1
    ways = diffracted_paths(room, [1, 1, 1], [[5, 1, 1.2]], **PLAIN)
    np.testing.assert_allclose(ways.length, [np.hypot(2 * np.hypot(2, 2), 0.2)])
    level = 20 * np.log10(np.abs(ways.gain[0]) * np.hypot(4, 0.2))
    fresnel = 2 * (2 * np.hypot(2, 2) - 4) / (C / OCTAVES)
    root = np.sqrt(2 * np.pi * fresnel)
    maekawa = -5 - 20 * np.log10(root / np.tanh(root))
    np.testing.assert_allclose(level, maekawa, atol=1.5)


def test_absorbing_faces_bend_less_than_rigid_ones():
    room = MeshGeometry.extruded(FLOOR, 3)
    places = [1, 4.5, 1], [[5.5, 1, 1.5]]
    rigid = diffracted_paths(room, *places, **OPTIONS)
    soft = diffracted_paths(
        room, *places, **OPTIONS, reflection=np.full((room.surfaces, 7), 0.3)
    )
    assert np.all(np.abs(soft.gain) < np.abs(rigid.gain))


def test_more_than_two_edges_are_refused():
    with pytest.raises(SceneError, match="1 or 2 edges"):
        diffracted_paths(
            MeshGeometry.box((1, 1, 1)), [0.5] * 3, [[0.5] * 3], **OPTIONS, max_order=3
        )


def around_the_corner(here, there):
    """Return the way from an image around the one edge of FLOOR, by Biot et al."""
    ends: list[tuple[float, float, float]] = []
    for place in (here, there):
        x, y = place[0] - 3, place[1] - 2.5
        # from the face along +x the air goes clockwise to the face along +y
        ends.append((np.hypot(x, y), -np.arctan2(y, x) % (2 * np.pi), place[2]))
    return wedge_pressure(1.5 * np.pi, ends[0], ends[1], OCTAVES, C)


@pytest.mark.parametrize(
    ("normal", "offset"),
    [((0, 0, 1), 0.0), ((0, 0, 1), 3.0), ((1, 0, 0), 0.0), ((0, 1, 0), 0.0)],
    ids=["floor", "ceiling", "wall before", "wall after"],
)
def test_a_mirrored_way_is_the_exact_wedge_seen_by_an_image(normal, offset):
    room = MeshGeometry.extruded(FLOOR, 3)
    here, there = np.array([1.2, 4.4, 1.1]), np.array([5.3, 1.0, 1.6])
    ways = diffracted_paths(room, here, [there], **OPTIONS)
    images = [
        (p - 2 * (p @ normal - offset) * np.array(normal), q)
        for p, q in ((here, there), (there, here))
    ]
    lengths = [
        np.hypot(np.hypot(*(p - [3, 2.5, 0])[:2]) + np.hypot(*(q - [3, 2.5, 0])[:2]),
                 p[2] - q[2])
        for p, q in images
    ]  # fmt: skip
    found = [
        (k, image)
        for image, length in zip(images, lengths, strict=True)
        for k in np.nonzero(np.abs(ways.length - length) < 1e-9)[0]
    ]
    assert len(found) >= 1
    for k, image in found:
        assert ways.mirrors[k] == 1
        exact = around_the_corner(*image)
        error = 20 * np.log10(np.abs(ways.gain[k] / exact))
        assert np.abs(error).max() < 0.3


def test_a_floor_mirrors_a_bent_way_exactly_once():
    # unfolded over the floor, a way meets the edge above or below it, never both
    room = MeshGeometry.extruded(FLOOR, 3)
    rng = np.random.default_rng(2)
    for _ in range(20):
        here = rng.uniform([0.2, 2.8, 0.2], [2.8, 4.8, 2.8])
        there = rng.uniform([3.2, 0.2, 0.2], [5.8, 2.3, 2.8])
        ways = diffracted_paths(room, here, [there], **OPTIONS)
        flat = sum(np.hypot(*(p - [3, 2.5, 0])[:2]) for p in (here, there))
        for up in (here[2] + there[2], 6 - here[2] - there[2]):
            assert np.sum(np.abs(ways.length - np.hypot(flat, up)) < 1e-9) == 1


def test_mirrored_ways_are_exchanged_like_any_other():
    room = MeshGeometry.extruded(HORSESHOE, 3)
    factors = np.linspace(0.4, 0.95, room.surfaces * 7).reshape(-1, 7)
    for a, b in (([1, 5, 1], [4, 1, 1.5]), ([1, 5, 1], [6.5, 2, 2.2])):
        there = diffracted_paths(room, a, [b], **OPTIONS, reflection=factors)
        back = diffracted_paths(room, b, [a], **OPTIONS, reflection=factors)
        assert there.mirrors.max() == 1
        one, other = (
            np.lexsort((np.abs(ways.gain[:, 0]).round(9), ways.length.round(9)))
            for ways in (there, back)
        )
        np.testing.assert_allclose(back.length[other], there.length[one], rtol=1e-12)
        np.testing.assert_allclose(back.gain[other], there.gain[one], rtol=1e-9)
        leave, reach = there.arrival[one], back.departure[other]
        np.testing.assert_allclose(reach, leave, atol=1e-9)


def test_a_mirror_takes_its_share_and_must_be_wide_enough():
    room = MeshGeometry.extruded(FLOOR, 3)
    places = [1.2, 4.4, 1.1], [[5.3, 1.0, 1.6]]
    hard = np.ones((room.surfaces, 7))
    soft = hard.copy()
    soft[room.surface_names.index("floor")] = 0.5
    ways = [
        diffracted_paths(room, *places, **OPTIONS, reflection=r) for r in (hard, soft)
    ]
    share = np.abs(ways[1].gain / ways[0].gain)[:, 0]
    downwards = ways[0].departure[:, 2] < -0.1
    downwards |= ways[0].arrival[:, 2] < -0.1
    assert {*np.round(share, 9)} == {0.5, 1.0}
    np.testing.assert_allclose(share[ways[0].mirrors == 0], 1.0)
    assert np.all(downwards[share < 0.9])
    # a hole where the way meets the wall x = 0 takes that way alone
    whole = diffracted_paths(room, *places, **OPTIONS)
    holed = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5),
             (0, 3.9), (-1, 3.9), (-1, 2.9), (0, 2.9)]  # fmt: skip
    fewer = diffracted_paths(MeshGeometry.extruded(holed, 3), *places, **OPTIONS)
    lost = [k for k in whole.length if np.abs(fewer.length - k).min() > 1e-6]
    image = np.array([-1.2, 4.4])
    flat = np.hypot(*(image - [3, 2.5])) + np.hypot(2.3, 1.5)
    np.testing.assert_allclose(lost, [np.hypot(flat, 0.5)])
