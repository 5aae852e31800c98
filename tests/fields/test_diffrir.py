# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from fields.data import prepare
from fields.layers.filters import minimum_phase_log
from fields.layers.images import BoxImages
from rir import Dataset, RoomSpec, Surface

SIZE = np.array([5.0, 4.0, 3.0])


@pytest.fixture(scope="module")
def images():
    room = RoomSpec(
        name="box", size_m=tuple(SIZE), surfaces={"all": Surface(absorption=(0.2,) * 7)}
    )
    dataset = Dataset.from_arrays(
        np.ones((1, 64)),
        np.array([[1.0, 1.5, 1.2]]),
        np.array([[3.5, 2.0, 1.6]]),
        sample_rate=16000,
        room=room,
    )
    return BoxImages(prepare(dataset).frame, order=2, axial_order=4)


EMITTER = torch.tensor([[1.0, 1.5, 1.2]])
LISTENER = torch.tensor([[3.5, 2.0, 1.6]])


def test_first_reflections_have_their_closed_form_length(images):
    paths = images(EMITTER, LISTENER)
    first = images.counts.sum(-1) == 1
    direct = (EMITTER - LISTENER).norm()
    expected = []
    for axis in range(3):
        for wall in (0.0, float(SIZE[axis])):
            gaps = (EMITTER[0, axis] - wall) * (LISTENER[0, axis] - wall)
            expected.append(float((direct**2 + 4 * gaps).sqrt()))
    assert int(first.sum()) == 6
    assert_allclose(sorted(paths.distances[0, first]), sorted(expected), rtol=1e-6)


def test_paths_are_the_same_both_ways(images):
    there, back = images(EMITTER, LISTENER), images(LISTENER, EMITTER)
    assert_allclose(np.sort(there.distances[0]), np.sort(back.distances[0]), rtol=1e-5)


def test_floor_reflection_leaves_downward_and_arrives_from_below(images):
    paths = images(EMITTER, LISTENER)
    floor = (images.counts[:, 4] == 1) & (images.counts.sum(-1) == 1)
    assert paths.departures[0, floor, 2] < 0
    assert paths.arrivals[0, floor, 2] < 0


def test_minimum_phase_of_a_one_pole_filter():
    # 1 / (1 - 0.5 z^-1) is minimum phase: magnitude alone gives it back.
    turns = torch.arange(513) / 1024
    exact = 1 / (1 - 0.5 * torch.exp(-2j * torch.pi * turns))
    found = torch.exp(minimum_phase_log(exact.abs().log()))
    assert_allclose(found.numpy(), exact.numpy(), atol=1e-5)
