"""What would make one direction out of the other: gain, time stretch, delay."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.likeness.octaves import OctaveEnvelope, octave_envelopes, usable_octaves
from analysis.likeness.quiet import lead_band_powers
from rir.arrays import FloatArray
from rir.onset import find_onset
from rir.physics import STRETCH_PER_KELVIN

__all__ = ["OCTAVES", "SwapFit", "fit_swap", "resampled_at", "warped"]

OCTAVES = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
"""Octaves of ISO 3382-1 and 8 kHz [Hz]; those the rate has no room for are left out."""
WINDOW_EDGES = (0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28)
"""Edges of the time windows, from the direct sound on [s]."""


@dataclass(frozen=True)
class SwapFit:
    """How the reverse response differs from the forward one."""

    gain_db: float
    """Level of reverse over forward, the median over bands and windows [dB]."""
    stretch: float
    """Speed of sound of the reverse take over that of the forward one, minus 1."""
    delay: float
    """Delay of reverse over forward that is the same at all times [s]."""
    centers: FloatArray
    """Octaves [Hz]. Shape (bands,)."""
    edges: FloatArray
    """Window edges from the direct sound on [s]. Shape (windows + 1,)."""
    coherence: FloatArray
    """Correlation of the two as recorded, 1 for equal waveforms; NaN where noise covers
    the window. Shape (bands, windows)."""
    matched: FloatArray
    """The same after stretch and delay were taken out. Shape (bands, windows)."""
    residual: FloatArray
    """Energy of what the fit leaves, over the energy of the response, with the expected
    share of noise taken off. Shape (bands, windows)."""
    noise: FloatArray
    """That share. Shape (bands, windows)."""

    @property
    def temperature_change(self) -> float:
        """Warming between forward and reverse that explains the stretch [K]."""
        return self.stretch / STRETCH_PER_KELVIN


def warped(
    samples: FloatArray, sample_rate: int, stretch: float, delay: float
) -> FloatArray:
    """Return h((1 + stretch) t - delay), band-limited, shape (n,).

    Four-fold oversampling makes the linear interpolation wrong by at most -41 dB
    at a sixth of the sample rate.
    """
    if stretch == 0 and delay == 0:
        return samples
    time = np.arange(len(samples)) * (1 + stretch) - delay * sample_rate
    return resampled_at(samples, time)


def resampled_at(samples: FloatArray, time: NDArray[Any]) -> FloatArray:
    """Return a response at fractional sample instants, zero outside of it."""
    from scipy.fft import irfft, next_fast_len, rfft

    count = int(next_fast_len(len(samples) + 64, real=True) or 0)
    fine = np.asarray(irfft(np.asarray(rfft(samples, count)), 4 * count)) * 4
    return np.interp(4 * time, np.arange(4 * count), fine, left=0.0, right=0.0)


def fit_swap(
    forward: FloatArray,
    reverse: FloatArray,
    sample_rate: int,
    centers: Sequence[float] = OCTAVES,
) -> SwapFit:
    """Fit gain, stretch and delay of `reverse` against `forward`.

    The phases of the cross-correlations in octaves and time windows are a line
    over time: low octaves give its start without ambiguity, high ones its precision.

    Parameters
    ----------
    forward, reverse : ndarray, shape (n,)
        Responses on the same time axis.
    sample_rate : int
        Samples per second [Hz].
    centers : sequence of float
        Octaves to use [Hz].
    """
    bands = usable_octaves(sample_rate, centers)
    onset = float(min(find_onset(h) for h in (forward, reverse))) / sample_rate
    edges = _edges(onset, len(forward) / sample_rate)
    target = octave_envelopes(reverse, sample_rate, bands)
    raw = octave_envelopes(forward, sample_rate, bands)
    stretch, delay, moved = 0.0, 0.0, raw
    for highest in (1000.0, 2000.0, np.inf, np.inf):
        more = _slope(moved, target, edges, highest)
        stretch, delay = stretch + more[0], delay + more[1]
        forward_now = warped(forward, sample_rate, stretch, delay)
        moved = octave_envelopes(forward_now, sample_rate, bands)
    floors = np.stack(
        [
            _noise_powers(h, bank, sample_rate)
            for h, bank in ((forward, raw), (reverse, target))
        ]
    )
    noise = _noise_shares(target, edges, floors)
    gain = _median_gain(moved, target, edges, noise, floors)
    matched, residual = _likeness(moved, target, edges, noise, gain)
    plain, _ = _likeness(raw, target, edges, noise, gain)
    return SwapFit(
        float(20 * np.log10(gain)),
        stretch,
        delay,
        np.array(bands),
        edges - onset,
        plain,
        matched,
        residual,
        noise,
    )


def _edges(onset: float, duration: float) -> FloatArray:
    # The filters ring before the direct sound, so the first window starts earlier.
    edges = onset + np.array(WINDOW_EDGES)
    edges[0] -= 0.002
    inside = edges[edges < duration]
    return inside if len(inside) > 1 else np.array([max(0.0, onset - 0.002), duration])


def _windows(
    forward: OctaveEnvelope, reverse: OctaveEnvelope, edges: FloatArray
) -> list[tuple[NDArray[np.complex128], NDArray[np.complex128]]]:
    return [
        (forward.window(a, b), reverse.window(a, b))
        for a, b in itertools.pairwise(edges)
    ]


def _slope(
    moved: Sequence[OctaveEnvelope],
    target: Sequence[OctaveEnvelope],
    edges: FloatArray,
    highest: float,
) -> tuple[float, float]:
    """Return stretch and delay that turn the cross-correlations to phase zero."""
    rows, values, weights = [], [], []
    for f, r in zip(moved, target, strict=True):
        if f.center > highest * 1.1:
            continue
        turn = 2 * np.pi * f.center
        for (a, b), start, stop in zip(
            _windows(f, r, edges), edges[:-1], edges[1:], strict=True
        ):
            cross = np.vdot(a, b)
            energies = np.vdot(a, a).real * np.vdot(b, b).real
            if energies <= 0:
                continue
            alike = min(float(np.abs(cross) / np.sqrt(energies)), 0.9999)
            if alike < 0.4:
                continue
            middle = _centroid(a, start, stop)
            rows.append((middle, -1.0))
            values.append(np.angle(cross) / turn)
            weights.append(turn * np.sqrt(alike**2 / (1 - alike**2) * len(a)))
    if len(rows) < 2:
        return 0.0, 0.0
    scale = np.array(weights) / max(weights)
    solved, *_ = np.linalg.lstsq(
        np.array(rows) * scale[:, None], np.array(values) * scale, rcond=None
    )
    return float(solved[0]), float(solved[1])


def _centroid(values: NDArray[np.complex128], start: float, stop: float) -> float:
    power = np.abs(values) ** 2
    share = float(np.sum(power * (np.arange(len(power)) + 0.5)) / np.sum(power))
    return start + (stop - start) * share / len(power)


def _noise_shares(
    target: Sequence[OctaveEnvelope], edges: FloatArray, floors: FloatArray
) -> FloatArray:
    """Return the noise power of both over the power of a window."""
    shares = np.empty((len(target), len(edges) - 1))
    for k, r in enumerate(target):
        for w, (start, stop) in enumerate(itertools.pairwise(edges)):
            part = r.window(start, stop)
            power = np.mean(np.abs(part) ** 2) if len(part) else 0.0
            shares[k, w] = floors[:, k].sum() / power if power > 0 else np.inf
    return shares


def _noise_powers(
    samples: FloatArray, bands: Sequence[OctaveEnvelope], sample_rate: int
) -> FloatArray:
    """Return the noise of one response in each octave: lead or tail, the quieter."""
    centers = [band.center for band in bands]
    tails = [
        np.mean(np.abs(band.values[-max(4, len(band.values) // 10) :]) ** 2)
        for band in bands
    ]
    return np.minimum(tails, lead_band_powers(samples, sample_rate, centers))


def _median_gain(
    moved: Sequence[OctaveEnvelope],
    target: Sequence[OctaveEnvelope],
    edges: FloatArray,
    noise: FloatArray,
    floors: FloatArray,
) -> float:
    """Return the amplitude ratio that half of the clean windows exceed."""
    ratios = []
    for k, (f, r) in enumerate(zip(moved, target, strict=True)):
        for w, pair in enumerate(_windows(f, r, edges)):
            a, b = (
                np.sum(np.abs(x) ** 2) - len(x) * floor
                for x, floor in zip(pair, floors[:, k], strict=True)
            )
            if noise[k, w] < 0.05 and min(a, b) > 0:
                ratios.append(b / a)
    if not ratios:
        powers = [
            sum(np.sum(np.abs(x.values) ** 2) for x in g) for g in (moved, target)
        ]
        return float(np.sqrt(powers[1] / powers[0])) if powers[0] > 0 else 1.0
    return float(np.sqrt(np.median(ratios)))


def _likeness(
    moved: Sequence[OctaveEnvelope],
    target: Sequence[OctaveEnvelope],
    edges: FloatArray,
    noise: FloatArray,
    gain: float,
) -> tuple[FloatArray, FloatArray]:
    coherence = np.full(noise.shape, np.nan)
    residual = np.full(noise.shape, np.nan)
    for k, (f, r) in enumerate(zip(moved, target, strict=True)):
        for w, (a, b) in enumerate(_windows(f, r, edges)):
            power = np.vdot(b, b).real
            if noise[k, w] > 0.5 or power <= 0:
                continue
            energies = np.vdot(a, a).real * power
            coherence[k, w] = np.vdot(a, b).real / np.sqrt(energies or 1.0)
            left = np.sum(np.abs(b - gain * a) ** 2) / power
            residual[k, w] = max(0.0, left - noise[k, w])
    return coherence, residual
