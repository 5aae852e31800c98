"""The volume renderer written out: one waveform at every point, no shortcut."""

import torch


def naive_render(network, query, points, weighting):
    """Render point by point; only for small sizes."""
    n_samples = network.n_samples
    points, features = network.evaluate(query, points)
    signals = network.waveform(features)
    gaps = points.positions - query.emitter[:, None, None]
    flight = (gaps.square().sum(-1) + 1e-12).sqrt() * network.samples_a_metre
    emitted = flight.round().long().clamp(0, n_samples - 1)
    times = torch.arange(n_samples)
    signals = torch.where(times >= emitted[..., None], signals, 0.0)
    gains = weighting(query, points.rays)
    batch, rays, shells = points.weights.shape
    responses = []
    for item in range(batch):
        response = torch.zeros(n_samples)
        for ray in range(rays):
            for shell in range(shells):
                delay = int(network.delays[points.shells[item, ray, shell]])
                if delay >= n_samples:
                    continue
                share = points.weights[item, ray, shell] * gains[item, ray] / rays
                kept = signals[item, ray, shell, : n_samples - delay]
                response = response + share * torch.cat([torch.zeros(delay), kept])
        responses.append(response)
    travelled = times / network.samples_a_metre
    return torch.stack(responses) / travelled.clamp_min(0.1)
