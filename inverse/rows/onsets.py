"""When the first sound arrives where no direct sound does."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["Onsets", "read_onsets"]

LOW_HZ, HIGH_HZ = 200.0, 6000.0
"""Sound that is read: above rumble, below where doors' edges bend too little of it."""
STRETCH = 4
"""Times the sample rate: peaks are then read by a parabola to a tenth of a sample."""
NOISES = 6.0
"""Times the noise's rms: some thousand samples before it hold none so large."""
AHEAD_S, SHARE = 0.004, 0.08
"""A first arrival may be 22 dB below what comes within 4 ms: bent sound is faint, and
the band's own ripple fainter still."""
LEAST_QUIET = 12  # samples before the straight way that a noise can be read from


@dataclass(frozen=True, eq=False)
class Onsets:
    """Hold first arrivals."""

    lengths: FloatArray
    """Length of the shortest way sound took, metres; NaN where noise or an early start
    hides it. Shape (rows,)."""

    @property
    def known(self) -> NDArray[np.bool_]:
        """Rows whose first arrival was read."""
        return np.isfinite(self.lengths)


def read_onsets(
    rows: FitSet, direct: DirectSound, speed_of_sound: float | None = None
) -> Onsets:
    """Read when sound first arrives in each row, pulse and latency taken away.

    Nothing may come before the straight way; what stands there is noise, and the
    first peak well above it and not far below what follows is the arrival.
    """
    speed = speed_of_sound or rows.speed_of_sound
    rate = rows.sample_rate * STRETCH
    sound = np.abs(_sharpened(rows, direct))
    lengths = np.full(len(rows), np.nan)
    ahead = round(AHEAD_S * rate)
    for row, reach in enumerate(rows.distances):
        begin = int(reach / speed * rate) - STRETCH
        quiet = sound[row, : max(begin - 2 * STRETCH, 0)]
        if len(quiet) < LEAST_QUIET * STRETCH or begin >= sound.shape[1] - 3:
            continue
        noise = float(np.sqrt((quiet**2).mean()))
        at = _first_peak(sound[row], max(begin, 1), NOISES * noise, ahead)
        if at is not None:
            lengths[row] = at / rate * speed
    return Onsets(lengths)


def _sharpened(rows: FitSet, direct: DirectSound) -> FloatArray:
    """Return rows in which an arrival is a short pulse at its delay."""
    size = int(2 ** np.ceil(np.log2(rows.n_samples + 4 * len(direct.pulse))))
    omega = 2 * np.pi * np.arange(size // 2 + 1) / size
    spectra = np.fft.rfft(rows.responses, size)
    lead = direct.lead + direct.latency_s * rows.sample_rate
    pulse = np.fft.rfft(direct.pulse, size)
    floor = 1e-2 * np.max(np.abs(pulse)) + 1e-300
    inverse = pulse.conj() / (np.abs(pulse) ** 2 + floor**2)
    inverse *= np.exp(1j * omega * (lead - direct.lead))
    inverse *= np.exp(-1j * omega * direct.lead) * _band(omega, rows.sample_rate)
    shaped = np.fft.irfft(spectra * inverse, size * STRETCH)
    return shaped[:, : rows.n_samples * STRETCH]


def _band(omega: FloatArray, sample_rate: float) -> FloatArray:
    hertz = omega * sample_rate / (2 * np.pi)
    high = min(HIGH_HZ, 0.4 * sample_rate)
    rise = np.clip(hertz / LOW_HZ, 0, 1)
    fall = np.clip((1.2 * high - hertz) / (0.9 * high), 0, 1)
    return (np.sin(0.5 * np.pi * rise) * np.sin(0.5 * np.pi * fall)) ** 2


def _first_peak(
    sound: FloatArray, begin: int, least: float, ahead: int
) -> float | None:
    here = sound[begin:-1]
    peaks = (here >= sound[begin - 1 : -2]) & (here > sound[begin + 1 :])
    for place in np.flatnonzero(peaks & (here > least))[:40] + begin:
        if sound[place] > SHARE * sound[place : place + ahead].max():
            low, top, high = sound[place - 1 : place + 2]
            bend = low - 2 * top + high
            return place + 0.5 * (low - high) / (bend if bend else 1.0)
    return None
