"""What every audio interface promises; run it on your own."""

import inspect
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.interfaces.protocol import AudioInterface
from rir.conformance import promise

__all__ = ["DirectWorld", "check_interface", "check_interface_type"]


class DirectWorld:
    """A world that answers with the direct sound alone, for simulated interfaces."""

    def responses(self, output: int = 0) -> NDArray[np.float64]:
        """Return one listener's response: a unit sample, shape (1, 64)."""
        del output
        return np.eye(1, 64)


def check_interface_type(kind: type[Any]) -> None:
    """Check without a device that a class has what an audio interface needs.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    asked = list(inspect.signature(AudioInterface.play_record).parameters)
    had = list(inspect.signature(kind.play_record).parameters)
    promise(had == asked, f"play_record takes {', '.join(asked)}; not {', '.join(had)}")
    for member in ("describe", "close"):
        promise(callable(getattr(kind, member, None)), f"it has {member}")
    promise(isinstance(kind.simulated, bool), "it says whether it is simulated")


def check_interface(interface: AudioInterface) -> None:
    """Play and record once through an open interface, and close it.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    check_interface_type(type(interface))
    promise(isinstance(interface, AudioInterface), "it keeps the protocol in full")
    signal = np.zeros(4000)
    signal[100:2000] = np.hanning(1900)
    take = interface.play_record(signal, 5000, label="t")
    whole = take.samples.shape == (interface.n_inputs, 5000)
    promise(whole, "a take has every input and as many samples as asked for")
    promise(take.sample_rate == interface.sample_rate, "a take has its rate")
    interface.close()
