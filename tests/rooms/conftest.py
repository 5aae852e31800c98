"""Spectra and screens, shared by the tests of this folder."""

import numpy as np
import pytest

from rooms.mesh import MeshGeometry


@pytest.fixture
def faded_spectrum():
    """Return the spectrum at some frequencies of samples that are faded out."""

    def spectrum(samples, rate, frequencies):
        n = np.arange(len(samples))
        fade = np.cos(np.pi / 2 * n / len(n)) ** 2
        turns = np.outer(n / rate, frequencies)
        return (samples * fade) @ np.exp(-2j * np.pi * turns)

    return spectrum


@pytest.fixture
def screened_box():
    """Return a box of 6 x 5 x 3 m with a thin screen across it, of a given width."""

    def build(width):
        box = MeshGeometry.box((6, 5, 3))
        screen = np.array([[3, 0, 0], [3, width, 0], [3, width, 3], [3, 0, 3]])
        vertices = np.concatenate([box.vertices + box.origin, screen])
        faces = np.concatenate([box.faces, [[8, 9, 10], [8, 10, 11]]])
        return MeshGeometry.from_arrays(vertices, faces)

    return build
