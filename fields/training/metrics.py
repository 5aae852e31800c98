"""The paper's six metrics as tensors: what training can watch or descend.

The same definitions as ``analysis``' flavour "paper"; a test holds the two
together. T60, C50 and EDT are the differences of single numbers; T60 and EDT
search for samples, so no gradient flows through the choice.
"""

import torch
from torch import Tensor

__all__ = ["paper_differences"]

SMOOTHING_BINS = 32
ENERGY_FLOOR = 1e-9
RESOLUTIONS = ((512, 300, 60), (256, 150, 30), (128, 75, 8))
POWER_FLOOR = 1e-8
EARLY_S = 0.05


def paper_differences(
    truth: Tensor, prediction: Tensor, sample_rate: float
) -> dict[str, Tensor]:
    """Return Amp, Env, T60 (fractions), C50 (dB), EDT (s) and STFT differences.

    Parameters
    ----------
    truth, prediction : Tensor
        Shape (..., n_samples), float64 for agreement to 1e-5.
    sample_rate : float
        Hertz.

    Returns
    -------
    dict of Tensor
        Each of shape (...).
    """
    ends = truth, prediction
    spectra = [_smooth_spectrum(one) for one in ends]
    envelopes = [_envelope(one) for one in ends]
    curves = [_energy_curve(one) for one in ends]
    times = [_reverberation_time(one, sample_rate) for one in curves]
    decays = [6 * (one + 10).abs().argmin(-1) / sample_rate for one in curves]
    clarities = [_clarity(one, int(EARLY_S * sample_rate)) for one in ends]
    return {
        "Amp": ((spectra[0] - spectra[1]).abs() / spectra[0]).mean(-1),
        "Env": (envelopes[0] - envelopes[1]).abs().mean(-1) / envelopes[0].amax(-1),
        "T60": (times[0] - times[1]).abs() / times[0],
        "C50": (clarities[0] - clarities[1]).abs(),
        "EDT": (decays[0] - decays[1]).abs(),
        "STFT": _spectrogram_difference(truth, prediction),
    }


def _smooth_spectrum(samples: Tensor) -> Tensor:
    magnitude = torch.fft.fft(samples).abs()
    half = SMOOTHING_BINS // 2
    # Edges are mirrored with the edge bin repeated, as scipy's "reflect".
    padded = torch.cat(
        [magnitude[..., :half].flip(-1), magnitude, magnitude[..., -half:].flip(-1)],
        dim=-1,
    )
    sums = torch.nn.functional.pad(padded.cumsum(-1), (1, 0))
    count = magnitude.shape[-1]
    span = SMOOTHING_BINS
    # An even window reaches one bin further up than down.
    return sums[..., span + 1 : span + 1 + count] - sums[..., 1 : 1 + count]


def _envelope(samples: Tensor) -> Tensor:
    count = samples.shape[-1]
    weights = torch.zeros(count, dtype=samples.dtype, device=samples.device)
    weights[0] = 1.0
    weights[1 : (count + 1) // 2] = 2.0
    if count % 2 == 0:
        weights[count // 2] = 1.0
    return torch.fft.ifft(torch.fft.fft(samples) * weights).abs()


def _energy_curve(samples: Tensor) -> Tensor:
    energy = (samples.square() + ENERGY_FLOOR).flip(-1).cumsum(-1).flip(-1)
    level = 10 * energy.log10()
    return level - level[..., :1]


def _reverberation_time(curve: Tensor, sample_rate: float) -> Tensor:
    first = (curve + 5).abs().argmin(-1, keepdim=True)
    last = (curve + 25).abs().argmin(-1, keepdim=True)
    place = torch.arange(curve.shape[-1], device=curve.device)
    inside = ((place >= first) & (place <= last)).to(curve.dtype)
    count = inside.sum(-1, keepdim=True)
    time = place.to(curve.dtype) / sample_rate
    centred = (time - (inside * time).sum(-1, keepdim=True) / count) * inside
    level = curve - (inside * curve).sum(-1, keepdim=True) / count
    slope = (centred * level).sum(-1) / centred.square().sum(-1)
    return torch.where(last[..., 0] > first[..., 0], -60.0 / slope, torch.nan)


def _clarity(samples: Tensor, split: int) -> Tensor:
    power = samples.square()
    return 10 * (power[..., :split].sum(-1) / power[..., split:].sum(-1)).log10()


def _spectrogram_difference(truth: Tensor, prediction: Tensor) -> Tensor:
    lead = truth.shape[:-1]
    flat = [one.reshape(-1, one.shape[-1]) for one in (truth, prediction)]
    total = truth.new_zeros(flat[0].shape[0])
    for size, window, hop in RESOLUTIONS:
        ours, theirs = (_magnitudes(one, size, window, hop) for one in flat)
        norm = torch.linalg.vector_norm(theirs, dim=(1, 2))
        total = total + torch.linalg.vector_norm(ours - theirs, dim=(1, 2)) / norm
        total = total + (ours.log() - theirs.log()).abs().mean((1, 2))
        total = total + (ours - theirs).abs().mean((1, 2))
    return (total / len(RESOLUTIONS)).reshape(lead)


def _magnitudes(samples: Tensor, size: int, window: int, hop: int) -> Tensor:
    taper = torch.hann_window(window, dtype=samples.dtype, device=samples.device)
    mode = "reflect" if samples.shape[-1] > size // 2 else "constant"
    spectrum = torch.stft(
        samples,
        size,
        hop,
        window,
        window=taper,
        return_complex=True,
        pad_mode=mode,
    )
    return torch.view_as_real(spectrum).square().sum(-1).clamp_min(POWER_FLOOR).sqrt()
