"""Measure the exact volume renderer against one waveform at every point.

Measured with a part of the rays at the reference size (64 shells, 1600 samples,
batch 4, networks 128 and 512 wide), at two ray counts, and extrapolated along the
line through them to 2050 rays; one thread, process CPU seconds, equal encodings,
all in one run against the naive renderer.

Bar: 2 times naive when exact, 10 times with proposals, 25 times with proposals in
bfloat16.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
import torch

from fields.data import FieldData, prepare
from fields.layers.query import Query
from fields.models import avr
from fields.models.avr import Avr, Config
from fields.render.weighting import omni_weighting
from fields.training.losses import LossWeights, waveform_loss
from fields.training.schedule import step_random
from harness import make_parser, write_results
from rir import Dataset

REFERENCE_RAYS = 2050
BATCH = 4
N_SAMPLES = 1600


@dataclass(frozen=True)
class Variant:
    """One way to make a training step."""

    name: str
    changes: dict[str, Any]
    half: bool = False
    naive: bool = False
    sparing: bool = False
    "item by item, entries made again in the backward pass, as a whole step is"


VARIANTS = (
    Variant("naive", {}, naive=True),
    Variant("exact", {}),
    Variant("exact, sparing memory", {}, sparing=True),
    Variant("proposals 8 of 64", {"proposals": 8, "density": "grid"}),
    Variant("bf16", {}, half=True),
    Variant("bf16 + proposals", {"proposals": 8, "density": "grid"}, half=True),
)


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "renderer_speed")
    parser.add_argument("--rays", type=int, default=96)
    options = parser.parse_args(argv)
    rays = 8 if options.quick else options.rays
    fewer = max(rays // 4, 2)
    torch.set_num_threads(1)
    data = _data()
    query = Query.of(data.emitters, data.listeners)
    found = {}
    for variant in VARIANTS:
        few, many = (_seconds(variant, data, query, n) for n in (fewer, rays))
        slope = (many - few) / (rays - fewer)
        found[variant.name] = many + slope * (REFERENCE_RAYS - rays)
    print(f"{'variant':22s} {'s/step':>9s} {'ratio':>7s}   ({fewer} and {rays} rays)")
    for name, seconds in found.items():
        print(f"{name:22s} {seconds:9.1f} {found['naive'] / seconds:7.1f}")
    result = {"rays": rays, "seconds_a_step": found, "torch": torch.__version__}
    write_results(options.out, result)
    return 0


def _data() -> FieldData:
    rng = np.random.default_rng(0)
    ends = rng.uniform([-2.5, -2, 0.5], [2.5, 2, 2.5], (2, BATCH, 3))
    decay = 10 ** (-3 * np.arange(N_SAMPLES) / 4000)
    responses = rng.standard_normal((BATCH, N_SAMPLES)) * decay
    return prepare(Dataset.from_arrays(responses, *ends, sample_rate=16000))


def _seconds(variant: Variant, data: FieldData, query: Query, rays: int) -> float:
    torch.manual_seed(0)
    settings = {
        "rays": rays,
        "shells": 64,
        "far": 6.0,
        "proposals": 0,
        "density": "network",
        "head": "shell",
        "width": 512,
        "feature_width": 128,
        "octaves": 10,
        "emission": "absolute",
        "direct": False,
    }
    network = Avr(data.frame, Config(**{**settings, **variant.changes}))
    target = torch.tensor(data.responses)
    render: Callable[..., torch.Tensor] = naive if variant.naive else exact
    with patch.object(avr, "LARGE_VALUES", 1 if variant.sparing else avr.LARGE_VALUES):
        _step(network, query[:1], target[:1], render, half=variant.half)
        started = time.process_time()
        _step(network, query, target, render, half=variant.half)
        return time.process_time() - started


def _step(
    network: Avr,
    query: Query,
    target: torch.Tensor,
    render: Callable[..., torch.Tensor],
    *,
    half: bool,
) -> None:
    with torch.autocast("cpu", torch.bfloat16, enabled=half):
        response = render(network, query)
    waveform_loss(response.float(), target, LossWeights()).backward()


def exact(network: Avr, query: Query) -> torch.Tensor:
    """Render as the field does."""
    return network(query, step_random(0, 0))


def naive(network: Avr, query: Query) -> torch.Tensor:
    """Render with a waveform at every point, vectorised as well as that goes."""
    chosen = network.points(query, step_random(0, 0))
    points, features = network.evaluate(query, chosen)
    signals = network.waveform(features)
    gaps = points.positions - query.emitter[:, None, None]
    flight = gaps.norm(dim=-1) * network.samples_a_metre
    times = torch.arange(network.n_samples)
    signals = signals * (times >= flight.round()[..., None])
    weighted = signals * points.weights[..., None]
    # The shift to the listener is a phase at every point, as in the released code.
    spectrum = torch.fft.rfft(weighted, dim=-1)
    bins = torch.arange(spectrum.shape[-1]) / network.n_samples
    turns = -2 * torch.pi * network.delays[:, None] * bins
    shifted = spectrum * torch.polar(torch.ones_like(turns), turns)
    total = torch.fft.irfft(shifted.sum((1, 2)), network.n_samples)
    gain = omni_weighting(query, points.rays).mean()
    return gain * total / len(points.rays)


if __name__ == "__main__":
    raise SystemExit(main())
