# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false, reportArgumentType=false
import importlib.util
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from fields.data import prepare
from fields.layers.hash_grid import HashGrid
from fields.layers.query import Query
from fields.models import avr
from fields.models.avr import Avr, Config
from fields.plan import TrainingPlan
from fields.render.bank import bank_sum
from fields.render.compositing import compositing_weights, drawn_shells
from fields.render.projection import causal_projection, causal_projection_plain
from fields.render.rays import Shells, even_directions, random_rotation
from fields.render.weighting import omni_weighting, pattern_weighting
from fields.training.schedule import step_random

_SPEC = importlib.util.spec_from_file_location(
    "naive_avr", Path(__file__).with_name("naive_avr.py")
)
naive_avr = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(naive_avr)

SMALL = {
    "rays": 8,
    "shells": 5,
    "head": "shell",
    "width": 16,
    "feature_width": 8,
    "direct": False,
    "octaves": 3,
}


@pytest.fixture(scope="module")
def data(grid):
    return prepare(grid)


@pytest.fixture(scope="module")
def query(data):
    return Query.of(data.emitters[10:12], data.listeners[10:12])


def built(data, **changes):
    torch.manual_seed(3)
    network = Avr(data.frame, Config(**{**SMALL, **changes}))
    with torch.no_grad():
        for weight in network.parameters():
            weight.add_(0.05 * torch.randn_like(weight))
    return network


def cardioid():
    coefficients = torch.zeros(4)
    coefficients[0] = 0.5 * (4 * np.pi) ** 0.5
    coefficients[3] = 0.5 * (4 * np.pi / 3) ** 0.5
    return pattern_weighting(coefficients)


@pytest.mark.parametrize("density", ["network", "grid"])
@pytest.mark.parametrize("emission", ["absolute", "local", "absolute-pattern"])
@pytest.mark.parametrize("proposals", [0, 3])
@pytest.mark.parametrize("weighting", [omni_weighting, cardioid()])
def test_fast_renderer_equals_the_naive_one(
    data, query, density, emission, proposals, weighting
):
    if density == "network":
        proposals = 0
    network = built(data, density=density, emission=emission, proposals=proposals)
    points = network.points(query, step_random(0, 0))
    answers, slopes = [], []
    for render in ("naive", "fast"):
        network.zero_grad()
        if render == "naive":
            response = naive_avr.naive_render(network, query, points, weighting)
        else:
            chosen = network.points(query, step_random(0, 0))
            answer = network.evaluate(query, chosen)
            response = network.gather(query, *answer, weighting)
        response.square().sum().backward()
        answers.append(response.detach().numpy())
        # The points' own weights were made outside the naive renderer's graph.
        names = [n for n, _ in network.named_parameters() if n != "density_grid"]
        slopes.append({n: network.get_parameter(n).grad.numpy().copy() for n in names})
        points = network.points(query, step_random(0, 0))
    scale = np.abs(answers[0]).max()
    assert scale > 0
    assert_allclose(answers[1], answers[0], atol=1e-4 * scale)
    for name, slope in slopes[0].items():
        largest = np.abs(slope).max()
        assert_allclose(slopes[1][name], slope, atol=1e-3 * largest, err_msg=name)


@pytest.mark.parametrize("head", ["shell", "bank"])
@pytest.mark.parametrize("density", ["network", "grid"])
def test_large_batches_in_parts_change_nothing(data, query, density, head, monkeypatch):
    network = built(data, density=density, head=head, channels=4)
    found = []
    for most in (avr.LARGE_VALUES, 1):
        monkeypatch.setattr(avr, "LARGE_VALUES", most)
        network.zero_grad()
        response = network(query, step_random(0, 0))
        response.square().sum().backward()
        slopes = [weight.grad.clone() for weight in network.parameters()]
        found.append([response.detach(), *slopes])
    for whole, parts in zip(*found, strict=True):
        assert_allclose(parts, whole, atol=1e-5 * float(whole.abs().max()))


@pytest.mark.parametrize("first", [0, 1, 39, 40, 79])
def test_masks_hold_at_their_edges(first):
    random = step_random(1, first)
    features = torch.randn(5, 6, generator=random, requires_grad=True)
    weights = torch.rand(5, generator=random).requires_grad_()
    matrix = torch.randn(80, 6, generator=random, requires_grad=True)
    bias = torch.randn(80, generator=random, requires_grad=True)
    shells = torch.tensor([0, 1, 2, 2, 3])
    arrivals = torch.full((5,), first)
    # The last shell's sound arrives after the end, one shell's on the last sample.
    delays = torch.tensor([0, 40, 79 - first, 80])
    found = []
    for sums in (causal_projection, causal_projection_plain):
        response = sums(features, weights, shells, arrivals, delays, matrix, bias)
        slopes = torch.autograd.grad(
            response.square().sum(), [features, weights, matrix, bias]
        )
        found.append([response, *slopes])
    for fast, plain in zip(*found, strict=True):
        tolerance = 1e-4 * float(plain.detach().abs().max()) + 1e-7
        assert_allclose(fast.detach(), plain.detach(), atol=tolerance)
    response = found[0][0].detach()
    assert_allclose(response[:first], 0.0)


