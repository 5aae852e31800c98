"""AVR: sound gathered along rays through a learned volume, exactly and fast.

The released renderer computes a whole waveform at every point. Its last layer
is linear, so features are summed first and the waveform is made once per shell
(:mod:`fields.render.projection`); the result is the same to rounding.
"""

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from pydantic import NonNegativeFloat, NonNegativeInt
from torch import Tensor, nn
from torch.utils.checkpoint import checkpoint

from fields.data import FieldData
from fields.frame import SceneFrame
from fields.layers.direct import DirectPath, arrival, local_direction
from fields.layers.emission import Emission, emission_for, omni_pattern, sent_features
from fields.layers.encoding import Octaves, Sinusoids
from fields.layers.harmonics import harmonics
from fields.layers.hash_grid import HashGrid
from fields.layers.level import Level
from fields.layers.perceptron import perceptron
from fields.layers.query import Query
from fields.layers.shade import CELLS, Shade
from fields.pattern import fit_emitter_pattern
from fields.plan import TrainingPlan
from fields.render.bank import bank_sum
from fields.render.compositing import compositing_weights, drawn_shells, path_loss
from fields.render.points import Points
from fields.render.projection import causal_projections
from fields.render.rays import Shells, even_directions, random_rotation
from fields.render.weighting import RayWeighting, omni_weighting
from fields.selfsupervised.fit import fit_directional
from fields.settings import Count, settings
from fields.training.directional import DirectionalField
from fields.training.losses import LossWeights, waveform_loss
from fields.training.network import load_network

__all__ = ["PRESETS", "Avr", "Config", "fit", "load"]

AVR_WEIGHTS = LossWeights(
    time=10.0, spectrum=0.0, amplitude=1.0, angle=0.0, energy=1.0, stft=1.0
)
START_OPACITY = 1.0  # of a whole ray at the start: neither empty nor shut
LARGE_VALUES = 2**25  # values of a layer held at once: 128 MiB of float32
LARGE_RAYS = 500  # from here on batches of 4: the sizes of the paper fill memory


@settings
class Config:
    """Sizes of the volume and of the rays through it."""

    rays: Count = 10
    "directions a listener looks in (paper: 64 x 32 + 2)"
    shells: Count = 8
    "points a ray (paper: 64)"
    far: NonNegativeFloat = 0.0
    "radius of the last shell, metres; 0 takes the scene's diagonal"
    proposals: NonNegativeInt = 0
    "shells of a ray evaluated in training, drawn by their weight; 0: all"
    density: Literal["grid", "network"] = "grid"
    "where opacity comes from: grid (cheap) or network (paper)"
    head: Literal["shell", "bank"] = "shell"
    "signal of a point: bank (responses at the total delay) or shell (paper)"
    width: Count = 256
    "width of the signal network (paper: 512)"
    feature_width: Count = 64
    "width of the point network (paper: 128)"
    channels: Count = 48
    "responses in the bank"
    octaves: Octaves = 8
    "frequencies of the position encoding (paper: a hash grid)"
    hash_levels: Octaves = 0
    "levels of a hash grid in place of sinusoids (paper: 20)"
    emission: Emission = "auto"
    "what points know of the emitter: auto, local, pattern, absolute, absolute-pattern"
    # local: bearing in its frame; absolute: place and axes, as in the paper; pattern:
    # offset, or absolute place, and the known gain as a factor; auto: by the plan.
    turning: bool = False
    "turn the rays at random in every step; few rays converge faster unturned"
    direct: bool = True
    "write the direct sound out, with a learned emitter pattern"
    shaded: bool = True
    "let a learned volume of obstacles dim the direct sound"


PRESETS = {
    "cpu": Config(),
    "paper": Config(
        rays=2050,
        shells=64,
        proposals=0,
        density="network",
        head="shell",
        width=512,
        feature_width=128,
        hash_levels=20,
        emission="absolute",
        turning=True,
        direct=False,
    ),
}


