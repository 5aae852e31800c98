"""The shape of an arrival at any fraction of a sample, as a bank of polynomials.

Tap j of a pulse that arrives f of a sample after its row is a polynomial in
x = 2 f - 1 (a Farrow structure). Being linear, the whole bank can be fitted to
responses: it then holds the source's response, the converter's filters and the
interpolation a simulator used, in one.
"""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray

__all__ = ["MOMENTS", "PulseBank", "bank_of_pulse", "ideal_bank"]

MOMENTS = 8  # powers of the fraction of a sample: a sinc to -120 dB


@dataclass(frozen=True, eq=False)
class PulseBank:
    """Hold a pulse."""

    taps: FloatArray
    """Shape (moments, taps)."""
    lead: int
    """Taps before the row of the arrival."""

    def filtered(self, kernel: FloatArray, lead: int, keep: int) -> "PulseBank":
        """Return the bank behind another filter, cut to `keep` taps around it."""
        longer = np.array([np.convolve(row, kernel) for row in self.taps])
        start = max(0, self.lead + lead - keep // 2)
        return PulseBank(
            np.ascontiguousarray(longer[:, start : start + keep]),
            self.lead + lead - start,
        )


def ideal_bank(taps: int = 36, share: float = 1.0) -> PulseBank:
    """Return a windowed sinc with its band edge at a share of Nyquist."""
    lead = taps // 2 - 1

    def pulse(offset: FloatArray) -> FloatArray:
        inside = np.clip(1 - (2 * offset / taps) ** 2, 0, None)
        window = np.i0(8.0 * np.sqrt(inside)) / np.i0(8.0)
        return share * np.sinc(share * offset) * window

    return bank_of_pulse(pulse, taps, lead)


def bank_of_pulse(pulse, taps: int, lead: int) -> PulseBank:
    """Fit the bank of a continuous pulse given as a function of samples."""
    nodes = np.cos(np.pi * (np.arange(32) + 0.5) / 32)
    offset = np.arange(-lead, taps - lead)[:, None] - (nodes + 1) / 2
    chebyshev = np.polynomial.chebyshev.chebfit(nodes, pulse(offset).T, MOMENTS - 1)
    powers = [np.polynomial.chebyshev.cheb2poly(column) for column in chebyshev.T]
    padded = [np.pad(one, (0, MOMENTS - len(one))) for one in powers]
    return PulseBank(np.ascontiguousarray(np.array(padded).T), lead)
