"""One full-duplex PortAudio stream and its callback. The only user of sounddevice.

Runs in a process of its own (see `capture.interfaces.worker`), because a dead audio
server can hang any call into PortAudio for ever.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import InterfaceError, MissingPartError

__all__ = ["DeviceRow", "DuplexStream", "StreamSettings", "list_devices"]

Samples = NDArray[np.float32]
RESAMPLING_HOSTS = ("MME", "Windows DirectSound")
RESAMPLING_DEVICES = ("pulse", "default", "sysdefault", "dmix", "pipewire")


@dataclass(frozen=True)
class StreamSettings:
    """What a stream is opened with.

    Attributes
    ----------
    device : str
        Name of the one device that plays and records.
    host_api : str or None
        Name of its host API; needed when several offer the same name.
    sample_rate : int
        Rate [Hz].
    inputs, outputs : tuple of int
        Channels used, counted from 1 as on the box.
    loopback_output : int or None
        An output that plays every signal too, for the loopback cable.
    block : int
        Frames per callback; 0 leaves the choice to the host.
    latency : float
        Suggested latency [s].
    """

    device: str
    host_api: str | None
    sample_rate: int
    inputs: tuple[int, ...]
    outputs: tuple[int, ...]
    loopback_output: int | None = None
    block: int = 0
    latency: float = 0.2

    @property
    def highest_output(self) -> int:
        """The highest output used."""
        return max((*self.outputs, self.loopback_output or 1))


@dataclass(frozen=True)
class DeviceRow:
    """What PortAudio says of one device."""

    name: str
    host_api: str
    inputs: int
    outputs: int
    default_rate: float
    index: int


def _sounddevice() -> Any:
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise MissingPartError(
            "audio hardware needs sounddevice and PortAudio: pip install sounddevice, "
            "and on Debian or Ubuntu apt install libportaudio2"
        ) from error
    return sounddevice


def list_devices() -> list[DeviceRow]:
    """Return the devices PortAudio sees now.

    Raises
    ------
    MissingPartError
        If sounddevice or PortAudio is not installed.
    """
    sd = _sounddevice()
    hosts = [host["name"] for host in sd.query_hostapis()]
    return [
        DeviceRow(
            device["name"],
            hosts[device["hostapi"]],
            device["max_input_channels"],
            device["max_output_channels"],
            device["default_samplerate"],
            index,
        )
        for index, device in enumerate(sd.query_devices())
    ]


def choose_device(rows: list[DeviceRow], settings: StreamSettings) -> DeviceRow:
    """Return the device that the settings name.

    Raises
    ------
    InterfaceError
        If there is none or more than one, if it cannot both play and record, or if
        it would resample without saying so.

    Examples
    --------
    >>> rows = [DeviceRow("box", "ALSA", 2, 2, 48000.0, 0)]
    >>> settings = StreamSettings("bos", None, 48000, (1,), (1,))
    >>> choose_device(rows, settings)
    Traceback (most recent call last):
    rir.errors.InterfaceError: no audio device 'bos'; there are: box (ALSA, 2 in, 2 out)
    """
    named = [
        row
        for row in rows
        if row.name == settings.device and settings.host_api in (None, row.host_api)
    ]
    if not named:
        known = "; ".join(
            f"{row.name} ({row.host_api}, {row.inputs} in, {row.outputs} out)"
            for row in rows
        )
        host = f" on {settings.host_api}" if settings.host_api else ""
        raise InterfaceError(
            f"no audio device {settings.device!r}{host}; there are: {known or 'none'}"
        )
    if len(named) > 1:
        hosts = ", ".join(row.host_api for row in named)
        raise InterfaceError(
            f"{len(named)} devices are called {settings.device!r}; "
            f"name one host API: {hosts}"
        )
    _refuse_unfit(named[0], settings)
    return named[0]


def _refuse_unfit(row: DeviceRow, settings: StreamSettings) -> None:
    need = {"inputs": max(settings.inputs), "outputs": settings.highest_output}
    for what, least in need.items():
        have = getattr(row, what)
        if have == 0:
            raise InterfaceError(
                f"{row.name} has no {what}; playing on one device and recording on "
                "another drifts, so choose a device that does both"
            )
        if have < least:
            raise InterfaceError(
                f"{row.name} has {have} {what}; channel {least} was asked for"
            )
    resampling = row.host_api in RESAMPLING_HOSTS or row.name in RESAMPLING_DEVICES
    if resampling:
        raise InterfaceError(
            f"{row.name} ({row.host_api}) resamples and mixes without saying so; "
            "choose the hardware itself (ASIO, WASAPI, Core Audio, ALSA hw, JACK)"
        )


class DuplexStream:
    """A running stream that plays takes on demand and counts every frame.

    Parameters
    ----------
    settings : StreamSettings
        What to open.

    Raises
    ------
    InterfaceError
        If the device does not do what was asked.
    """

    def __init__(self, settings: StreamSettings) -> None:
        sd = _sounddevice()
        self.settings = settings
        self.device = choose_device(list_devices(), settings)
        self.frames = 0
        self._columns = [channel - 1 for channel in settings.inputs]
        self._take: _Take | None = None
        self._stopping = sd.CallbackStop
        channels = max(settings.inputs), settings.highest_output
        try:
            self._stream: Any = sd.Stream(
                samplerate=settings.sample_rate,
                blocksize=settings.block,
                device=(self.device.index, self.device.index),
                channels=channels,
                dtype="float32",
                latency=settings.latency,
                extra_settings=_exclusive(sd, self.device.host_api),
                callback=self._callback,
                clip_off=True,
                dither_off=True,
                prime_output_buffers_using_stream_callback=False,
            )
            self._stream.start()
        except sd.PortAudioError as error:
            raise InterfaceError(
                f"{self.device.name} does not run at {settings.sample_rate} Hz with "
                f"{channels[0]} inputs and {channels[1]} outputs: {error}; its own "
                f"rate is {self.device.default_rate:g} Hz"
            ) from error

    def begin(self, signal: Samples, n_samples: int, output: int) -> None:
        """Start a take at the next block.

        Parameters
        ----------
        signal : ndarray, shape (outputs, n)
            What to play; the first row goes to the loopback's output too.
        n_samples : int
            How many samples to record.
        output : int
            Which of the outputs plays (from 0).
        """
        rows = {
            channel - 1: row
            for channel, row in zip(
                self.settings.outputs[output:], signal, strict=False
            )
        }
        if self.settings.loopback_output is not None:
            rows[self.settings.loopback_output - 1] = signal[0]
        self._take = _Take(rows, n_samples, len(self._columns))

    @property
    def taken(self) -> int:
        """How many frames of the take are recorded."""
        return self._take.done if self._take else 0

    def result(self) -> tuple[Samples, list[str], dict[str, Any]] | None:
        """Return samples (channels, n), flags and detail of a finished take."""
        take = self._take
        if take is None or take.done < take.n_samples:
            return None
        self._take = None
        detail = {**asdict(self.device), "blocks": take.blocks}
        return take.recorded, take.flags, detail

    def _callback(
        self, heard: Samples, played: Samples, frames: int, times: Any, status: Any
    ) -> None:
        del times
        self.frames += frames
        played[:] = 0.0
        take = self._take
        if take is not None and take.done < take.n_samples:
            if status:
                take.flags.append(f"{_words(status)} at sample {take.done}")
            take.exchange(heard, played, frames, self._columns)

    def close(self) -> None:
        """Stop and close; may hang if the audio server has died."""
        self._stream.abort()
        self._stream.close()


class _Take:
    """Buffers of one take, all made before the first block."""

    def __init__(
        self, rows: dict[int, Samples], n_samples: int, n_channels: int
    ) -> None:
        self.rows = rows
        self.n_samples = n_samples
        self.recorded = np.zeros((n_channels, n_samples), dtype=np.float32)
        self.flags: list[str] = []
        self.blocks = 0
        self.done = 0

    def exchange(
        self, heard: Samples, played: Samples, frames: int, columns: list[int]
    ) -> None:
        """Play and record one block."""
        start = self.done
        stop = min(start + frames, self.n_samples)
        for column, row in self.rows.items():
            part = row[start:stop]
            played[: len(part), column] = part
        self.recorded[:, start:stop] = heard[: stop - start, columns].T
        self.blocks += 1
        self.done = stop


def _words(status: Any) -> str:
    """Return what a callback status complains of."""
    names = ("input_underflow", "input_overflow", "output_underflow", "output_overflow")
    return ", ".join(name.replace("_", " ") for name in names if getattr(status, name))


def _exclusive(sd: Any, host_api: str) -> Any:
    """Forbid WASAPI to convert rates: exclusive mode plays samples as they are."""
    if "WASAPI" not in host_api:
        return None
    return sd.WasapiSettings(exclusive=True, auto_convert=False)
