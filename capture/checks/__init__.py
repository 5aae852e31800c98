"""Checks of a take, one per file; each says what it found and why it matters."""

from capture.checks import (  # noqa: F401 (enter the table, in this order)
    beginning,
    clipping,
    constant,
    crosstalk,
    direct,
    distortion,
    drift,
    events,
    finite,
    golden,
    hum,
    loopback,
    noise,
    silence,
    swapped,
    sweep,
    tail,
    zeros,
)
from capture.checks.table import CHECKS, Check

__all__ = ["CHECKS", "Check"]
