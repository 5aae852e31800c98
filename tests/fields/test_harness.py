# pyright: reportAttributeAccessIssue=false
# ruff: noqa: ARG002, ARG005
import math
from dataclasses import replace

import pytest
import torch
from numpy.testing import assert_allclose, assert_array_equal

from fields.commands.train import parse_seconds
from fields.data import prepare
from fields.plan import TrainingPlan
from fields.run import train_on
from fields.training.guards import Guards
from fields.training.loop import Trainer
from fields.training.losses import LossWeights, waveform_loss
from fields.training.schedule import batch_rows, cosine, step_random
from fields.watching import watcher
from rir.errors import ConfigError


class Constant(torch.nn.Module):
    """One learned number for every sample, with a loss to order."""

    name = "constant"
    batch_size = 4

    def __init__(self, broken=lambda step: False):
        super().__init__()
        self.value = torch.nn.Parameter(torch.zeros(()))
        self.broken = broken
        self.step = 0

    def observe(self, data):
        pass

    def training_loss(self, query, target, random):
        self.step += 1
        loss = (self.value - target.mean()).square()
        return loss * float("nan") if self.broken(self.step) else loss

    def render(self, query):
        return self.value.expand(len(query), 1)


def test_each_row_comes_once_an_epoch():
    epoch = torch.cat([batch_rows(12, 4, seed=3, step=step) for step in range(3)])
    assert sorted(epoch.tolist()) == list(range(12))
    later = torch.cat([batch_rows(12, 4, seed=3, step=step) for step in range(3, 6)])
    assert epoch.tolist() != later.tolist()


def test_steps_have_their_own_randomness():
    first, again, other = (
        torch.rand(4, generator=step_random(1, step)) for step in (7, 7, 8)
    )
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


def test_cosine_is_half_way_in_the_middle():
    assert_allclose(cosine(1e-3, 1e-4, 0.5), 5.5e-4)


def test_budget_ends_the_training(grid):
    seconds = iter(range(1000))
    trainer = Trainer(
        Constant(),
        prepare(grid),
        TrainingPlan(steps=10**6, budget_s=20.0),
        clock=lambda: float(next(seconds)),
    )
    assert trainer.run()["steps"] == 20


def test_steps_with_a_broken_loss_are_skipped_and_counted(grid):
    network = Constant(broken=lambda step: step % 3 == 0)
    report = Trainer(network, prepare(grid), TrainingPlan(steps=9)).run()
    assert report["skipped_steps"] == 3
    assert math.isfinite(network.value.item())


def test_broken_gradient_entries_are_zeroed_and_counted():
    weight = torch.nn.Parameter(torch.zeros(2))
    weight.grad = torch.tensor([float("inf"), 3.0])
    guards = Guards()
    guards.mend([weight], largest_norm=1.0)
    assert_allclose(weight.grad.numpy(), [0.0, 1.0], rtol=1e-5)
    assert guards.mended_steps == guards.clipped_steps == 1


ALL_TERMS = LossWeights(10.0, 1.0, 1.0, 1.0, 1.0, 1.0)


def test_loss_of_the_truth_is_zero():
    target = torch.randn(3, 256, generator=step_random(0, 0))
    assert_allclose(float(waveform_loss(target, target, ALL_TERMS)), 0.0, atol=1e-6)


@pytest.mark.parametrize("scale", [0.0, 1e-12, 1.0, 1e6])
@pytest.mark.parametrize("length", [1, 7, 320])
def test_loss_and_gradient_are_finite(scale, length):
    target = scale * torch.randn(2, length, generator=step_random(0, 1))
    prediction = torch.zeros(2, length, requires_grad=True)
    loss = waveform_loss(prediction, target, ALL_TERMS)
    loss.backward()
    assert torch.isfinite(loss)
    assert prediction.grad is not None
    assert torch.isfinite(prediction.grad).all()


@pytest.mark.parametrize("text", ["", "soon", "-3s", "0s", "5 days"])
def test_budgets_that_are_no_time_are_refused(text):
    with pytest.raises(ConfigError, match="is not a time; write 60s, 2m or 1h"):
        parse_seconds(text)


def test_watching_is_a_curve_and_changes_no_weight(grid):
    plan = TrainingPlan(steps=20, batch_size=4, seed=1)
    data = prepare(grid)
    told = []
    watched = replace(plan, watch=watcher(data, rows=5), on_progress=told.append)
    sizes = {"width": 8, "depth": 1}
    field = train_on(data, "inras", sizes, watched)
    plain = train_on(data, "inras", sizes, plan)
    steps = [row["step"] for row in field.report["curve"]]
    assert steps == [2, 3, 5, 8, 11, 16]
    assert [now.step for now in told if now.scores is not None] == steps
    assert_array_equal(
        field.predict(grid.emitters, grid.listeners),
        plain.predict(grid.emitters, grid.listeners),
    )


def test_unknown_choices_of_a_plan_are_told():
    with pytest.raises(ConfigError, match="precision 'half'; known: float32"):
        TrainingPlan(precision="half")
