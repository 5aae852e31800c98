"""Measure impulse responses: sweeps, deconvolution, sessions.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from capture.deconvolution.deconvolve import Deconvolution, deconvolve
    from capture.session.engine import Session
    from capture.session.folder import SessionFolder
    from capture.session.run import run_session
    from capture.session.start import SessionRequest, plan_session
    from capture.signal.sweep import Sweep, synchronized_sweep

__all__ = [
    "Deconvolution",
    "Session",
    "SessionFolder",
    "SessionRequest",
    "Sweep",
    "deconvolve",
    "plan_session",
    "run_session",
    "synchronized_sweep",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "capture.deconvolution.deconvolve": "Deconvolution deconvolve",
        "capture.session.engine": "Session",
        "capture.session.folder": "SessionFolder",
        "capture.session.run": "run_session",
        "capture.session.start": "SessionRequest plan_session",
        "capture.signal.sweep": "Sweep synchronized_sweep",
    },
)
