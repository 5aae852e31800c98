"""Walls against closed forms: what admittances, layers and sheets do to plane waves."""

from typing import Any, TypeVar

import numpy as np
import pytest

from rir import Surface
from rir.errors import ConfigError
from rir.physics import AIR_DENSITY, AIR_VISCOSITY, speed_of_sound
from rir.walls import (
    WALL_MODELS,
    Admittance,
    Impedance,
    LayeredWall,
    Perforated,
    Porous,
    pressure_factor,
    random_incidence,
    random_incidence_octaves,
    real_admittance,
)
from rir.walls.conformance import check_wall_model

Wall = TypeVar("Wall")


def _made(kind: type[Wall], **values: Any) -> Wall:
    """Return a wall from values as a room file states them."""
    return kind(**values)


C = speed_of_sound(20.0)
F = np.array([63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0])
WOOL = {"porous": {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000.0}}


def _gap(depth):
    return {"air_gap": {"thickness_m": depth}}


def test_real_impedance_absorbs_diffuse_sound_as_kuttruff_says():
    zeta = np.array([0.3, 1.0, 1.567, 4.0, 30.0, 1000.0])
    closed = 8 / zeta**2 * (1 + zeta - 1 / (1 + zeta) - 2 * np.log1p(zeta))
    found = [
        random_incidence(_made(Impedance, resistance=float(z)), [500.0])[0]
        for z in zeta
    ]
    assert np.allclose(found, closed, atol=1e-9)
    assert found[2] == pytest.approx(0.951, abs=5e-4)
    assert max(found) == found[2]


def test_complex_impedance_absorbs_diffuse_sound_as_kuttruff_says():
    for resistance, reactance in ((2.0, 3.0), (0.7, -1.5)):
        size, phase = np.hypot(resistance, reactance), np.arctan2(reactance, resistance)
        turn = np.arctan(size * np.sin(phase) / (1 + size * np.cos(phase)))
        closed = size + np.cos(2 * phase) / np.sin(phase) * turn
        closed -= np.cos(phase) * np.log(1 + 2 * size * np.cos(phase) + size**2)
        closed *= 8 * np.cos(phase) / size**2
        wall = _made(Impedance, resistance=resistance, reactance=reactance)
        assert random_incidence(wall, [500.0])[0] == pytest.approx(closed, abs=1e-6)


def test_admittance_of_an_absorption_absorbs_it():
    shares = np.array([0.0, 0.02, 0.3, 0.7, 0.95])
    for share, beta in zip(shares, real_admittance(shares), strict=True):
        wall = _made(Admittance, conductance=float(beta))
        assert random_incidence(wall, [1000.0])[0] == pytest.approx(share, abs=1e-6)
    with pytest.raises(ValueError, match=r"at most 0\.951"):
        real_admittance(np.array([0.96]))


def test_an_air_gap_before_a_rigid_wall_only_delays():
    depth, cosine = 0.13, np.array([1.0, 0.6, 0.2])
    factor = pressure_factor(
        _made(LayeredWall, layers=[_gap(depth)]), F[:, None], cosine
    )
    turned = np.exp(-4j * np.pi * F[:, None] / C * depth * cosine)
    assert np.allclose(factor, turned, atol=1e-12)


def test_a_thin_resistive_sheet_absorbs_all_a_quarter_wave_before_the_wall():
    depth = 0.1
    sheet = {"panel": {"mass_kg_m2": 1e-6, "resistance_pa_s_m": AIR_DENSITY * C}}
    wall = _made(LayeredWall, layers=[sheet, _gap(depth)])
    quarter = C / (4 * depth)
    assert abs(pressure_factor(wall, quarter, 1.0)) < 1e-4
    assert abs(pressure_factor(wall, 2 * quarter, 1.0)) > 0.999


def test_a_panel_between_two_rooms_follows_the_mass_law():
    mass = 12.0
    wall = _made(LayeredWall, layers=[{"panel": {"mass_kg_m2": mass}}], backing="air")
    cosine = np.array([1.0, 0.5])
    passed = 1 - np.abs(pressure_factor(wall, F[:, None], cosine)) ** 2
    part = np.pi * F[:, None] * mass * cosine / (AIR_DENSITY * C)
    assert np.allclose(passed, 1 / (1 + part**2), rtol=1e-9)


