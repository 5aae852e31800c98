"""Several loudspeakers in one take: equal sweeps, each begun a little later."""

from dataclasses import dataclass

import numpy as np

from rir.arrays import FloatArray

__all__ = ["Interleaving"]

GUARD_S = 0.02  # slack: a response later by 7 m of sound stays in its window


@dataclass(frozen=True)
class Interleaving:
    """How the sweeps of several loudspeakers overlap.

    Dividing by the first sweep gives all responses one after the other, `spacing`
    samples apart: equal sweeps differ by a delay alone, so a linear room keeps them
    apart exactly, up to what of each response is longer than its window.

    Attributes
    ----------
    count : int
        How many loudspeakers.
    spacing : int
        Samples from one sweep's beginning to the next one's.
    pre, length : int
        Samples of each response before and from the emission on.

    References
    ----------
    P. Majdak, P. Balazs, B. Laback, JAES 55, 623 (2007), multiple exponential sweeps.
    """

    count: int
    spacing: int
    pre: int
    length: int

    @staticmethod
    def of(count: int, pre: int, length: int, sample_rate: int) -> "Interleaving":
        """Return the closest spacing whose windows do not overlap."""
        guard = round(GUARD_S * sample_rate)
        return Interleaving(count, pre + length + guard, pre, length)

    @property
    def extra(self) -> int:
        """Samples by which a take gets longer than one of a single loudspeaker."""
        return (self.count - 1) * self.spacing

    def signals(self, sweep: FloatArray, before: int, after: int) -> FloatArray:
        """Return what each output plays, shape (count, n).

        Parameters
        ----------
        sweep : ndarray, shape (m,)
            The sweep.
        before, after : int
            Silence before the first and after the last sweep.
        """
        n = before + len(sweep) + self.extra + after
        signals = np.zeros((self.count, n))
        for number, signal in enumerate(signals):
            start = before + number * self.spacing
            signal[start : start + len(sweep)] = sweep
        return signals

    def separate(self, responses: FloatArray) -> FloatArray:
        """Return the responses of each loudspeaker.

        Parameters
        ----------
        responses : ndarray, shape (microphones, pre + extra + length)
            What dividing by the first sweep gave.

        Returns
        -------
        ndarray, shape (count · microphones, pre + length)
            All microphones of the first loudspeaker, then of the second, …
        """
        width = self.pre + self.length
        starts = self.spacing * np.arange(self.count)
        return np.concatenate([responses[:, at : at + width] for at in starts])

    def price(self, sweep_rate: float, sample_rate: int) -> str:
        """Return what overlapping costs in range, in a sentence.

        Parameters
        ----------
        sweep_rate : float
            Seconds in which the sweep's frequency grows by e.
        sample_rate : int
            Rate [Hz].

        Examples
        --------
        >>> Interleaving.of(2, 0, 4800, 48000).price(0.5, 48000)[:43]
        'headroom at the microphone 3.0 dB less; har'
        """
        headroom = 10 * np.log10(self.count)
        lead = sweep_rate * np.log(2) * sample_rate
        clean = self.extra + self.pre < lead
        harmonics = (
            "harmonics stay before the first response"
            if clean
            else "harmonics of later sweeps fall into other responses: the "
            "loudspeakers' distortion limits the range"
        )
        return f"headroom at the microphone {headroom:.1f} dB less; {harmonics}"
