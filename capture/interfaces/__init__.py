"""Audio interfaces: things that play a signal and record what comes back."""

from capture.interfaces import portaudio, simulated  # noqa: F401 (enter the table)
from capture.interfaces.protocol import AudioInterface, Recording
from capture.interfaces.table import INTERFACES, InterfaceKind, InterfaceSurroundings

__all__ = [
    "INTERFACES",
    "AudioInterface",
    "InterfaceKind",
    "InterfaceSurroundings",
    "Recording",
]