def test_nothing_sounds_before_the_direct_path_allows(data):
    network = built(data, head="bank", channels=4)
    query = Query.of(data.emitters, data.listeners)
    response = network.render(query).detach().numpy()
    delay = (query.distance * network.samples_a_metre).numpy()
    for row, first in zip(response, delay, strict=True):
        assert_allclose(row[: int(first)], 0.0, atol=1e-5 * np.abs(row).max())


def test_weights_of_an_opaque_ray_sum_to_one():
    density = 50.0 * torch.rand(3, 40, generator=step_random(0, 0))
    weights = compositing_weights(density, torch.full((40,), 0.5))
    assert_allclose(weights.sum(-1), 1.0, rtol=1e-5)


def test_no_density_gives_no_weight():
    weights = compositing_weights(torch.zeros(8), torch.ones(8))
    assert_allclose(weights, 0.0)


def test_drawn_shells_are_unbiased():
    random = step_random(2, 0)
    weights = torch.rand(1, 16, generator=random).expand(4000, -1)
    values = torch.arange(16.0)
    index, drawn = drawn_shells(weights, 4, random)
    mean = (drawn * values[index]).sum(-1).mean()
    assert_allclose(mean, (weights[0] * values).sum(), rtol=0.02)


def test_shells_lie_on_whole_samples():
    shells = Shells.spread(9, far=2.0, samples_a_metre=40.0)
    assert_allclose(shells.radii * 40.0, shells.delays)
    assert_allclose(shells.delays[-1], 80)


def test_directions_are_a_good_quadrature():
    directions = even_directions(400).numpy()
    assert_allclose(directions.mean(axis=0), 0.0, atol=1e-2)
    moment = directions.T @ directions / 400
    assert_allclose(moment, np.eye(3) / 3, atol=1e-2)


def test_rotations_are_rotations():
    rotation = random_rotation(step_random(0, 5))
    assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
    assert_allclose(torch.linalg.det(rotation), 1.0, rtol=1e-6)


def test_bank_puts_a_point_at_its_delay():
    bank = torch.zeros(1, 32)
    bank[0, 0] = 1.0
    features, weights = torch.ones(1, 1, 1), torch.full((1, 1), 2.0)
    response = bank_sum(features, weights, torch.tensor([[10.25]]), bank)
    expected = np.zeros(32)
    expected[10], expected[11] = 1.5, 0.5
    assert_allclose(response[0], expected, atol=1e-6)


def test_compiled_hash_grid_equals_the_plain_one():
    grid = HashGrid(levels=5, table_bits=8)
    places = 2 * torch.rand(50, 3, generator=step_random(4, 4)) - 1
    fast = grid(places)
    fast.square().sum().backward()
    slope = grid.table.grad.clone()
    grid.zero_grad()
    plain = grid.plain((places + 1) / 2)
    plain.square().sum().backward()
    assert_allclose(fast.detach(), plain.detach(), atol=1e-6)
    assert_allclose(slope, grid.table.grad, atol=1e-6)


@pytest.mark.parametrize("emission", ["pattern", "absolute-pattern"])
def test_response_is_linear_in_the_emitter_pattern(data, query, emission):
    network = built(data, emission=emission, direct=True)
    patterns = torch.randn(2, 25)
    heard = [network(query, None, source=one) for one in patterns]
    both = network(query, None, source=2 * patterns[0] - patterns[1])
    expected = 2 * heard[0] - heard[1]
    torch.testing.assert_close(both, expected, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("asked", "plan", "emission"),
    [
        ("auto", {}, "pattern"),
        ("auto", {"exchange": "double"}, "absolute-pattern"),
        ("auto", {"exchange": "flip"}, "absolute-pattern"),
        ("auto", {"self_supervised": "pattern"}, "pattern"),
        ("pattern", {"exchange": "double"}, "pattern"),
    ],
)
def test_exchange_chooses_what_points_know_of_the_emitter(
    data, tmp_path, asked, plan, emission
):
    config = Config(**{**SMALL, "emission": asked})
    field = avr.fit(data, config, TrainingPlan(steps=1, batch_size=4, **plan))
    # What was chosen is stored, not the word auto: another default breaks no file.
    assert field.config.emission == emission
    again = avr.load(field.save(tmp_path / "field"))
    assert again.config.emission == emission
    assert again.network.absolute is emission.startswith("absolute")
