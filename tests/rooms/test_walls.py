"""Walls that reflect by angle, in rooms: against the exact field over a plane."""

import numpy as np
import pytest
from scipy.special import j0

from rir import GainPattern, Pose
from rir.walls import Admittance, Impedance, LayeredWall
from rooms import Scene, simulate
from rooms.effects import EFFECTS, Tolerance
from rooms.mesh import MeshGeometry
from rooms.sound import Budget

C = 343.2
OCTAVES = [250.0, 500.0, 1000.0]
WOOL = {"porous": {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000.0}}
LAYERS = LayeredWall(layers=[WOOL], locally_reacting=True)
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
@pytest.mark.parametrize("wall", [Admittance(conductance=0.4), LAYERS])
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
        walls={"floor": Impedance(resistance=2.0, reactance=-1.0)},
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
    rigid = Scene.shoebox((4, 3, 2.5), walls={"x0": Admittance(conductance=0.0)})
    assert not EFFECTS["walls"].needed(rigid, budget, tolerance).on
