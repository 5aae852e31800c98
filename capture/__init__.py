"""Measure impulse responses: sweeps, deconvolution, sessions.

Names are loaded on first use, so that commands start fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from capture.deconvolution import Deconvolution, deconvolve
    from capture.sweep import Sweep, synchronized_sweep

_HOMES = {
    "Deconvolution": "capture.deconvolution",
    "Sweep": "capture.sweep",
    "deconvolve": "capture.deconvolution",
    "synchronized_sweep": "capture.sweep",
}

__all__ = ["Deconvolution", "Sweep", "deconvolve", "synchronized_sweep"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'capture' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