class Avr(nn.Module):
    """Render responses from opacity and signals in space."""

    name = "avr"

    def __init__(self, frame: SceneFrame, config: Config) -> None:
        super().__init__()
        config = replace(config, emission=emission_for(config.emission))
        self.config = config
        self.absolute = config.emission.startswith("absolute")
        self.takes_source = config.emission.endswith("pattern")
        self.batch_size = 16 if config.rays < LARGE_RAYS else 4
        self.n_samples = frame.n_samples
        self.samples_a_metre = frame.sample_rate / frame.speed_of_sound
        diagonal = float(np.linalg.norm(frame.high - frame.low)) + 1.0
        far = config.far or diagonal
        self.reach = frame.reach + 0.5 * far
        self.register_buffer("center", torch.tensor(frame.center, dtype=torch.float32))
        rays = even_directions(config.rays)
        self.register_buffer("rays", rays, persistent=False)
        self._add_shells(far)
        self._add_networks()
        self.direct = (
            DirectPath(frame.n_samples, self.samples_a_metre) if config.direct else None
        )
        shaded = config.direct and config.shaded
        self.shade = Shade(frame.low, frame.high) if shaded else None
        self.register_buffer("fitted", omni_pattern())
        self.level = Level(frame.n_samples, frame.sample_rate)

    fitted: Tensor
    center: Tensor
    rays: Tensor
    delays: Tensor
    radii: Tensor
    steps: Tensor

    def _add_shells(self, far: float) -> None:
        shells = Shells.spread(self.config.shells, far, self.samples_a_metre)
        self.register_buffer("delays", shells.delays, persistent=False)
        self.register_buffer("radii", shells.radii, persistent=False)
        self.register_buffer("steps", shells.steps, persistent=False)
        self.start_density = START_OPACITY / far

    def _add_networks(self) -> None:
        config = self.config
        self.encode_point = (
            HashGrid(config.hash_levels)
            if config.hash_levels
            else Sinusoids(config.octaves)
        )
        self.encode_view = Sinusoids(2)
        self.encode_emitter = Sinusoids(config.octaves if config.octaves else 6)
        narrow, wide = config.feature_width, config.width
        self.point_network = perceptron(
            [self.encode_point.width, narrow, narrow, narrow, narrow]
        )
        if config.density == "network":
            self.density_network = perceptron([narrow, narrow, narrow, narrow, 1])
        else:
            self.density_grid = nn.Parameter(torch.zeros(1, 1, *[CELLS] * 3))
        emitter = self.encode_emitter.width if self.absolute else 4
        emitter += 6 if config.emission == "absolute" else 0
        # The first layer is split, so that what rays or emitters share is made once.
        self.from_point = nn.Linear(narrow, wide)
        self.from_view = nn.Linear(self.encode_view.width, wide, bias=False)
        self.from_emitter = nn.Linear(emitter, wide, bias=False)
        self.signal_network = perceptron([wide, wide, wide], last=False)
        if config.head == "shell":
            self.waveform = nn.Linear(wide, self.n_samples)
            nn.init.normal_(self.waveform.weight, std=1e-2)
            nn.init.zeros_(self.waveform.bias)
        else:
            self.to_channels = nn.Linear(wide, config.channels)
            noise = torch.randn(config.channels, self.n_samples)
            self.bank = nn.Parameter(1e-2 * noise)

    def observe(self, data: FieldData) -> None:
        """Start from the emitter's pattern as fitted to the responses."""
        if self.direct is None and not self.takes_source:
            return
        fitted = fit_emitter_pattern(data)
        if fitted is None:
            return
        coefficients = torch.tensor(fitted.pattern.coefficients[0]).float()
        self.fitted.copy_(coefficients)
        if self.direct is not None:
            self.direct.set_pattern(coefficients)

    def fit_level(self, data: FieldData) -> None:
        """Give back the energy that the trained volume lacks."""
        self.level.fit(self, data)

    def points(self, query: Query, random: torch.Generator | None) -> Points:
        """Choose the points of a batch; without randomness always the same."""
        rays = self.rays
        if random is not None and self.config.turning:
            rays = rays @ random_rotation(random).to(rays.device).T
        offsets = rays[:, None] * self.radii[None, :, None]
        positions = query.listener[:, None, None] + offsets
        shells = torch.arange(len(self.radii), device=rays.device)
        shells = shells.expand(*positions.shape[:-1])
        if self.config.density == "network":
            return Points(positions, shells, shells.new_zeros(len(shells)), rays)
        weights = compositing_weights(self._grid_density(positions), self.steps)
        # Few shells are right on average only: an answer is made from all of them.
        if self.config.proposals and random is not None:
            shells, weights = drawn_shells(weights, self.config.proposals, random)
            radii = self.radii[shells][..., None]
            positions = query.listener[:, None, None] + rays[:, None] * radii
        return Points(positions, shells, weights, rays)

    def _grid_density(self, positions: Tensor) -> Tensor:
        local = (positions - self.center) / self.reach
        shape = (1, -1, 1, 1, 3)
        values = nn.functional.grid_sample(
            self.density_grid,
            local.reshape(shape),
            padding_mode="border",
            align_corners=True,
        )
        return self._density(values.reshape(positions.shape[:-1]))

    def _density(self, raw: Tensor) -> Tensor:
        return self.start_density * nn.functional.softplus(raw) / 0.6931

    def evaluate(
        self, query: Query, points: Points, source: Tensor | None = None
    ) -> tuple[Points, Tensor]:
        """Ask the network once: points with weights, and their features.

        Everything a listener's pattern changes comes after this, so a second
        rendering through another pattern needs no second evaluation.
        """
        given = query, points.positions, points.rays
        if points.shells.numel() * self.config.width > LARGE_VALUES:
            # At the paper's size what these networks would keep for the backward
            # pass is more than the rest together, and cheap to make again.
            density, hidden = checkpoint(
                self._entry, *given, use_reentrant=False, preserve_rng_state=False
            )
        else:
            density, hidden = self._entry(*given)
        if density is not None:
            weights = compositing_weights(density, self.steps)
            points = replace(points, weights=weights)
        features = self.signal_network[1:](hidden)
        if not self.takes_source:
            return points, features
        if source is None:
            source = self.fitted
        return points, sent_features(query, points.positions, features, source)

    def _entry(
        self, query: Query, positions: Tensor, rays: Tensor
    ) -> tuple[Tensor | None, Tensor]:
        """Return density, and the first layer of the signal network."""
        local = (positions - self.center) / self.reach
        about = nn.functional.relu(self.point_network(self.encode_point(local)))
        density = None
        if self.config.density == "network":
            density = self._density(self.density_network(about)[..., 0].float())
        hidden = self.from_point(about)
        hidden += self.from_view(self.encode_view(-rays))[:, None]
        hidden += self._emission(query, positions)
        return density, self.signal_network[0](nn.functional.relu(hidden, inplace=True))

    def _emission(self, query: Query, positions: Tensor) -> Tensor:
        if not self.absolute:
            offset = positions - query.emitter[:, None, None]
            length = offset.norm(dim=-1, keepdim=True) / self.reach
            if self.config.emission == "local":
                bearing = local_direction(offset, query.emitter_axes)
            else:
                bearing = offset / self.reach
            return self.from_emitter(torch.cat([bearing, length], dim=-1))
        place = self.encode_emitter((query.emitter - self.center) / self.reach)
        if not self.takes_source:
            axes = query.emitter_axes[..., 0], query.emitter_axes[..., 2]
            place = torch.cat([place, *axes], dim=-1)
        return self.from_emitter(place)[:, None, None]

    def point_signal(self, features: Tensor) -> Tensor:
        """Return what points send, from the emission on, (..., n_samples)."""
        if self.config.head == "shell":
            return self.waveform(features)
        return self.to_channels(features) @ self.bank

    def gather(
        self,
        query: Query,
        points: Points,
        features: Tensor,
        weighting: RayWeighting,
        source: Tensor | None = None,
    ) -> Tensor:
        """Sum the points through a listener's pattern, (batch, n_samples)."""
        heard = weighting(query, points.rays)
        return self._complete(
            query, self._sum(query, points, features, heard), weighting, source
        )

    def _complete(
        self,
        query: Query,
        gathered: Tensor,
        weighting: RayWeighting,
        source: Tensor | None = None,
    ) -> Tensor:
        loss = path_loss(self.n_samples, self.samples_a_metre, gathered.device)
        response = gathered * loss
        if self.direct is None:
            return self.level(response)
        toward = weighting(query, arrival(query)[:, None], local=True)[:, 0]
        if self.shade is not None:
            toward = toward * self.shade(query)
        return self.level(response) + self.direct(query, toward, source)

    def _sum(
        self, query: Query, points: Points, features: Tensor, heard: Tensor
    ) -> Tensor:
        """Sum points heard with a weight a ray (batch, rays), before any loss."""
        shares = points.weights * heard[..., None] / len(points.rays)
        gaps = points.positions - query.emitter[:, None, None]
        flight = (gaps.square().sum(-1) + 1e-12).sqrt() * self.samples_a_metre
        if self.config.head == "shell":
            arrivals = flight.round().long().clamp(0, self.n_samples - 1)
            last = self.delays, self.waveform.weight, self.waveform.bias
            return causal_projections(features, shares, points.shells, arrivals, last)
        total = flight + self.delays[points.shells]
        channels = self.to_channels(features).float()
        return bank_sum(
            channels.flatten(1, 2), shares.flatten(1), total.flatten(1), self.bank
        )

    def forward(
        self,
        query: Query,
        random: torch.Generator | None = None,
        weighting: RayWeighting = omni_weighting,
        source: Tensor | None = None,
    ) -> Tensor:
        """Return responses through a listener pattern, (batch, n_samples).

        A ``source`` (coefficients, device frame) takes the place of the emitter's
        own pattern; only the emissions that end in "pattern" do so throughout.
        """
        points = self.points(query, random)
        heard = weighting(query, points.rays)
        values = points.shells[0].numel() * self.config.width
        sums = []
        for rows in torch.arange(len(query)).split(max(LARGE_VALUES // values, 1)):
            some = slice(int(rows[0]), int(rows[-1]) + 1)
            part, features = self.evaluate(query[some], points[some], source)
            sums.append(self._sum(query[some], part, features, heard[some]))
        return self._complete(query, torch.cat(sums), weighting, source)

    def emitter_pattern(self) -> tuple[Tensor, Tensor] | None:
        """Return directions and gains of the direct sound, if it is written out."""
        if self.direct is None:
            return None
        directions = even_directions(256)
        return directions, (harmonics(directions, 4) @ self.direct.pattern)[:, None]

    def read_pattern(self, query: Query) -> Tensor:
        """Return the pattern it is linear in, or read at the emitters' own places."""
        if self.takes_source:
            return self.fitted
        from fields.training.readout import network_pattern

        return network_pattern(self, query)

    def training_loss(
        self, query: Query, target: Tensor, random: torch.Generator
    ) -> Tensor:
        """Return the waveform loss of a batch."""
        return waveform_loss(self(query, random), target, AVR_WEIGHTS)

    def render(self, query: Query, weighting: RayWeighting = omni_weighting) -> Tensor:
        """Return responses with fixed rays, (batch, n_samples)."""
        return self(query, None, weighting)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> DirectionalField:
    """Train an AVR field, with the reciprocity loss when the plan asks for it."""
    config = replace(config, emission=emission_for(config.emission, plan))
    return fit_directional(Avr, data, config, plan)


def load(path: Path) -> DirectionalField:
    """Open a stored AVR field."""
    return DirectionalField.of(load_network(path, Avr, Config))
