"""Measure impulse responses: sweeps, deconvolution, sessions.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from capture.deconvolution.deconvolve import Deconvolution, deconvolve
    from capture.signal.sweep import Sweep, synchronized_sweep

__all__ = ["Deconvolution", "Sweep", "deconvolve", "synchronized_sweep"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "capture.deconvolution.deconvolve": "Deconvolution deconvolve",
        "capture.signal.sweep": "Sweep synchronized_sweep",
    },
)
