"""Walls that reflect by angle, in rooms: against the exact field over a plane."""

from typing import Any, TypeVar

import numpy as np
import pytest
from scipy.special import j0

from rir import GainPattern, Pose, Poses
from rir.walls import Admittance, Impedance, LayeredWall
from rooms import Scene, simulate
from rooms.effects import EFFECTS, Tolerance
from rooms.effects.traced import traced_energy
from rooms.mesh import MeshGeometry
from rooms.sound import Budget, Sound
from rooms.wave_grid import WaveGrid

Wall = TypeVar("Wall")


def _made(kind: type[Wall], **values: Any) -> Wall:
    """Return a wall from values as a room file states them."""
    return kind(**values)


C = 343.2
OCTAVES = [250.0, 500.0, 1000.0]
WOOL = {"porous": {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000.0}}
LAYERS = _made(LayeredWall, layers=[WOOL], locally_reacting=True)
EFFECTS_ON = ["direct", "specular", "walls"]


def _nodes(end, panels=16):
    """Return nodes and weights over 0…end, 40 in each panel."""
    x, w = np.polynomial.legendre.leggauss(40)
    starts = np.arange(panels)[:, None]
    return ((starts + (x + 1) / 2) * end / panels).ravel(), np.tile(
        w * end / (2 * panels), panels
    )


def _reflected(beta, frequency, across, height):
    """Return the field that a locally reacting plane sends back (Sommerfeld)."""
    k = 2 * np.pi * frequency / C
    t, wt = _nodes(np.pi / 2)
    u, wu = _nodes(np.arcsinh(40 / (k * height)))
    cosine, sine = np.cos(t), np.sin(t)
    waves = k * sine * j0(k * across * sine) * np.exp(-1j * k * height * cosine)
    travelling = -1j * np.sum(wt * waves * (cosine - beta) / (cosine + beta))
    cosine, sine = -1j * np.sinh(u), np.cosh(u)
    waves = k * sine * j0(k * across * sine) * np.exp(-k * height * np.sinh(u))
    return travelling + np.sum(wu * waves * (cosine - beta) / (cosine + beta))


def _levels(spectrum):
    return [10 * np.log10(np.mean(np.abs(octave) ** 2)) for octave in spectrum]


@pytest.mark.parametrize("degrees", [0, 60, 80])
@pytest.mark.parametrize("wall", [_made(Admittance, conductance=0.4), LAYERS])
def test_direct_and_reflected_sound_are_those_over_a_plane(wall, degrees):
    low, high = 1.0, 1.4
    across = (low + high) * np.tan(np.radians(degrees))
    ends = [12 - across / 2, 12, low], [12 + across / 2, 12, high]
    scene = Scene.shoebox((24, 24, 12), absorption=1.0, walls={"floor": wall})
    made = simulate(
        scene, *ends, sample_rate=8000, duration=0.12, effects=EFFECTS_ON
    ).responses[0, 0]
    f = np.array([c * np.linspace(0.72, 1.39, 12) for c in OCTAVES])
    heard = np.exp(-2j * np.pi * f[..., None] * np.arange(len(made)) / 8000) @ made
    straight = np.hypot(across, high - low)
    exact = np.exp(-2j * np.pi * f * straight / C) / straight
    for place, frequency in np.ndenumerate(f):
        beta = wall.admittance(np.array([frequency]), np.ones(1))[0]
        exact[place] += _reflected(beta, frequency, across, low + high)
    assert np.allclose(_levels(heard), _levels(exact), atol=0.15)


def test_a_box_and_its_mesh_reflect_alike():
    wall = {"impedance": {"resistance": 2.0, "reactance": -1.0}}
    materials = {"floor": wall, "all": 0.5}
    box = Scene.shoebox(
        (4, 3, 2.5),
        absorption=0.5,
        walls={"floor": _made(Impedance, resistance=2.0, reactance=-1.0)},
    )
    mesh = Scene.of_geometry(MeshGeometry.box((4, 3, 2.5)), materials)
    one, other = (
        simulate(
            scene,
            [0.7, 2.3, 1.1],
            [3.1, 0.9, 1.5],
            sample_rate=8000,
            duration=0.06,
            max_order=3,
            effects=EFFECTS_ON,
        ).responses[0, 0]
        for scene in (box, mesh)
    )
    assert np.linalg.norm(one - other) < 1e-6 * np.linalg.norm(one)


@pytest.mark.parametrize("build", ["box", "mesh"])
def test_exchanging_devices_changes_nothing(build):
    emit, hear = GainPattern.cardioid(), GainPattern.first_order(0.2)
    ends = Pose.at(0.7, 2.3, 1.1, 30), Pose.at(3.1, 0.9, 1.5, 160)

    def scene(one, other):
        gains = {"emitter_gain": one, "listener_gain": other}
        if build == "box":
            return Scene.shoebox((4, 3, 2.5), walls={"all": LAYERS}, **gains)
        outline = [(0, 0), (4, 0), (4, 1.6), (2, 1.6), (2, 3), (0, 3)]
        return Scene.extruded(outline, 2.5, {"all": {"layers": [WOOL]}}, **gains)

    def heard(one, other, there, here):
        options = {"sample_rate": 8000, "duration": 0.1, "rays": None, "max_order": 5}
        on = [*EFFECTS_ON, "patterns"]
        return simulate(
            scene(one, other), there, here, effects=on, **options
        ).responses[0, 0]

    forth, back = heard(emit, hear, *ends), heard(hear, emit, *ends[::-1])
    assert np.linalg.norm(forth - back) < 1e-6 * np.linalg.norm(forth)


