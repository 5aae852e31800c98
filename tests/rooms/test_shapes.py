"""What effects may ask of any shape: a box and its mesh answer alike."""

import numpy as np
import pytest

from rooms.geometry import Geometry, Shoebox
from rooms.mesh import MeshGeometry
from rooms.mesh.crossings import find_crossings

SIZE = np.array([5.0, 4.0, 3.0])
EMITTER = np.array([1.0, 1.1, 1.2])
LISTENERS = np.array([[4.0, 2.9, 1.7], [2.0, 3.0, 0.4]])


@pytest.fixture(params=["box", "mesh"])
def shape(request) -> Geometry:
    return Shoebox(SIZE) if request.param == "box" else MeshGeometry.box(SIZE)


def test_a_box_is_convex_closed_and_in_full_sight(shape):
    assert shape.convex
    assert shape.watertight
    assert shape.mesh.visible(EMITTER, LISTENERS).all()
    assert not find_crossings(shape.mesh, EMITTER, LISTENERS).any()
    assert shape.volume == pytest.approx(60.0)
    np.testing.assert_allclose(shape.areas, [12, 12, 15, 15, 20, 20])


def test_each_wall_of_a_box_faces_its_own_way(shape):
    np.testing.assert_array_equal(shape.facing(), np.eye(6))


def test_only_a_box_has_a_lattice_of_images():
    assert Shoebox(SIZE).lattice
    assert not MeshGeometry.box(SIZE).lattice
    assert Shoebox(SIZE).mesh.surfaces == Shoebox(SIZE).surfaces
