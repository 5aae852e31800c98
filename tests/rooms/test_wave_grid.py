"""The wave grid: cut cells, thin walls, octaves of their own, few cells per wave."""

import numpy as np
import pytest

from rir import RoomSpec
from rooms import Scene, simulate
from rooms.effects.modes import crossover_of
from rooms.mesh.cut_cells import cut_cells
from rooms.request import make_budget
from rooms.wave_grid import WaveGrid

SIZE = np.array([3.7, 2.9, 2.3])


def furnished(wall: float = 0.1, **changes) -> Scene:
    piece = {"name": "desk", "low": (0, 0, 0), "high": (1.3, 0.7, 0.75)}
    stated = {"size_m": SIZE.tolist(), "furniture": [piece], "name": "r"}
    surfaces = {"all": {"absorption": wall, "scattering": 0.2}}
    return Scene.from_room(
        RoomSpec.model_validate(stated | {"surfaces": surfaces} | changes)
    ).furnished


def test_cut_cells_hold_the_air_and_the_walls_of_the_room():
    scene = furnished()
    counts = (9, 7, 6)
    cells = cut_cells(scene.geometry.mesh, counts, 10**6)
    spacing = SIZE / counts
    assert cells.volume.sum() * spacing.prod() == pytest.approx(
        scene.geometry.volume, rel=0.01
    )
    for axis, walls in enumerate(zip(cells.walls[::2], cells.walls[1::2], strict=True)):
        face = spacing.prod() / spacing[axis]
        up, down = (part.sum() * face for part in walls)
        assert up == pytest.approx(SIZE.prod() / SIZE[axis])
        assert down == pytest.approx(up)


def turned_room(degrees: float) -> tuple[Scene, np.ndarray]:
    turn = np.radians(degrees)
    about = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    outline = np.array([(0, 0), (3.7, 0), (3.7, 2.9), (0, 2.9)]) @ about.T
    low = outline.min(axis=0)
    return Scene.extruded((outline - low).tolist(), 2.3, 0.02), about


def peak(signal: np.ndarray, rate: float, f: np.ndarray) -> float:
    turn = np.exp(-2j * np.pi * np.outer(f, np.arange(len(signal))) / rate)
    return float(f[np.abs(turn @ (signal * np.hanning(len(signal)))).argmax()])


@pytest.mark.parametrize("degrees", [0, 25])
def test_a_coarse_grid_has_the_first_mode_wherever_its_walls_lie(degrees):
    scene, about = turned_room(degrees)
    grid = WaveGrid(scene, 100.0, 7.0)
    center = scene.geometry.center
    ends = [
        center + np.append(about @ np.array(away), 0.0)
        for away in ((-1.5, 0.0), (1.5, 0.0))
    ]
    heard = grid.responses(ends[0], ends[1][None], 1.0)[0]
    made = peak(heard, grid.sample_rate, np.arange(40.0, 54.0, 0.1))
    # cells that are air or not would make stairs of turned walls: 11 % too low
    assert made == pytest.approx(scene.speed_of_sound / 2 / 3.7, rel=0.03)


def test_sound_keeps_its_level_and_time_with_few_cells_per_wave():
    # free field before the walls answer: gain and turns make up for the cells
    from rir import GainPattern
    from rooms.multipoles import Moments, transfer

    scene = Scene.shoebox((14, 14, 14), absorption=0.5)
    f = np.arange(45.0, 75.0)
    grid, omni = WaveGrid(scene, 75.0, 7.0), GainPattern.omni()
    still = np.array([[0.0, 0, 0, 1]])
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(6):
        way = rng.standard_normal(3)
        ear = 7 + 2.4 * way / np.linalg.norm(way)
        ends = np.full(3, 7.0) + rng.random(3), ear
        moments = Moments.of(omni, still, f), Moments.of(omni, still, f)
        made = transfer(grid, (ends[0], ends[1][None]), moments, f, 0.033)[0]
        d = np.linalg.norm(ends[1] - ends[0])
        exact = np.exp(-2j * np.pi * f * d / scene.speed_of_sound) / d
        errors.append(np.linalg.norm(made - exact) / np.linalg.norm(exact))
    assert np.sqrt(np.mean(np.square(errors))) < 0.08


def test_a_wall_thinner_than_a_cell_lets_nothing_through():
    # 0.1 m between cells of 0.26 m, wherever among them the wall stands
    for place in (1.5, 1.61, 1.73, 1.85):
        wall = {"name": "wall", "low": (place, 0, 0), "high": (place + 0.1, 2.9, 2.3)}
        scene = furnished(furniture=[wall])
        grid = WaveGrid(scene, 200.0, 6.5)
        assert grid.spacing[0] > 0.25
        heard = grid.responses(
            np.array([place - 0.05, 1.4, 1.1]),
            np.array([[place + 0.15, 1.2, 1.1]]),
            0.1,
        )
        np.testing.assert_array_equal(heard, 0.0)


def test_each_octave_below_the_crossover_has_its_own_walls():
    names = {"sample_rate": 2000, "duration": 0.3, "effects": ["furniture", "modes"]}
    ends = [1.5, 2.1, 1.2], [[2.9, 1.2, 1.0]]
    low, high = 0.3, 0.1
    made = []
    for first in (low, high):
        wall = {"absorption": (first, *[high] * 6), "scattering": 0.2}
        desk = {"name": "desk", "low": (0, 0, 0), "high": (1.3, 0.7, 0.75)}
        spec = RoomSpec.model_validate(
            {
                "name": "r",
                "size_m": SIZE.tolist(),
                "surfaces": {"all": wall},
                "furniture": [desk | wall],
            }
        )
        made.append(simulate(Scene.from_room(spec), *ends, **names).responses[0, 0])
    f = np.fft.rfftfreq(1200, 1 / 2000)
    one, other = (np.fft.rfft(response, 1200) for response in made)
    own = (f > 215) & (f < 300)
    assert np.linalg.norm((one - other)[own]) < 0.02 * np.linalg.norm(other[own])
    below = (f > 90) & (f < 145)
    assert np.linalg.norm(one[below]) < 0.8 * np.linalg.norm(other[below])


def test_modes_are_counted_by_the_decay_of_the_octave_they_lie_in():
    scene = furnished(0.1)
    budget = make_budget(16000, 0.5, None, None)
    t = scene.eyring_t60()
    expected = 2000 * np.sqrt(t[1] / scene.geometry.volume)
    assert crossover_of(scene, budget) == pytest.approx(min(expected, 350.0))
