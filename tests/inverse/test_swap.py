"""Exchanging the ends with their patterns changes rounding only, in every room."""

from dataclasses import replace

import numpy as np
import pytest

from inverse.bands.banded_room import BandedRoom
from inverse.bands.fitted_bands import FittedBandedRoom
from inverse.bands.half_octaves import HalfOctaves
from inverse.bands.scatterers import Scatterers
from inverse.paths.bank import ideal_bank
from inverse.paths.coloring import Coloring
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.room import BoxRoom
from inverse.paths.shoebox import FittedRoom
from rir import Poses

RATE, SPEED, N = 16000, 343.2, 640
WALLS = np.array([0.9, 0.8, 0.85, 0.8, 0.7, 0.85])
OUTLINE = ((0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (3.1, 2.0), (3.1, 4.0), (0.0, 4.0))


def drawn_ends(seed=1, count=12):
    """Return ends in the lower half of the rooms, turned at random."""
    rng = np.random.default_rng(seed)
    turns = rng.standard_normal((2, count, 4))
    turns /= np.linalg.norm(turns, axis=2, keepdims=True)
    places = rng.uniform([0.4, 0.4, 0.4], [4.6, 1.7, 2.4], (2, count, 3))
    return Poses(places[0], turns[0]), Poses(places[1], turns[1])


def patterns(order, seed):
    rng = np.random.default_rng(seed)
    return np.concatenate([[3.5], 0.6 * rng.standard_normal((order + 1) ** 2 - 1)])


def slow_part():
    factors = Coloring.none(RATE).factors
    return Coloring(np.where(np.arange(len(factors)) == 2, -0.05, factors), RATE)


def box_room():
    middle = np.array([2.5, 2.0, 1.4])
    box = OrientedBox(np.eye(3), middle, -middle, middle, np.ones(6)).turned(
        np.full(3, 0.01)
    )
    box = replace(box, low=box.low - 0.2, high=box.high + 0.2)
    devices = patterns(4, 2), patterns(2, 3)
    return BoxRoom(box, SPEED, 1e-3, WALLS, *devices, ideal_bank(36), RATE, 8, 13.0)


def plain_box():
    room = box_room()
    return FittedRoom(room, slow_part(), np.eye(31), np.ones(31, dtype=bool))


def flat_faces():
    from rooms.mesh import MeshGeometry

    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 2.8))
    walls = np.linspace(0.7, 0.9, len(shape.planes)).astype(np.float64)
    devices = patterns(4, 2), patterns(2, 3)
    room = MeshRoom(shape, SPEED, 1e-3, walls, *devices, ideal_bank(36), RATE, 3, 13.0)
    return FittedMesh(room, slow_part(), np.full(8, 1e-3), bending=True)


def half_octaves(scattering):
    rng, room = np.random.default_rng(4), box_room()
    grid = HalfOctaves(RATE, N)
    walls = 0.2 + 0.2 * rng.random((grid.bands, 6)) + 0.1j * rng.random((grid.bands, 6))
    things = None
    if scattering:
        things = scatterers(grid.bands, rng)
    banded = BandedRoom(
        room,
        grid,
        walls,
        True,
        np.full(grid.bands, 1e-3),
        rng.random(grid.bands),
        np.array([patterns(4, 5 + band) for band in range(grid.bands)]),
        np.array([patterns(2, 50 + band) for band in range(grid.bands)]),
        np.exp(-1j * np.arange(len(grid.hertz)) * 0.01),
        things,
    )
    plain = plain_box()
    return FittedBandedRoom(
        room, plain.coloring, plain.covariance, plain.active, banded
    )


def scatterers(bands, rng):
    gains = 0.2 * (rng.random((bands, 2)) + 1j * rng.random((bands, 2)))
    return Scatterers(np.array([[1.0, 1.5, 1.0], [3.0, 1.2, 0.7]]), gains)


def exchanged(fitted):
    """Return the room with its devices at the other ends."""
    room = fitted.room
    back = replace(room, emitting=room.listening, listening=room.emitting)
    if not isinstance(fitted, FittedBandedRoom):
        return replace(fitted, room=back)
    band = fitted.banded
    other = replace(band, room=back, emitting=band.listening, listening=band.emitting)
    return replace(fitted, room=back, banded=other)


@pytest.mark.parametrize(
    "fitted",
    [plain_box(), flat_faces(), half_octaves(False), half_octaves(True)],
    ids=["box", "mesh", "half octaves", "half octaves with objects"],
)
def test_exchanged_ends_and_devices_hear_the_same(fitted):
    first, second = drawn_ends()
    there = fitted.predict(first, second, N)
    back = exchanged(fitted).predict(second, first, N)
    unlike = fitted.predict(second, first, N)
    size = np.abs(there).max()
    np.testing.assert_allclose(back, there, rtol=0, atol=1e-12 * size)
    assert np.abs(unlike - there).max() > 0.01 * size
