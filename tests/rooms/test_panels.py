"""Faces of limited size: limits, closed forms, and boundary elements of plates."""

from dataclasses import replace

import numpy as np
import pytest

from rir import Pose, Poses
from rooms import Scene, simulate
from rooms.builtin import load_scene
from rooms.diffraction import diffracted_paths
from rooms.effects import EFFECTS, Tolerance
from rooms.mesh import MeshGeometry
from rooms.panels import finite_panels, mirror_strength, parts_of, rims_of
from rooms.panels.fresnel import over_rectangle
from rooms.panels.plates import plate_energy
from rooms.panels.strength import Faces
from rooms.panels.strips import strip_mean, strip_table
from rooms.reflection import Bounces, Reflection
from rooms.sound import Budget, Sound

C = 343.2
OCTAVES = np.array([125.0 * 2**k for k in range(7)])
FLOOR = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
QUAD = [[0, 1, 2], [0, 2, 3]]


def faces(size, angle=0.0, before=5.0, after=5.0, offset=(0, 0), passage=1.0, turn=0.0):
    """Return one reflection on a rectangle that nothing continues."""
    tilt, turn = np.radians(angle), np.radians(turn)
    way = [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)]
    half, place = np.array([size]) / 2, np.array([offset])
    whole = np.ones((1, 2, 2))
    return Faces(
        np.array([way]),
        np.array([before]),
        np.array([after]),
        -half - place,
        half - place,
        np.pi / 2 * whole,
        passage * whole,
        np.inf * whole,
    )


def levels(*args, bands=OCTAVES, **options):
    return 10 * np.log10(mirror_strength(faces(*args, **options), bands, C)[0])


def plate(width, depth, height=0.0, parts=1):
    """Return corners and triangles of a horizontal plate around the origin."""
    edges = np.linspace(-width / 2, width / 2, parts + 1)
    corners = [[x, y, height] for x in edges for y in (-depth / 2, depth / 2)]
    quads = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(parts)]
    return np.array(corners), [
        t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))
    ]


def hall():
    """Return a box with six reflectors under its ceiling."""
    box = MeshGeometry.box((12, 10, 6))
    corners, triangles = [box.vertices + box.origin], [*box.faces]
    count = len(corners[0])
    for x in (3, 6, 9):
        for y in (3, 7):
            own, ours = plate(1.2, 1.0, 4.5)
            corners.append(own + np.array([x, y, 0]))
            triangles += [[count + k for k in t] for t in ours]
            count += len(own)
    return MeshGeometry.from_arrays(np.concatenate(corners), triangles)


def test_large_faces_lose_nothing_and_small_ones_follow_the_limiting_frequency():
    assert levels((300, 300), 45.0) == pytest.approx(np.zeros(7), abs=0.15)
    # Rindel: K = (f / f_g)², f_g = c a* / (2 S cos), where pressures do not even out
    bands = np.array([31.5, 63, 125])
    for angle in (0, 60):
        limit = C * 5 / (2 * 0.25 * np.cos(np.radians(angle)))
        shape = levels((0.5, 0.5), angle, passage=0.0, bands=bands)
        # an octave's mean of f² is 13/12 · (3/2√2)² of that of its middle
        mean = 10 * np.log10(13 / 12 * 9 / 8)
        expected = 20 * np.log10(bands / limit) + mean
        assert shape == pytest.approx(expected, abs=0.4)


def test_around_a_thin_plate_pressures_even_out_12_db_an_octave():
    # far enough not to be in the near field of the dipole that a small plate is
    low = levels((0.5, 0.5), before=60, after=60, bands=np.array([15.75, 31.5]))
    assert np.diff(low)[0] == pytest.approx(12.0, abs=0.1)
    # added mass of a square plate, 0.455 a³ (D. Meyerhoff, 1970): p = k² M / 4 pi d²
    wave = 2 * np.pi * 15.75 / C
    dipole = wave**2 * 0.455 * 0.5**3 / (4 * np.pi * 60**2) * 120
    spread = np.sqrt(0.5) + np.sqrt(0.5) * (np.arange(100) + 0.5) / 100
    expected = 20 * np.log10(dipole) + 10 * np.log10(np.mean(spread**4))
    assert low[0] == pytest.approx(expected, abs=0.1)


