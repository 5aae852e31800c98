"""The emitter's pattern as a trained field has it."""

import math
from typing import Any

import numpy as np
import torch

from fields.layers.direct import ORDER
from fields.layers.harmonics import harmonics
from fields.layers.query import Query
from fields.render.rays import even_directions
from rir import GainPattern, Poses

__all__ = ["network_pattern", "read_emitter_pattern"]

READ_RADIUS_M = 0.4  # of the sphere asked at: ahead of the reflections of its middle
READ_DIRECTIONS = 64  # seven for each of the nine coefficients of degree 2
READ_EMITTERS = 8  # places averaged: one may stand where the field errs
HALF_WINDOW_S = 0.0005  # about the direct sound: 0.17 m of way
PAPER_DIRECTIONS = 128  # five for each of the 25 coefficients of degree 4


def read_emitter_pattern(field: Any) -> GainPattern:
    """Return the pattern of a directional field's emitter.

    A field that writes the direct sound out knows its pattern. Otherwise the
    field is asked on a small sphere round the middle of its box, and the energy
    round the direct delay is fitted by harmonics of degree 2.
    """
    known = field.network.emitter_pattern()
    if known is None:
        return _from_sphere(field)
    directions, gains = (one.detach().cpu().double().numpy() for one in known)
    return GainPattern.fit(directions, gains.mean(axis=1), order=ORDER)


def _from_sphere(field: Any) -> GainPattern:
    frame = field.frame
    directions = even_directions(READ_DIRECTIONS).double().numpy()
    rng = np.random.default_rng(0)
    inner = 0.25 * (frame.high - frame.low)
    places = rng.uniform(
        frame.low + inner, frame.high - inner + 1e-9, (READ_EMITTERS, 3)
    )
    middle = READ_RADIUS_M / frame.speed_of_sound * frame.sample_rate
    half = max(int(HALF_WINDOW_S * frame.sample_rate), 1)
    window = slice(max(int(middle) - half, 0), int(middle) + half + 1)
    energy = np.zeros(len(directions))
    for place in places:
        listeners = Poses.of(place + READ_RADIUS_M * directions)
        heard = field.predict(place, listeners) / frame.scale
        energy += np.square(heard[:, window].astype(np.float64)).sum(axis=1)
    gains = READ_RADIUS_M * np.sqrt(energy / len(places))
    return GainPattern.fit(directions, gains, order=2)


def network_pattern(network: Any, query: Query, order: int = ORDER) -> torch.Tensor:
    """Read the pattern as the paper does: the signal at the emitter's own place.

    Points are put at the emitter, one for each direction of travel; the mean
    energy of the network's signal there, its root normalised to mean square 1,
    is fitted by harmonics in the emitter's frame. Returns coefficients, shape
    ((order + 1)^2,), detached.
    """
    from fields.render.points import Points

    with torch.no_grad():
        rays = even_directions(PAPER_DIRECTIONS).to(query.emitter.device)
        shape = (len(query), len(rays), 1)
        positions = query.emitter[:, None, None].expand(*shape, 3)
        shells = torch.zeros(shape, dtype=torch.long)
        # Views are directions of travel, and rays point against them.
        points = Points(positions, shells, torch.ones(shape), -rays)
        _, features = network.evaluate(query, points)
        signal = network.point_signal(features[:, :, 0])
        energy = signal.square().mean(-1)
        gain = (energy / energy.mean(-1, keepdim=True).clamp_min(1e-12)).sqrt()
        local = torch.einsum("ri,bij->brj", rays, query.emitter_axes)
        basis = harmonics(local, order)
        # Even directions are a good quadrature: 4 pi / count each.
        share = 4 * math.pi / len(rays)
        return share * torch.einsum("br,brk->k", gain, basis) / len(query)
