"""The forms of the reciprocity loss; docs/studies/self-supervision.md compares them.

F(a -> b; axes, gain) is the field's response of the directional emitter at a,
turned to ``axes``, heard at b through ``gain``; G is the emitter's pattern.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from fields.layers.query import Query
from fields.render.weighting import pattern_weighting
from fields.selfsupervised.poses import moved, random_axes
from fields.training.losses import LossWeights, waveform_loss
from rir.registry import Registry

__all__ = ["FORMS", "FormContext"]

WEIGHT = 0.8  # of the loss beside the measured one; both directions count nearly alike
LARGEST_NOISE_M = 0.3  # of places, as in the paper
STAGE_TWO = 0.5  # part of the training before it, as in the paper's two stages
TEMPERATURE = 0.1  # of the contrast: the usual one of SimCLR, Chen et al., 2020
LEAST_MEAN = 0.05  # of a pattern: dividing by less would raise noise by 26 dB
LOSS = LossWeights()


@dataclass(frozen=True, eq=False)
class FormContext:
    """What a form knows beside the batch."""

    pattern: Tensor
    """Emitter pattern fitted to the responses, harmonics, device frame."""
    box: tuple[Tensor, Tensor]
    """Corners of the scene, metres."""


Form = Callable[[FormContext, Any, Query, Tensor, float, torch.Generator], Tensor]
FORMS: Registry[Form] = Registry("self-supervised form")


@FORMS.add("pattern")
def pattern_exchange(
    setting: FormContext,
    network: Any,
    query: Query,
    target: Tensor,
    fraction: float,  # noqa: ARG001
    random: torch.Generator,
) -> Tensor:
    """Exchange the ends with the right pattern, against the measured response.

    A measured response (emitter pattern G at e, omni at l) is by reciprocity
    that of an omni source at l heard at e through G; an omni source is the mean
    of the emitter turned to o and to -o, over the pattern's mean. The target is
    measured, so nothing can shrink and no teacher is needed. A network that is
    linear in the emitter's pattern is given the omni source itself.
    """
    hears = pattern_weighting(setting.pattern)
    if network.takes_source:
        omni = torch.zeros_like(setting.pattern)
        omni[0] = (4 * torch.pi) ** 0.5
        back = query.swapped()
        return WEIGHT * waveform_loss(network(back, random, hears, omni), target, LOSS)
    mean_gain = setting.pattern[0] / (4 * torch.pi) ** 0.5
    if abs(float(mean_gain)) < LEAST_MEAN:
        # No turning of such an emitter adds up to an omni source.
        return target.new_zeros(())
    axes = random_axes(len(query), random).to(query.emitter.device)
    # Turning half about the up axis reverses forward and left.
    opposite = axes * torch.tensor([-1.0, -1.0, 1.0], device=axes.device)
    total = torch.zeros_like(target)
    for turned in (axes, opposite):
        back = Query(query.listener, turned, query.emitter, query.emitter_axes)
        total = total + network(back, random, hears)
    return WEIGHT * waveform_loss(total / (2 * mean_gain), target, LOSS)


@FORMS.add("teacher")
def taught_by_seen_side(
    setting: FormContext,
    network: Any,
    query: Query,
    target: Tensor,  # noqa: ARG001
    fraction: float,
    random: torch.Generator,
) -> Tensor:
    """Let the side whose emitter was measured teach the other; no gradient to it."""
    if fraction < STAGE_TWO:
        return query.emitter.new_zeros(())
    seen, back, hears = _both_ways(
        setting.pattern, setting, query, fraction, random, both=False
    )
    with torch.no_grad():
        teacher = network(seen, random, hears)
    return WEIGHT * waveform_loss(network(back, random, hears), teacher, LOSS)


@FORMS.add("paper")
def consistent_both_sides(
    setting: FormContext,
    network: Any,
    query: Query,
    target: Tensor,  # noqa: ARG001
    fraction: float,
    random: torch.Generator,
) -> Tensor:
    """Make both directions agree, the pattern read from the network itself.

    Two stages: nothing in the first half; then the pattern is read at the
    emitters' own places, put on the listener, and both predictions pull on each
    other while position noise grows to 0.3 m.
    """
    if fraction < STAGE_TWO:
        return query.emitter.new_zeros(())
    pattern = network.read_pattern(query)
    seen, back, hears = _both_ways(pattern, setting, query, fraction, random, both=True)
    first, second = network(seen, random, hears), network(back, random, hears)
    return WEIGHT * waveform_loss(second, first, LOSS)


@FORMS.add("contrastive")
def told_apart(
    setting: FormContext,  # noqa: ARG001
    network: Any,
    query: Query,
    target: Tensor,  # noqa: ARG001
    fraction: float,  # noqa: ARG001
    random: torch.Generator,
) -> Tensor:
    """Pull a response towards its swap and away from the others of the batch.

    The baseline of the paper's ablation: the same idea without patterns.
    """
    first = _embedded(network(query, random))
    second = _embedded(network(query.swapped(), random))
    likeness = first @ second.T / TEMPERATURE
    own = torch.arange(len(query), device=likeness.device)
    return 0.1 * torch.nn.functional.cross_entropy(likeness, own)


def _embedded(responses: Tensor) -> Tensor:
    spectrum = torch.fft.rfft(responses)
    size = (spectrum.real.square() + spectrum.imag.square() + 1e-8).log()
    return torch.nn.functional.normalize(size - size.mean(-1, keepdim=True), dim=-1)


def _both_ways(
    pattern: Tensor,
    setting: FormContext,
    query: Query,
    fraction: float,
    random: torch.Generator,
    *,
    both: bool,
) -> tuple[Query, Query, Any]:
    """Return the query, its swap, and the pattern both are heard through.

    The listener becomes the same device as the emitter, turned at random.
    """
    stage = (fraction - STAGE_TWO) / (1 - STAGE_TWO)
    noisy = moved(query, LARGEST_NOISE_M * stage, setting.box, random, both=both)
    turned = random_axes(len(query), random).to(query.emitter.device)
    seen = Query(noisy.emitter, noisy.emitter_axes, noisy.listener, turned)
    return seen, seen.swapped(), pattern_weighting(pattern)