def test_exact_plates_and_edges_agree_where_both_hold():
    # one square of four wavelengths: as it is, and as if its rims were half closed
    sides, ends = (2.0, 2.0), np.array([[0.2, 0.1, 4.0], [-0.3, 0.2, 5.0]])
    wave = 24 / 2
    exact = plate_energy(sides, (ends[:1], ends[1:]), wave)[0]
    back = plate_energy(sides, (ends[1:], ends[:1]), wave)[0]
    assert back == pytest.approx(exact, rel=1e-12)
    low = -np.array([[1.0, 1.0]]) - (np.array([[-0.02222, 0.14444]]))
    way = ends[1] * [1, 1, -1] - ends[0]
    whole = np.linalg.norm(way)
    one = replace(
        faces(sides),
        way=way[None] / whole,
        before=np.array([whole * 4 / 9]),
        after=np.array([whole * 5 / 9]),
        low=low,
        high=low + 2,
        passage=np.full((1, 2, 2), 0.89),
    )
    band = np.array([wave * C / (2 * np.pi)])
    edges = mirror_strength(one, band, C)[0, 0]
    assert 10 * np.log10(edges / (exact * whole**2)) == pytest.approx(0, abs=0.3)


def test_at_the_edge_of_a_large_face_half_the_pressure_is_left():
    at_edge = levels((200, 200), offset=(100, 0), passage=0.0)
    assert at_edge == pytest.approx(np.full(7, -6.02), abs=0.1)


BOUNDARY_ELEMENTS = [
    # size, angle, turn, before, after, from 63 Hz [dB] (benchmarks/finite_panels.py)
    ((1, 1), 0, 0, 5, 5, [-31.3, -17.0, -8.7, -3.7, 1.7, 4.2]),
    ((1, 1), 75, 0, 5, 5, [-55.1, -42.0, -31.8, -22.6, -13.4, -5.6]),
    ((2, 1), 30, 0, 5, 5, [-25.1, -11.6, -4.0, 0.5]),
    ((2, 2), 60, 45, 5, 5, [-24.0, -13.8, -4.6, 2.0]),
    ((4, 2), 75, 90, 5, 5, [-28.0, -19.9, -15.3, -9.5, -5.1]),
]


@pytest.mark.parametrize(
    ("size", "angle", "turn", "before", "after", "truth"), BOUNDARY_ELEMENTS
)
def test_plates_mirror_what_boundary_elements_say(
    size, angle, turn, before, after, truth
):
    bands = 63 * 2.0 ** np.arange(len(truth))
    ours = levels(size, angle, before, after, bands=bands, turn=turn)
    assert ours[:3] == pytest.approx(np.array(truth[:3]), abs=0.3)
    assert ours == pytest.approx(np.array(truth), abs=1.0)


def test_exchanging_the_ends_changes_nothing():
    rng = np.random.default_rng(1)
    for _ in range(6):
        angle, turn = rng.uniform(0, 85), rng.uniform(0, 360)
        ways, offset = rng.uniform(0.5, 12, 2), rng.uniform(-0.5, 0.5, 2)
        size = rng.uniform(1.2, 5, 2)
        there = levels(size, angle, *ways, offset, turn=turn)
        back = levels(size, angle, *ways[::-1], offset, turn=turn + 180)
        assert there == pytest.approx(back, abs=1e-9)


def test_strip_is_looked_up_as_it_is_computed():
    widths = np.array([0.3, 1.2, 4.7, 11.1, 19.0])
    for width in widths:
        for sine in (0.0, 0.5, 0.9):
            looked_up = strip_table()(np.array([width]), np.array([sine]))[0]
            assert abs(looked_up - strip_mean(width, np.array([sine]))[0]) < 0.01


def test_a_box_has_no_ends_and_a_corner_room_two():
    assert not rims_of(MeshGeometry.box((6, 5, 3))).limited.any()
    room = MeshGeometry.extruded(FLOOR, 3)
    ended = room.panels.normal[rims_of(room).limited[:, 0]]
    assert sorted(np.round(ended).tolist()) == [[-1, 0, 0], [0, -1, 0]]