def test_only_rooms_with_such_walls_call_for_them():
    budget, tolerance = Budget(16000, 8000), Tolerance()
    plain = EFFECTS["walls"].needed(Scene.shoebox((4, 3, 2.5)), budget, tolerance)
    assert not plain.on
    angled = Scene.shoebox((4, 3, 2.5), walls={"floor": LAYERS})
    need = EFFECTS["walls"].needed(angled, budget, tolerance)
    assert need.on
    assert "1 of 6 surfaces" in need.reason
    stiff = {"x0": _made(Impedance, resistance=0.0, reactance=-2.0)}  # loses nothing
    scene = Scene.shoebox((4, 3, 2.5), walls=stiff)
    assert EFFECTS["walls"].needed(scene, budget, tolerance).on
    rigid = Scene.shoebox((4, 3, 2.5), walls={"x0": _made(Admittance, conductance=0.0)})
    assert not EFFECTS["walls"].needed(rigid, budget, tolerance).on


def _traced(scene, rays=4000):
    """Return energy per second at a listener by rays, (steps, bands), and the sound."""
    listeners = Poses.of([[4, 1, 2]])
    budget = Budget(16000, 2400, None, rays)
    sound = Sound(scene, Pose.at(1.7, 3.1, 1.4), listeners, budget)
    for name in ("walls", "scattering"):
        EFFECTS[name].apply(scene, sound)
    sound.listed_order = 0
    energy, step = traced_energy(scene, sound)
    return energy[0] * step, sound


def test_rays_lose_at_each_angle_what_images_lose():
    soft, hard = _made(LayeredWall, layers=[WOOL]), _made(Admittance, conductance=0.03)
    scene = Scene.shoebox((6, 5, 3), walls={"floor": soft, "all": hard})
    energy, sound = _traced(scene)
    factors = np.abs(sound.by_class(32).specular)
    size, ends = np.array([6, 5, 3]), np.array([[1.7, 3.1, 1.4], [4, 1, 2]])
    line = np.arange(-18, 19)
    index = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1)
    index = index.reshape(-1, 3)
    even = index % 2 == 0
    way = np.where(even, index * size + ends[0], (index + 1) * size - ends[0]) - ends[1]
    length = np.linalg.norm(way, axis=1)
    gain = 1 / length[:, None]
    for axis in range(3):
        angle = (np.abs(way[:, axis]) / length * 31.999).astype(int)
        more, fewer = (np.abs(index[:, axis]) + 1) // 2, np.abs(index[:, axis]) // 2
        ahead = index[:, axis] > 0
        for side, count in enumerate(
            (np.where(ahead, fewer, more), np.where(ahead, more, fewer))
        ):
            gain = gain * factors[2 * axis + side, angle] ** count[:, None]
    heard = (length < 0.15 * C) & (np.abs(index).sum(axis=1) > 0)
    images = (gain[heard] ** 2).sum(axis=0)
    assert np.allclose(10 * np.log10(energy.sum(axis=0) / images), 0, atol=0.15)


def test_rough_walls_decay_as_independent_rays_do():
    hard = _made(Admittance, conductance=0.05)
    scene = Scene.shoebox((4, 4, 4), scattering=1.0, walls={"all": hard})
    energy = _traced(scene, 20000)[0][10:30, 3]
    slope = np.polyfit(np.arange(20), np.log(energy), 1)[0]
    # 100,000 rays in numpy, Lambert's law and (cos - .05)² / (cos + .05)² at each hit;
    # with the absorption of diffuse sound at every angle it is -0.1705
    assert slope == pytest.approx(-0.1648, rel=0.02)


def test_the_grid_has_the_modes_of_its_walls():
    from scipy.signal import butter, sosfilt

    size, beta = np.array([3.0, 2.5, 2.0]), 0.05
    ends = np.array([0.8, 1.1, 0.9]), np.array([2.2, 1.6, 1.3])
    scene = Scene.shoebox(size, walls={"all": _made(Admittance, conductance=beta)})
    grid = WaveGrid(scene, 260.0, 12)
    made = grid.responses(ends[0], ends[1][None], 0.5)[0]
    rise = butter(2, 12, "highpass", fs=grid.sample_rate, output="sos")
    made = sosfilt(rise, made) * np.minimum(4 * np.linspace(1, 0, len(made)), 1)
    f = np.linspace(88, 177, 200)
    turn = np.outer(f, np.arange(len(made))) * grid.time_step
    heard = np.exp(-2j * np.pi * turn) @ made
    # first-order damping of each mode (Kuttruff, section 3.3)
    n, k = np.arange(16), 2 * np.pi * f / C
    twice = np.where(n == 0, 1, 2)
    parts = []
    for length, one, other in zip(size, *ends, strict=True):
        shape = np.cos(n * np.pi * one / length) * np.cos(n * np.pi * other / length)
        wave = (n * np.pi / length) ** 2 + 2j * beta * np.outer(k, twice / length)
        parts.append((shape * twice / length, wave))
    (a, x), (b, y), (c, z) = parts
    gap = x[:, :, None, None] + y[:, None, :, None] + z[:, None, None, :]
    gap = gap - (k**2)[:, None, None, None]
    exact = 4 * np.pi * np.einsum("i,j,k,fijk->f", a, b, c, 1 / gap)
    assert _levels([heard]) == pytest.approx(_levels([exact]), abs=0.5)
