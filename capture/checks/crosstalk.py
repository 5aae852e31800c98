"""Electrical copies of the output in a microphone channel."""

from collections.abc import Iterator

import numpy as np

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_crosstalk"]

SPIKE_S = 0.0001  # 5 samples at 48 kHz: the width of a band-limited pulse
CLEAR_S = 0.0005  # the pulse's own ringing above 500 Hz is over by then
NEAREST_S = 0.002
"""A direct sound earlier than this cannot be told from a copy of the output."""
LOOK_S = 0.06  # direct sound from up to 20 m
LOW_HZ, HIGH_HZ = 500.0, 2000.0  # below, the band's lower edge rings into time zero
FEWEST = 32  # samples for a root mean square within 1 dB
ABOVE = 8.0  # 18 dB: noise of a thousand samples peaks at 12 dB over its rms


@CHECKS.add("crosstalk")
def check_crosstalk(take: Evidence) -> Iterator[Finding]:
    """Mark a spike at time zero, before any sound can have arrived.

    It must stand out of what else lies before the direct sound: noise, and the
    ringing of the band's edges, which a high-pass shortens.
    """
    levels: list[float | None] = [None] * len(take.response)
    take.figures["crosstalk_db"] = levels
    if take.cable is None or take.swapped:
        return
    for channel in np.flatnonzero(take.finite & (take.peaks > 0)):
        found = _spike(take, int(channel))
        if found is None:
            continue
        level, contrast = found
        levels[channel] = round(level, 1)
        if contrast < ABOVE or level < take.limits.crosstalk_db:
            continue
        yield Finding(
            "crosstalk",
            False,
            f"channel {channel} has a copy of the output at time zero, "
            f"{level:.0f} dB relative to the direct sound",
            level,
            take.limits.crosstalk_db,
            "dB",
            int(channel),
        )


def _spike(take: Evidence, channel: int) -> tuple[float, float] | None:
    """Return level re direct sound [dB] and contrast of what stands at time zero."""
    rate, pre = take.sample_rate, take.reference.excitation.pre
    look = take.response[channel, : pre + round(LOOK_S * rate)]
    size = np.abs(_high_passed(look, rate))
    later = pre + round(NEAREST_S * rate)
    if size.size <= later or not np.any(size):
        return None
    direct = later + int(np.argmax(size[later:]))
    spike, clear = max(round(SPIKE_S * rate), 2), max(round(CLEAR_S * rate), 8)
    # The direct sound rings before itself, so that only its earlier half is quiet.
    top = size[max(pre - spike, 0) : pre + spike + 1].max()
    early = size[max(pre - 20 * clear, 0) : max(pre - clear, 0)]
    late = size[pre + clear : pre + max((direct - pre) // 2, clear)]
    around = np.concatenate((early, late))
    if around.size < FEWEST or top >= size[direct]:
        return None
    usual = np.sqrt(np.mean(around**2))
    contrast = float(top / max(usual, 1e-300))
    return float(20 * np.log10(max(top / size[direct], 1e-30))), contrast


def _high_passed(row: np.ndarray, rate: float) -> np.ndarray:
    """Return a row without what rings long, in zero phase."""
    n = 2 * row.size
    f = np.fft.rfftfreq(n, 1 / rate)
    rise = np.log(np.maximum(f, 1e-9) / LOW_HZ) / np.log(HIGH_HZ / LOW_HZ)
    gain = np.sin(np.pi / 2 * np.clip(rise, 0, 1)) ** 2
    return np.fft.irfft(np.fft.rfft(row, n) * gain, n)[: row.size]