def test_faces_in_one_plane_are_one_and_corners_unfold():
    whole, cut = (MeshGeometry.from_arrays(*plate(4, 2, parts=n)) for n in (1, 3))
    for name in ("center", "low", "high", "bend", "passage"):
        one, other = (getattr(rims_of(mesh), name) for mesh in (whole, cut))
        assert one == pytest.approx(other, abs=1e-9)
    # a wall of 3 m on a floor: its image doubles it
    corners = [[0, 0, 0], [2, 0, 0], [2, 0, 3], [0, 0, 3], [2, -1, 0], [0, -1, 0]]
    triangles = [*QUAD, [0, 1, 4], [0, 4, 5]]
    corner = MeshGeometry.from_arrays(corners, triangles)
    rims = rims_of(corner)
    wall = int(np.argmax(np.abs(corner.panels.normal[:, 1])))
    front = int(corner.panels.normal[wall, 1] > 0)
    spans = (rims.high - rims.low)[wall, front]
    assert sorted(np.round(spans, 6).tolist()) == [2, 6]
    # from behind the floor is no corner but an edge of 270 degrees
    spans = (rims.high - rims.low)[wall, 1 - front]
    assert sorted(np.round(spans, 6).tolist()) == [2, 3]
    # furniture that hovers 2 cm above the floor stands on it
    room = load_scene("coupled").geometry.mesh
    rims, names = rims_of(room), np.array(room.surface_names)
    of_sofa = np.isin(room.panels.of_face, np.arange(len(room.panels)))
    of_sofa &= names[room.face_surface] == "sofa"
    sides = np.unique(room.panels.of_face[of_sofa])
    sides = sides[np.abs(room.panels.normal[sides, 2]) < 0.5]
    tall = (rims.high - rims.low)[sides, 0].min(axis=1)
    assert tall == pytest.approx(np.minimum(1.56, [2.0, 2.0, 0.9, 0.9]), abs=0.01)


def test_a_wall_goes_on_behind_a_doorway():
    narrow, distant, none = (
        mirror_strength(replace(wall, gap=np.full((1, 2, 2), gap)), OCTAVES, C)[0]
        for wall in [faces((1.5, 60), passage=0.0)]
        for gap in (0.01, 1e4, np.inf)
    )
    assert narrow == pytest.approx(np.ones(7), abs=0.1)
    assert distant == pytest.approx(none, abs=0.01)
    assert none[0] < 0.5
    # two rooms joined by a doorway 0.9 m wide: four walls beside it go on behind it
    joined = load_scene("coupled").geometry.mesh
    gap = rims_of(joined).gap[:, 0]
    walls = np.isfinite(gap).any(axis=(1, 2))
    assert np.count_nonzero(walls) == 4
    assert gap[np.isfinite(gap)] == pytest.approx(0.9)


def test_a_bent_wall_loses_little_where_its_bend_is_slight():
    whole, slight, steep = (
        mirror_strength(
            replace(faces((1, 20), passage=0.0), bend=np.full((1, 2, 2), bend)),
            OCTAVES,
            C,
        )[0]
        for bend in (0.0, 0.02, np.pi / 2)
    )
    assert whole == pytest.approx(np.ones(7))
    assert np.all(np.abs(1 - slight[:3]) < 0.25)
    assert np.all(steep[:2] < 0.35)


def test_what_the_mirror_loses_is_scattered():
    room = hall()
    change = finite_panels(room, OCTAVES, C)
    assert change is not None
    assert finite_panels(MeshGeometry.box((6, 5, 3)), OCTAVES, C) is None
    surfaces = np.zeros(8, dtype=np.int64)
    cosine, none = np.linspace(0.1, 1, 8), np.full((8, 3), np.nan)
    free = np.full(8, 4.0)
    bounces = Bounces(surfaces, surfaces - 1, cosine, free, free, none)
    plain = Reflection(np.full((8, 7), 0.9), np.full((8, 7), 0.1))
    after = change(plain, bounces)
    total = after.specular**2 + after.diffuse
    assert 10 * np.log10(total / 0.81) == pytest.approx(np.zeros((8, 7)), abs=1e-9)
    assert np.all(after.scattered >= plain.scattered)
    assert np.all(after.scattered[0, :2] > after.scattered[-1, :2])


def test_a_mirrored_path_over_a_reflector_follows_its_size():
    scene = Scene.of_geometry(MeshGeometry.from_arrays(*plate(1, 1)), 0.0)
    ends = Pose.at(-2.5, 0.001, 4.33), Poses.of([Pose.at(2.5, 0.001, 4.33)])
    sound = Sound(scene, *ends, Budget(16000, 1600, 1))
    for name in ("panels", "specular", "diffraction"):
        EFFECTS[name].apply(scene, sound)
    mirror, bent = sound.arrivals
    level = 20 * np.log10(np.abs(mirror.gain[0]) * 10)
    expected = levels((1, 1), 30.0, bands=scene.bands)
    assert level == pytest.approx(expected, abs=0.05)
    # the rim of the mirror is part of it; without fading mirrors four ways bend there
    assert len(bent.delay) == 0
    options = {"bands": OCTAVES, "speed_of_sound": C}
    places = [-2.5, 0.001, 4.33], [[2.5, 0.001, 4.33]]
    assert len(diffracted_paths(scene.geometry.mesh, *places, **options)) == 4
    aside = [-2.5, 0.001, 4.33], [[6.5, 0.001, 4.33]]
    left = diffracted_paths(scene.geometry.mesh, *aside, **options, fading_mirrors=True)
    assert len(left) > 0


