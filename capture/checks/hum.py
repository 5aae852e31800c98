"""Lines of the mains in the quiet parts of a recording."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_hum", "quiet_part"]

SHORTEST_S = 0.15  # resolves 7 Hz: enough to part a line from the 75 Hz and up
LOWEST_HZ, HIGHEST_HZ = 40.0, 70.0  # mains are 50 or 60 Hz, with room for error
CONTRAST_DB = 12.0  # over the median around: noise lines reach 9 dB
LOUD_DB = -50.0  # re the take: a weaker line leaves 50 dB of range
COARSE_HZ = 2000.0  # rate that keeps 400 Hz and makes transforms short


@CHECKS.add("hum")
def check_hum(take: Evidence) -> Iterator[Finding]:
    """Name hum before the sweep or after its decay; a mark only.

    Looked for between 40 and 70 Hz, where the response often is not wanted anyway:
    the figure tells how far the recording can be trusted there.
    """
    quiet = quiet_part(take)
    size = quiet.shape[1]
    tones: list[float | None] = [None] * len(quiet)
    levels: list[float | None] = [None] * len(quiet)
    take.figures["hum_hz"], take.figures["hum_db"] = tones, levels
    if size < SHORTEST_S * take.sample_rate:
        return
    # Sums over blocks are enough of a low-pass for lines of 70 Hz.
    block = max(int(take.sample_rate / COARSE_HZ), 1)
    size //= block
    coarse = quiet[:, : size * block].reshape(len(quiet), size, block).mean(axis=2)
    window = np.hanning(size)
    n = 4 * size
    spectra = np.abs(
        np.fft.rfft((coarse - coarse.mean(axis=1, keepdims=True)) * window, n)
    )
    f = np.fft.rfftfreq(n, block / take.sample_rate)
    inside = np.flatnonzero((f >= LOWEST_HZ) & (f <= HIGHEST_HZ))
    around = np.flatnonzero((f >= 75) & (f <= 400))
    power = np.einsum("cn,cn->c", take.recording, take.recording)
    rms = np.sqrt(power / take.recording.shape[1])
    for channel, row in enumerate(spectra):
        peak = inside[np.argmax(row[inside])]
        amplitude = 2 * row[peak] / window.sum()
        contrast = 20 * np.log10(row[peak] / max(np.median(row[around]), 1e-30) + 1e-30)
        level = 20 * np.log10(amplitude / 2**0.5 / max(rms[channel], 1e-30) + 1e-30)
        levels[channel] = round(float(level), 1)
        if contrast < CONTRAST_DB or level < LOUD_DB:
            continue
        tones[channel] = round(float(f[peak]), 1)
        yield Finding(
            "hum",
            False,
            f"channel {channel} has hum at {f[peak]:.0f} Hz, {level:.1f} dB relative "
            "to the take: do not trust the response near it",
            float(level),
            LOUD_DB,
            "dB",
            channel,
        )


def quiet_part(take: Evidence) -> np.ndarray:
    """Return the longer of the parts before the sweep and after its decay."""
    before = take.recording[:, : max(int(take.latency), 0)]
    decay = np.nanmedian(take.noise.knee) if np.any(np.isfinite(take.noise.knee)) else 1
    end = take.latency + take.reference.excitation.n_played
    after = take.recording[:, int(end + min(decay, 1.0) * take.sample_rate) :]
    return before if before.shape[1] >= after.shape[1] else after
