from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from capture.interfaces.portaudio import PortAudioInterface, find_devices
from capture.interfaces.stream import StreamSettings
from rir import InterfaceError

pytestmark = pytest.mark.jack

JACK = "JACK Audio Connection Kit"
StartJack = Callable[..., Any]


@contextmanager
def opened(
    device: str, inputs: tuple[int, ...], outputs: tuple[int, ...], **more: Any
) -> Iterator[PortAudioInterface]:
    rate = more.pop("sample_rate", 48000)
    settings = StreamSettings(device, JACK, rate, inputs, outputs)
    interface = PortAudioInterface(settings, **more)
    try:
        yield interface
    finally:
        interface.close()


def noise(n: int) -> np.ndarray:
    samples = np.random.default_rng(0).uniform(-1, 1, n).astype(np.float32)
    return samples.astype(float)


@pytest.mark.parametrize(("channels", "ports"), [(8, 256), (64, 1024)])
def test_the_loop_is_bit_exact_after_a_constant_delay(
    start_jack: StartJack, channels: int, ports: int
) -> None:
    start_jack(channels=channels, ports=ports)
    signal = noise(20000)
    monitors = tuple(range(channels + 1, 2 * channels + 1))
    chosen = (0, channels // 2, channels - 1)
    lags = set()
    with opened("system", monitors, tuple(range(1, channels + 1))) as interface:
        for output in chosen:
            take = interface.play_record(signal, 24000, label="t", output=output)
            heard = take.samples[output]
            lag = int(np.flatnonzero(heard)[0] - np.flatnonzero(signal)[0])
            lags.add(lag)
            np.testing.assert_array_equal(heard[lag : lag + 20000], signal)
            assert not np.delete(take.samples, output, axis=0).any()
            assert take.flags == []
    assert lags == {1024}


def test_channels_are_the_ones_named(start_jack: StartJack) -> None:
    start_jack(channels=8)
    signal = noise(5000)
    with opened("system", (13, 10), (5, 2)) as interface:
        first = interface.play_record(signal, 8000, label="t", output=0).samples
        second = interface.play_record(signal, 8000, label="t", output=1).samples
    assert first[0].any()
    assert not first[1].any()
    assert second[1].any()
    assert not second[0].any()


def test_a_loopback_output_plays_along(start_jack: StartJack) -> None:
    start_jack(channels=8)
    settings = StreamSettings("system", JACK, 48000, (9, 16), (1,), loopback_output=8)
    interface = PortAudioInterface(settings, loopback=1)
    take = interface.play_record(noise(3000), 6000, label="t")
    interface.close()
    np.testing.assert_array_equal(take.samples[0], take.samples[1])
    assert take.samples.any()


def test_devices_are_listed_afresh(start_jack: StartJack) -> None:
    server = start_jack()
    assert "room" not in {row.name for row in find_devices()}
    server.start_room(["/impulse/dirac 1 1 1 0"], 1, 1)
    assert "room" in {row.name for row in find_devices()}


@pytest.mark.parametrize(
    ("device", "inputs", "more", "message"),
    [
        ("sistem", (1,), {}, "no audio device 'sistem' on JACK.*there are: .*system"),
        ("system", (17,), {}, "has 16 inputs; channel 17 was asked for"),
        ("system", (1,), {"sample_rate": 44100}, "does not run at 44100 Hz.*48000 Hz"),
    ],
)
def test_what_the_device_cannot_do_is_refused(
    start_jack: StartJack,
    device: str,
    inputs: tuple[int, ...],
    more: dict[str, Any],
    message: str,
) -> None:
    start_jack()
    with (
        pytest.raises(InterfaceError, match=message),
        opened(device, inputs, (1,), **more),
    ):
        pass


@pytest.mark.parametrize("death", ["terminate", "kill"])
def test_a_dead_server_ends_the_take_in_time_and_closing_does_not_hang(
    start_jack: StartJack, death: str
) -> None:
    server = start_jack()
    with opened("system", (9,), (1,), stall_s=1.0) as interface:
        getattr(server.server, death)()
        server.server.wait()
        with pytest.raises(InterfaceError, match="audio stream stopped|has gone"):
            interface.play_record(noise(48000), 48000, label="t")


def test_a_killed_worker_is_told(start_jack: StartJack) -> None:
    start_jack()
    with opened("system", (9,), (1,)) as interface:
        interface._process._process.kill()
        with pytest.raises(InterfaceError, match="ended by itself"):
            interface.play_record(noise(4800), 4800, label="t")


def test_all_outputs_can_play_in_one_take(start_jack: StartJack) -> None:
    start_jack(channels=8)
    signals = np.stack((noise(4000), np.roll(noise(4000), 99)))
    with opened("system", (9, 11), (1, 3)) as interface:
        take = interface.play_record(signals, 6000, label="t").samples
    for heard, signal in zip(take, signals, strict=True):
        lag = int(np.argmax(heard != 0))
        np.testing.assert_array_equal(heard[lag : lag + 4000], signal)
