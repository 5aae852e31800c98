"""Real audio hardware through PortAudio, held in a process that can be killed."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.config import SessionConfig
from capture.interfaces.process import AudioProcess
from capture.interfaces.protocol import Recording
from capture.interfaces.stream import DeviceRow, StreamSettings
from capture.interfaces.table import INTERFACES, InterfaceKind, InterfaceSurroundings
from rir import InterfaceError

__all__ = ["PortAudioInterface", "find_devices"]


class PortAudioInterface:
    """One persistent stream on one device; its latency stays what it is.

    Parameters
    ----------
    settings : StreamSettings
        Device, rate and channels.
    loopback : int or None
        Which of the recorded channels is the loopback (from 0).
    stall_s : float
        Longest time without samples before a take is given up [s].
    on_progress : callable, optional
        Told how many samples of a take are recorded.

    Raises
    ------
    InterfaceError
        If the device does not do exactly what was asked.
    """

    simulated = False

    def __init__(
        self,
        settings: StreamSettings,
        *,
        loopback: int | None = None,
        stall_s: float = 3.0,
        on_progress: Callable[[int], None] | None = None,
    ) -> None:
        self.settings = settings
        self.sample_rate = settings.sample_rate
        self.n_inputs = len(settings.inputs)
        self.loopback = loopback
        self._process = AudioProcess(stall_s=stall_s, on_progress=on_progress)
        try:
            self._device: DeviceRow = self._process.ask("open", asdict(settings))
        except BaseException:
            self._process.kill()
            raise

    def play_record(
        self,
        signal: NDArray[np.float64],
        n_samples: int,
        *,
        label: str,
        output: int = 0,
    ) -> Recording:
        """Play on one output and record all inputs from the same instant."""
        del label
        samples, flags, detail = self._process.take(signal, n_samples, output)
        return Recording(samples, self.sample_rate, flags, detail)

    def describe(self) -> dict[str, Any]:
        """Return the device and how it was opened."""
        return {
            "name": self._device.name,
            "simulated": False,
            "device": asdict(self._device),
            "settings": asdict(self.settings),
        }

    def close(self) -> None:
        """End the stream and its process; never hangs."""
        self._process.close()


def find_devices() -> list[DeviceRow]:
    """Return the audio devices there are now, asked in a fresh process.

    Raises
    ------
    MissingPartError
        If sounddevice or PortAudio is not installed.
    """
    process = AudioProcess()
    try:
        return process.ask("list")
    finally:
        process.close()


def _open(config: SessionConfig, around: InterfaceSurroundings) -> PortAudioInterface:
    if config.device is None:
        raise InterfaceError(
            "name the audio device (--device); capture-pairs devices shows them"
        )
    channels = config.channels
    settings = StreamSettings(
        config.device.name,
        config.device.host_api,
        config.sample_rate,
        tuple(channels.inputs),
        channels.loudspeakers,
        channels.loopback_output,
        config.device.block,
        config.device.latency_s,
    )
    return PortAudioInterface(
        settings,
        loopback=len(channels.microphones) if channels.loopback else None,
        stall_s=config.device.stall_s,
        on_progress=around.on_progress,
    )


INTERFACES.add("portaudio")(
    InterfaceKind("audio hardware through PortAudio (ALSA, ASIO, JACK, …)", _open)
)
