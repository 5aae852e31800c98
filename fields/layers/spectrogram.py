"""Log-magnitude spectrograms with a fixed random phase."""

from dataclasses import dataclass

import torch
from torch import Tensor

__all__ = ["Spectrogram"]

LOG_FLOOR = 1e-3  # as in NAF's code
PHASE_SEED = 1234  # any: equal answers need an equal phase
GRIFFIN_LIM_MOMENTUM = 0.99  # Perraudin et al., A fast Griffin-Lim algorithm, 2013


@dataclass(frozen=True)
class Spectrogram:
    """Turn responses into log magnitudes and back.

    Parameters
    ----------
    n_fft, hop : int
        Length of the Hann window and its step, samples.
    n_samples : int
        Length of the responses.
    """

    n_fft: int
    hop: int
    n_samples: int

    @classmethod
    def for_rate(cls, sample_rate: float, n_samples: int) -> "Spectrogram":
        """Choose 256/64 at 16 kHz and 512/128 from 20 kHz, or what fits."""
        n_fft = 512 if sample_rate > 20000 else 256
        while n_fft > max(n_samples, 16):
            n_fft //= 2
        return cls(n_fft, n_fft // 4, n_samples)

    @property
    def bins(self) -> int:
        """Frequencies kept; the Nyquist row is left out."""
        return self.n_fft // 2

    @property
    def frames(self) -> int:
        """Time frames."""
        return 1 + self.n_samples // self.hop

    def log_magnitude(self, samples: Tensor) -> Tensor:
        """Return log(|STFT| + 1e-3), shape (batch, bins, frames)."""
        spectrum = self._analysed(samples)
        return torch.log(spectrum[:, : self.bins].abs() + LOG_FLOOR)

    def samples(self, log_magnitude: Tensor, griffin_lim_steps: int = 0) -> Tensor:
        """Synthesise responses with the same random phase every time.

        Parameters
        ----------
        log_magnitude : Tensor
            Shape (batch, bins, frames).
        griffin_lim_steps : int
            Iterations of fast Griffin-Lim from that phase; 0 keeps it.
        """
        size = (log_magnitude.exp() - LOG_FLOOR).clamp_min(0.0)
        size = torch.nn.functional.pad(size, (0, 0, 0, 1))
        phase = _random_phase(size.shape[1:], size.device)
        spectrum = torch.polar(size, phase.expand_as(size))
        before = spectrum
        for _ in range(griffin_lim_steps):
            rebuilt = self._analysed(self._synthesised(spectrum))
            ahead = rebuilt + GRIFFIN_LIM_MOMENTUM * (rebuilt - before)
            before = rebuilt
            spectrum = torch.polar(size, torch.angle(ahead))
        return self._synthesised(spectrum)

    def _analysed(self, samples: Tensor) -> Tensor:
        return torch.stft(
            samples,
            self.n_fft,
            self.hop,
            window=self._window(samples),
            return_complex=True,
            pad_mode="constant",
        )

    def _synthesised(self, spectrum: Tensor) -> Tensor:
        window = torch.hann_window(self.n_fft, device=spectrum.device)
        return torch.istft(
            spectrum, self.n_fft, self.hop, window=window, length=self.n_samples
        )

    def _window(self, samples: Tensor) -> Tensor:
        return torch.hann_window(self.n_fft, device=samples.device, dtype=samples.dtype)


def _random_phase(shape: torch.Size, device: torch.device) -> Tensor:
    random = torch.Generator().manual_seed(PHASE_SEED)
    return (2 * torch.pi * torch.rand(shape, generator=random)).to(device)
