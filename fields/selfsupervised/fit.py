"""Training of directional fields, with or without the reciprocity loss."""

from collections.abc import Callable
from functools import partial
from typing import Any

import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.layers.emission import omni_pattern
from fields.pattern import fit_emitter_pattern
from fields.plan import TrainingPlan
from fields.selfsupervised.forms import FORMS, FormContext
from fields.training.directional import DirectionalField
from fields.training.loop import fit_network

__all__ = ["fit_directional"]


def fit_directional(
    network_type: Callable[..., nn.Module],
    data: FieldData,
    config: Any,
    plan: TrainingPlan,
) -> DirectionalField:
    """Train a network whose listener pattern can be exchanged."""
    term = None
    if plan.self_supervised != "none":
        term = partial(FORMS[plan.self_supervised], _setting(data))
    return DirectionalField.of(fit_network(network_type, data, config, plan, term))


def _setting(data: FieldData) -> FormContext:
    frame = data.frame
    box = (
        torch.tensor(frame.low, dtype=torch.float32),
        torch.tensor(frame.high, dtype=torch.float32),
    )
    return FormContext(_pattern(data), box)


def _pattern(data: FieldData) -> Tensor:
    fitted = fit_emitter_pattern(data)
    if fitted is None:
        return omni_pattern()
    return torch.tensor(fitted.pattern.coefficients[0], dtype=torch.float32)
