"""DiffRIR: traced reflections with learned walls, directivity and source.

Paths are mirror images of the room's six walls (up to three reflections, more
between opposite walls), so the field is reciprocal by construction apart from
the devices' patterns.
"""

from pathlib import Path

import numpy as np
import torch
from pydantic import NonNegativeInt
from torch import Tensor, nn

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.layers.direct import ORDER, local_direction
from fields.layers.filters import band_matrix, minimum_phase_log
from fields.layers.harmonics import harmonics
from fields.layers.images import BoxImages
from fields.layers.query import Query
from fields.plan import TrainingPlan
from fields.render.rays import even_directions
from fields.render.weighting import RayWeighting, omni_weighting
from fields.selfsupervised.fit import fit_directional
from fields.settings import Count, settings
from fields.training.directional import DirectionalField
from fields.training.losses import multiscale_log_loss
from fields.training.network import load_network

__all__ = ["PRESETS", "Config", "DiffRir", "fit", "load"]

BANDS_HZ = 31.25 * 2.0 ** np.arange(10)
SHARPNESS = 8.0  # of the kernel between directions: half its weight within 24 degrees
KNOTS = 34  # of the blend over time, geometric: about three an octave of 2,000 samples
PACE = 10.0  # walls and blend move ten times as fast as the weights beside them


@settings
class Config:
    """Sizes of the traced field."""

    order: NonNegativeInt = 3
    "most reflections of any path"
    axial_order: NonNegativeInt = 10
    "most reflections between two opposite walls"
    directions: Count = 128
    "directions of the learned directivity"
    source_taps: Count = 255
    "length of the learned source response, samples (original: 1023)"


PRESETS = {"cpu": Config(), "paper": Config(source_taps=1023)}


class DiffRir(nn.Module):
    """Sum filtered reflections and a learned late part."""

    name = "diffrir"
    batch_size = 4
    takes_source = False

    def __init__(self, frame: SceneFrame, config: Config) -> None:
        super().__init__()
        self.n_samples = frame.n_samples
        self.length = 2 * max(frame.n_samples, 8)
        self.samples_a_metre = frame.sample_rate / frame.speed_of_sound
        self.images = BoxImages(frame, config.order, config.axial_order)
        bands = band_matrix(BANDS_HZ, frame.sample_rate, self.length)
        self.register_buffer("bands", bands, persistent=False)
        directions = even_directions(config.directions)
        self.register_buffer("directions", directions, persistent=False)
        times = torch.arange(frame.n_samples) / frame.sample_rate
        self.register_buffer("times", times, persistent=False)
        self.register_buffer("knots", _knot_matrix(frame.n_samples), persistent=False)
        self.walls = nn.Parameter(torch.full((6, 10), 1.0 / PACE))
        self.directivity = nn.Parameter(torch.zeros(config.directions, 10))
        impulse = torch.zeros(min(config.source_taps, frame.n_samples))
        impulse[0] = 1.0
        self.source = nn.Parameter(impulse)
        self.decay = nn.Parameter(torch.tensor(5.0))
        self.late = nn.Parameter(1e-3 * torch.randn(frame.n_samples))
        self.blend = nn.Parameter(torch.linspace(-5.0, 5.0, KNOTS) / PACE)

    bands: Tensor
    directions: Tensor
    times: Tensor
    knots: Tensor

    def observe(self, data: FieldData) -> None:
        """Need nothing from the data beforehand."""

    def forward(
        self,
        query: Query,
        random: torch.Generator | None = None,  # noqa: ARG002
        weighting: RayWeighting = omni_weighting,
    ) -> Tensor:
        """Return responses through a listener pattern, (batch, n_samples)."""
        paths = self.images(query.emitter, query.listener)
        # Energy is split between reflection and absorption.
        reflected = 0.5 * nn.functional.logsigmoid(PACE * self.walls) @ self.bands
        logs = minimum_phase_log(reflected)
        walls = torch.exp(self.images.counts.to(logs.dtype) @ logs)
        delay = paths.distances * self.samples_a_metre
        heard = weighting(
            query, _local(paths.arrivals, query.listener_axes), local=True
        )
        level = heard / paths.distances * (delay < self.n_samples - 1)
        bins = torch.arange(self.length // 2 + 1, device=delay.device) / self.length
        phase = -2 * torch.pi * delay[..., None] * bins
        emitted = self._emitted(_local(paths.departures, query.emitter_axes))
        spectrum = torch.polar(level[..., None] * emitted, phase) * walls
        total = spectrum.sum(1) * torch.fft.rfft(self.source, self.length)
        early = torch.fft.irfft(total, self.length)[:, : self.n_samples]
        early = early * torch.sigmoid(self.decay) ** self.times
        share = torch.sigmoid(PACE * self.blend @ self.knots)
        return (1 - share) * early + share * self.late

    def _emitted(self, departures: Tensor) -> Tensor:
        likeness = departures @ self.directions.T
        kernel = torch.softmax(SHARPNESS * likeness, dim=-1)
        return torch.exp(kernel @ self.directivity @ self.bands)

    def emitter_pattern(self) -> tuple[Tensor, Tensor]:
        """Return directions and gains over bands of the learned directivity."""
        kernel = torch.softmax(SHARPNESS * self.directions @ self.directions.T, -1)
        return self.directions, torch.exp(kernel @ self.directivity)

    def read_pattern(self, query: Query) -> Tensor:  # noqa: ARG002
        """Return the learned directivity as harmonics, detached."""
        directions, gains = self.emitter_pattern()
        basis = harmonics(directions, ORDER)
        return torch.linalg.pinv(basis) @ gains.detach().mean(-1)

    def training_loss(
        self,
        query: Query,
        target: Tensor,
        random: torch.Generator,  # noqa: ARG002
    ) -> Tensor:
        """Return the multi-scale log spectral loss of a batch."""
        return multiscale_log_loss(self(query), target)

    def render(self, query: Query, weighting: RayWeighting = omni_weighting) -> Tensor:
        """Return responses, shape (batch, n_samples)."""
        return self(query, None, weighting)


def _local(directions: Tensor, axes: Tensor) -> Tensor:
    return local_direction(directions, axes)


def _knot_matrix(n_samples: int) -> Tensor:
    """Return the linear interpolation from knots, spaced by ratio, to samples."""
    places = np.geomspace(1, max(n_samples, 2), KNOTS)
    samples = np.arange(n_samples) + 1.0
    rows = [np.interp(samples, places, row) for row in np.eye(KNOTS)]
    return torch.tensor(np.array(rows), dtype=torch.float32)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> DirectionalField:
    """Train a DiffRIR field."""
    return fit_directional(DiffRir, data, config, plan)


def load(path: Path) -> DirectionalField:
    """Open a stored DiffRIR field."""
    return DirectionalField.of(load_network(path, DiffRir, Config))
