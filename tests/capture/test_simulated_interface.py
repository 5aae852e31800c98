import numpy as np
import pytest

from capture.config import SimulationConfig
from capture.interfaces.loudspeaker import drive, loudspeaker_gain
from capture.interfaces.simulated import SimulatedInterface
from capture.signal.sweep import synchronized_sweep

RATE = 16000


class Echo:
    """A world with one direct sound and one echo."""

    def __init__(self) -> None:
        self.response = np.zeros((1, 2000))
        self.response[0, [100, 900]] = 0.5, -0.25

    def responses(self, output: int = 0) -> np.ndarray:
        del output
        return self.response


def sweep() -> np.ndarray:
    played = synchronized_sweep(20, 7500, 1.0, RATE, band=(40, 7000))
    return np.concatenate((np.zeros(2000), np.asarray(played), np.zeros(6000)))


def fade(n: int) -> np.ndarray:
    edge = np.sin(np.linspace(0, np.pi / 2, n // 10)) ** 2
    return np.concatenate((edge, np.ones(n - 2 * len(edge)), edge[::-1]))


def open_interface(**switches: object) -> SimulatedInterface:
    simulation = SimulationConfig.model_validate(switches)
    return SimulatedInterface(Echo(), simulation, sample_rate=RATE, seed=3)


def test_a_whole_latency_shifts_the_exact_convolution() -> None:
    played = sweep()
    take = open_interface(latency_samples=300.0).play_record(
        played, len(played), label="t"
    )
    expected = np.zeros(len(played))
    expected[400:] += 0.5 * played[:-400]
    expected[1200:] -= 0.25 * played[:-1200]
    np.testing.assert_allclose(take.samples[0], expected, atol=1e-12)
    np.testing.assert_allclose(take.samples[1, 300:], played[:-300], atol=1e-12)
    assert np.abs(take.samples[1, :300]).max() < 1e-12


def test_a_fractional_latency_is_a_linear_phase() -> None:
    played = sweep()
    whole, half = (
        open_interface(latency_samples=latency)
        .play_record(played, len(played), label="t")
        .samples[1]
        for latency in (300.0, 300.5)
    )
    n = len(played)
    turned = np.fft.irfft(
        np.fft.rfft(whole) * np.exp(-1j * np.pi * np.fft.rfftfreq(n)), n
    )
    # The band ends at 7500 Hz of 8000, so what little rings past the ends is cut.
    np.testing.assert_allclose(half[1000:-1000], turned[1000:-1000], atol=1e-6)


def test_noise_has_the_level_asked_for_and_belongs_to_the_take() -> None:
    played = sweep()
    interface = open_interface(noise_db=-40.0, latency_samples=300.0)
    clean = open_interface(latency_samples=300.0).play_record(
        played, len(played), label="t"
    )
    first, again, other = (
        interface.play_record(played, len(played), label=label).samples
        for label in ("t", "t", "u")
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first[0], other[0])
    np.testing.assert_array_equal(first[1], other[1])
    noise = first[0] - clean.samples[0]
    level = 20 * np.log10(noise.std() * np.sqrt(2))
    np.testing.assert_allclose(level, -40.0, atol=0.1)


def test_distortion_has_the_levels_asked_for_without_aliases() -> None:
    times = np.arange(RATE) / RATE
    tone = 0.5 * np.sin(2 * np.pi * 1000 * times) * fade(RATE)
    spectrum = np.abs(np.fft.rfft(drive(tone, (-30.0, -40.0)) * np.hanning(RATE)))
    levels = 20 * np.log10(spectrum / spectrum.max())
    np.testing.assert_allclose(levels[[2000, 3000]], [-30, -40], atol=0.5)
    high = 0.5 * np.sin(2 * np.pi * 7000 * times) * fade(RATE)
    spectrum = np.abs(np.fft.rfft(drive(high, (-30.0, -40.0)) * np.hanning(RATE)))
    # 2 · 7000 Hz would fold to 2000 Hz, 3 · 7000 Hz to 5000 Hz.
    assert 20 * np.log10(spectrum[1900:5100].max() / spectrum.max()) < -100


def test_loudspeaker_is_flat_in_the_middle_and_falls_at_the_ends() -> None:
    gain = 20 * np.log10(np.abs(loudspeaker_gain(np.array([20.0, 80.0, 1000.0, 16e3]))))
    np.testing.assert_allclose(gain, [-24.1, -3.0, 0.0, -3.0], atol=0.1)


def test_it_says_that_it_is_simulated() -> None:
    interface = open_interface()
    assert interface.simulated
    assert "SIMULATED" in interface.describe()["name"]
    assert interface.loopback == interface.n_inputs - 1


@pytest.mark.parametrize("n_samples", [1000, 30000])
def test_the_recording_has_the_length_asked_for(n_samples: int) -> None:
    take = open_interface().play_record(sweep(), n_samples, label="t")
    assert take.samples.shape == (2, n_samples)