def test_rays_tell_the_panels_of_one_surface_apart():
    room = hall()
    mesh, surface, panel = parts_of(room)
    assert len(surface) == mesh.surfaces == 2
    assert mesh.areas == pytest.approx([504, 14.4], rel=0.01)
    scene = Scene.of_geometry(room, 0.1)
    ends = Pose.at(2, 5, 1.5), Poses.of([Pose.at(9, 4, 1.2)])
    sound = Sound(scene, *ends, Budget(16000, 1600))
    EFFECTS["panels"].apply(scene, sound)
    cosines = np.array([0.2, 0.6, 1.0])
    whole, parts = sound.table(cosines), sound.table(cosines, sound.parts)
    assert np.all(parts.scattered[0] == 0)
    assert np.all(parts.scattered[1, :, :2] > 0.6)
    share = mesh.areas / mesh.areas.sum()
    mean = np.einsum("p,pcb->cb", share, parts.scattered)
    assert mean == pytest.approx(whole.scattered[0], abs=1e-3)
    assert panel.tolist() == sorted(panel.tolist())


def test_the_planner_asks_for_sizes():
    budget, tolerance = Budget(16000, 8000), Tolerance()
    box = Scene.shoebox((6, 5, 3), absorption=0.2)
    need = EFFECTS["panels"].needed(box, budget, tolerance)
    assert not need.on
    assert need.reason == "no face has a free edge"
    corner = Scene.extruded(FLOOR, 3, {"all": {"absorption": 0.2, "scattering": 0.3}})
    assert not EFFECTS["panels"].needed(corner, budget, tolerance).on
    # a hall all of whose walls are narrow panels
    angle = np.linspace(0, 2 * np.pi, 9)[:-1]
    zigzag = np.repeat(10 + np.array([0.0, 1.2] * 4), 1)
    outline = np.column_stack([zigzag * np.cos(angle), zigzag * np.sin(angle)])
    star = Scene.extruded(outline, 4, 0.1)
    assert EFFECTS["panels"].needed(star, budget, tolerance).on


def test_swapping_the_ends_in_a_hall_of_reflectors():
    scene = Scene.of_geometry(hall(), {"all": {"absorption": 0.3, "scattering": 0.2}})
    one, other = Pose.at(2, 5, 1.5), Pose.at(9, 4, 1.2)
    effects = ["scattering", "panels", "direct", "specular", "diffraction", "late"]
    there, back = (
        simulate(
            scene, a, [b], sample_rate=8000, duration=0.2, rays=400, effects=effects
        ).responses[0, 0]
        for a, b in ((one, other), (other, one))
    )
    assert np.linalg.norm(there - back) < 1e-6 * np.linalg.norm(there)


def test_rectangles_met_along_a_diagonal_follow_kirchhoffs_integral():
    sides, tilt = np.array([1.4, 0.9]), np.radians(60)
    one = np.array([-np.sin(tilt) * 0.8, -np.sin(tilt) * 0.6, np.cos(tilt)]) * 5
    other = one * [-1, -1, 1]
    wave = np.array([20.0, 45.0, 70.0])
    x, y = ((np.arange(400) + 0.5) / 400 * side - side / 2 for side in sides)
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((400, 400))], -1)
    far = [np.linalg.norm(points - end, axis=-1) for end in (one, other)]
    angle = (one[2] / far[0] + other[2] / far[1]) / 2
    area, whole = np.prod(sides) / 400**2, 10.0
    truth = [
        np.sum(np.exp(1j * k * (far[0] + far[1])) * angle / (far[0] * far[1]))
        * (whole * k * area / (2 * np.pi))
        for k in wave
    ]
    reach = np.array([[-0.7, 0.7], [-0.45, 0.45]])
    detour = np.empty((1, 2, 2))
    for side, end in np.ndindex(2, 2):
        rim = np.eye(3)[side] * reach[side, end]
        ways = (np.linalg.norm(point - rim) for point in (one, other))
        detour[0, side, end] = sum(ways) - whole
    s, t = (np.sin(tilt) * 0.8) ** 2, (np.sin(tilt) * 0.6) ** 2
    cross = np.array([np.sqrt(s * t / ((1 - s) * (1 - t)))])
    ours = over_rectangle(detour, cross, wave, 0 * wave)[0]
    assert np.abs(ours) == pytest.approx(np.abs(truth), rel=0.06)
    product = over_rectangle(detour, 0 * cross, wave, 0 * wave)[0]
    assert np.max(np.abs(np.abs(product) / np.abs(truth) - 1)) > 0.15
