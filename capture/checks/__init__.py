"""Checks of a take, one per file; each says what it found and why it matters."""

from capture.checks.beginning import check_beginning, check_ending
from capture.checks.clipping import check_clipping
from capture.checks.constant import check_constant
from capture.checks.crosstalk import check_crosstalk
from capture.checks.direct import check_direct
from capture.checks.distortion import check_distortion
from capture.checks.drift import check_drift
from capture.checks.events import check_events
from capture.checks.finite import check_finite
from capture.checks.golden import check_golden
from capture.checks.hum import check_hum
from capture.checks.loopback import check_loopback
from capture.checks.noise import check_noise
from capture.checks.silence import check_silence
from capture.checks.swapped import check_swapped
from capture.checks.sweep import check_sweep
from capture.checks.table import CHECKS, Check
from capture.checks.tail import check_tail
from capture.checks.zeros import check_zeros

__all__ = [
    "CHECKS",
    "Check",
    "check_beginning",
    "check_clipping",
    "check_constant",
    "check_crosstalk",
    "check_direct",
    "check_distortion",
    "check_drift",
    "check_ending",
    "check_events",
    "check_finite",
    "check_golden",
    "check_hum",
    "check_loopback",
    "check_noise",
    "check_silence",
    "check_swapped",
    "check_sweep",
    "check_tail",
    "check_zeros",
]