def test_a_panel_resonates_with_the_air_behind_it():
    mass, depth = 5.0, 0.05
    panel = {"panel": {"mass_kg_m2": mass, "resistance_pa_s_m": 500.0}}
    wall = _made(LayeredWall, layers=[panel, _gap(depth)])
    f = np.linspace(40, 400, 2000)
    absorbed = 1 - np.abs(pressure_factor(wall, f, 1.0)) ** 2
    resonance = C / (2 * np.pi) * np.sqrt(AIR_DENSITY / (mass * depth))
    assert f[absorbed.argmax()] == pytest.approx(resonance, rel=0.02)


def test_miki_gives_the_published_impedance_and_wavenumber():
    impedance, wave = Porous(thickness_m=0.05, flow_resistivity_pa_s_m2=10000).medium(
        np.array([1000.0])
    )
    # Y. Miki 1990 with 1000 f / flow resistivity = 100
    assert impedance[0] == pytest.approx(1 + (5.50 - 8.43j) * 100**-0.632, rel=2e-3)
    assert wave[0] == pytest.approx(1 + (7.81 - 11.41j) * 100**-0.618, rel=3e-3)


def test_a_deep_porous_layer_hides_its_backing():
    deep = _made(
        LayeredWall,
        layers=[{"porous": {"thickness_m": 5.0, "flow_resistivity_pa_s_m2": 2e4}}],
    )
    medium = Porous(thickness_m=1.0, flow_resistivity_pa_s_m2=2e4)
    impedance, wave = medium.medium(F)
    across = np.sqrt(wave**2 - 0.75 + 0j)
    assert np.allclose(
        deep.admittance(F, np.array(0.5)), across / (wave * impedance), rtol=1e-3
    )


def test_local_reaction_forgets_the_angle():
    wall = _made(LayeredWall, layers=[WOOL, _gap(0.1)], locally_reacting=True)
    free = _made(LayeredWall, layers=[WOOL, _gap(0.1)])
    assert np.allclose(
        wall.admittance(F, np.array(0.2)), free.admittance(F, np.array(1.0))
    )
    assert not np.allclose(
        free.admittance(F, np.array(0.2)), wall.admittance(F, np.array(1.0))
    )


def test_narrow_holes_resist_as_poiseuille_says_and_wide_ones_weigh():
    narrow = Perforated(thickness_m=0.05, hole_diameter_m=1e-4, open_share=0.01)
    poiseuille = 32 * AIR_VISCOSITY * 0.05 / 1e-8 / (0.01 * AIR_DENSITY * C)
    assert narrow.impedance(np.array([20.0]))[0].real == pytest.approx(
        poiseuille, rel=0.01
    )
    wide = Perforated(thickness_m=0.02, hole_diameter_m=0.02, open_share=0.1)
    root = np.sqrt(0.1)
    ends = 8 / (3 * np.pi) * 0.02 * (1 - 1.47 * root + 0.47 * root**3)
    mass = 2 * np.pi * 4000 * (0.02 + ends) / (0.1 * C)
    assert wide.impedance(np.array([4000.0]))[0].imag == pytest.approx(mass, rel=0.01)


@pytest.mark.parametrize("name", WALL_MODELS)
def test_every_wall_model_keeps_its_promises(name):
    check_wall_model(name)


def test_a_surface_takes_one_kind_of_wall():
    surface = Surface.model_validate({"layers": [WOOL], "scattering": 0.1})
    assert surface.wall_model is not None
    assert surface.absorption_per_band[3] == pytest.approx(0.83, abs=0.02)
    local = Surface.model_validate({"absorption": 0.3, "locally_reacting": True})
    assert np.allclose(local.absorption_per_band, 0.3)
    assert local.wall_model is not None
    assert np.allclose(random_incidence_octaves(local.wall_model, F), 0.3, atol=1e-6)
    assert Surface.model_validate({"absorption": 0.3}).wall_model is None


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"layers": [WOOL], "absorption": 0.3}, "absorption and layers"),
        ({"layers": [{**WOOL, **_gap(0.1)}]}, "a layer is one of"),
        ({"layers": [{"porous": {"thickness_m": -1}}]}, "flow_resistivity"),
        ({"absorption": 0.99, "locally_reacting": True}, "at most 0.951"),
        ({"impedance": 0}, "no wall has it"),
        ({"wall": {"marble": {}}}, "no wall model 'marble'"),
        ({"absorption": 0.3, "backing": "air"}, "needs layers"),
    ],
)
def test_mistakes_in_walls_are_told(entry, words):
    from rir.config import validate

    with pytest.raises(ConfigError, match=words):
        validate(entry, Surface, origin="room.yaml")
