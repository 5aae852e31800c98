# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false
# pyright: reportCallIssue=false
"""Every neural model trains soundly: gradients, resume, guards."""

from dataclasses import replace

import pytest
import torch
from numpy.testing import assert_array_equal

from fields import FIELDS
from fields.data import prepare
from fields.plan import TrainingPlan
from rir import GainPattern
from rir.errors import TrainingError

NEURAL = [name for name, kind in FIELDS.items() if kind.neural]


@pytest.fixture(scope="module")
def data(grid):
    return prepare(grid)


@pytest.fixture(params=NEURAL)
def module(request):
    return FIELDS[request.param].load_module()


def test_resumed_training_is_bit_identical(module, data, tmp_path):
    plan = TrainingPlan(steps=4, exchange="flip", seed=1, batch_size=8)
    whole = module.fit(data, module.Config(), plan)
    half = replace(plan, out=tmp_path, steps=4, budget_s=None)
    interrupted = _Interrupt(2)
    with pytest.raises(KeyboardInterrupt):
        module.fit(
            data,
            module.Config(),
            replace(half, on_progress=interrupted, checkpoint_s=-1.0),
        )
    resumed = module.fit(data, module.Config(), replace(half, resume=True))
    for name, value in whole.network.state_dict().items():
        assert torch.equal(value, resumed.network.state_dict()[name]), name


class _Interrupt:
    """Raise in the middle of a step that follows a saved one."""

    def __init__(self, step):
        self.step = step

    def __call__(self, progress):
        if progress.step > self.step:
            raise KeyboardInterrupt


def test_every_weight_gets_a_finite_gradient(module, data):
    field = module.fit(
        data, module.Config(), TrainingPlan(steps=2, batch_size=8, exchange="double")
    )
    assert field.report["skipped_steps"] == 0
    assert field.report["mended_steps"] == 0
    for name, weight in field.network.named_parameters():
        assert weight.grad is not None, name
        assert torch.isfinite(weight.grad).all(), name


def test_checkpoint_of_another_size_is_refused(data, tmp_path):
    module = FIELDS["inras"].load_module()
    plan = TrainingPlan(steps=1, out=tmp_path, batch_size=8)
    module.fit(data, module.Config(width=8), plan)
    with pytest.raises(TrainingError, match="another model or another size"):
        module.fit(data, module.Config(width=16), replace(plan, resume=True))


def test_tied_inras_is_exactly_reciprocal(data):
    module = FIELDS["inras"].load_module()
    config = module.Config(tied=True, width=16)
    field = module.fit(data, config, TrainingPlan(steps=3, batch_size=8))
    assert_array_equal(
        field.predict(data.emitters, data.listeners),
        field.predict(data.listeners, data.emitters),
    )


@pytest.mark.parametrize(
    ("gains", "config", "tied"),
    [
        ((GainPattern.omni(), GainPattern.omni()), {}, True),
        ((GainPattern.cardioid(), GainPattern.omni()), {}, False),
        ((None, None), {}, False),
        ((GainPattern.omni(), GainPattern.omni()), {"relative": False}, False),
        ((GainPattern.cardioid(), GainPattern.omni()), {"tied": True}, True),
    ],
)
def test_inras_ties_its_towers_where_patterns_are_known_to_be_equal(
    data, gains, config, tied
):
    module = FIELDS["inras"].load_module()
    emitting, listening = gains
    frame = replace(data.frame, emitter_gain=emitting, listener_gain=listening)
    network = module.Inras(frame, module.Config(width=8, **config))
    assert (network.emitter_tower is network.listener_tower) is tied


def test_missing_cuda_is_said(data):
    if torch.cuda.is_available():
        pytest.skip("this machine has CUDA")
    module = FIELDS["inras"].load_module()
    with pytest.raises(TrainingError, match="use --device cpu"):
        module.fit(data, module.Config(), TrainingPlan(device="cuda"))
