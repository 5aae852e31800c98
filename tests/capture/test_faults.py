import numpy as np
import pytest

from capture.config import SimulationConfig
from capture.faults import FAULTS, TakeFault, spoil
from capture.interfaces.simulated import SimulatedInterface
from capture.signal.resample import evaluate_stretched
from rir import InterfaceError

RATE = 16000
N = 8000


def take(kind: str, **more: object) -> tuple[np.ndarray, np.ndarray]:
    """Return a clean two-channel take and the same with one fault."""
    times = np.arange(N) / RATE
    tone = 0.5 * np.sin(2 * np.pi * 700 * times)
    clean = np.stack((0.3 * np.roll(tone, 50), tone))
    fault = TakeFault.model_validate({"kind": kind, "at_s": 0.25, **more})
    spoiled = spoil(
        clean,
        [fault],
        take="P01_AB_1",
        seed=0,
        sample_rate=RATE,
        played=tone,
        level=0.5 / np.sqrt(2),
    )
    return clean, spoiled


@pytest.mark.parametrize("kind", sorted(set(FAULTS) - {"vanish"}))
def test_every_fault_changes_a_take_and_only_takes_it_hits(kind: str) -> None:
    clean, spoiled = take(kind, amount=3.0)
    assert spoiled.shape == clean.shape
    assert np.isfinite(spoiled).all()
    assert not np.array_equal(clean, spoiled)
    clean, same = take(kind, amount=3.0, takes="P02_*")
    np.testing.assert_array_equal(clean, same)


@pytest.mark.parametrize("kind", ["gain", "white", "dc", "lost", "clip"])
def test_a_fault_of_one_channel_leaves_the_others(kind: str) -> None:
    clean, spoiled = take(kind, amount=3.0, channel=-1)
    np.testing.assert_array_equal(clean[0], spoiled[0])
    assert not np.array_equal(clean[1], spoiled[1])


def test_gaps_have_their_lengths() -> None:
    clean, lost = take("lost", amount=3)
    np.testing.assert_array_equal(lost[:, 4000:-3], clean[:, 4003:])
    clean, inserted = take("inserted", amount=3)
    np.testing.assert_array_equal(inserted[:, 4003:], clean[:, 4000:-3])
    clean, repeated = take("repeated", amount=3)
    np.testing.assert_array_equal(repeated[:, 4003:], clean[:, 4000:-3])
    _, zeroed = take("zeroed", amount=8)
    assert not zeroed[:, 4000:4008].any()
    _, dead = take("dead")
    assert not dead[:, 4000:].any()


def test_levels_are_as_stated() -> None:
    clean, louder = take("gain", amount=0.1)
    np.testing.assert_allclose(louder, clean * 10 ** (0.1 / 20))
    clean, clipped = take("clip", amount=1.0)
    np.testing.assert_allclose(
        clipped.max(axis=1), clean.max(axis=1) * 10 ** (-1 / 20), rtol=1e-3
    )
    clean, noisy = take("pink", amount=-20.0)
    rms = np.sqrt(np.mean((noisy - clean) ** 2, axis=-1))
    np.testing.assert_allclose(20 * np.log10(rms * np.sqrt(2) / 0.5), -20.0, atol=0.01)
    clean, knocked = take("knock", amount=-10.0)
    rms = np.sqrt(np.mean((knocked - clean)[0, 4000 : 4000 + 2400] ** 2))
    np.testing.assert_allclose(20 * np.log10(rms * np.sqrt(2) / 0.5), -10.0, atol=0.01)


def test_a_vanishing_device_raises() -> None:
    with pytest.raises(InterfaceError, match="vanished 0.25 s into the take"):
        take("vanish")


def test_unknown_faults_are_told() -> None:
    with pytest.raises(ValueError, match="known: drift, agc"):
        TakeFault(kind="gremlin")


@pytest.mark.parametrize("ppm", [-50.0, 1.0, 100.0])
def test_drift_is_the_signal_at_other_times(ppm: float) -> None:
    n, eps = 4096, 1e-6 * ppm
    rng = np.random.default_rng(0)
    bins = rng.integers(1, n // 2 - 100, 40)
    phases = rng.uniform(0, 2 * np.pi, 40)

    def signal(times: np.ndarray) -> np.ndarray:
        turns = 2 * np.pi * np.outer(bins, times) / n + phases[:, None]
        return np.cos(turns).sum(axis=0)

    spectrum = np.fft.rfft(signal(np.arange(n)))
    times = np.arange(4000)
    np.testing.assert_allclose(
        evaluate_stretched(spectrum, n, 4000, eps),
        signal((1 + eps) * times),
        atol=1e-9,
    )


def test_drift_moves_microphones_and_loopback_alike() -> None:
    class Open:
        def responses(self, output: int = 0) -> np.ndarray:
            del output
            return np.eye(1, 100)

    drift = TakeFault(kind="drift", amount=80.0)
    simulation = SimulationConfig(faults=(drift,), latency_samples=10.0)
    interface = SimulatedInterface(Open(), simulation, sample_rate=RATE)
    signal = np.pad(np.hanning(2000) * np.sin(np.arange(2000) * 0.3), (500, 1500))
    samples = interface.play_record(signal, 4000, label="t").samples
    np.testing.assert_allclose(samples[0], samples[1], atol=1e-12)
    clean = SimulatedInterface(
        Open(), SimulationConfig(latency_samples=10.0), sample_rate=RATE
    )
    steady = clean.play_record(signal, 4000, label="t").samples
    # At sample 1500 the clocks are 0.12 samples apart.
    slope = np.gradient(steady[1])
    expected = steady[1] + 80e-6 * np.arange(4000) * slope
    np.testing.assert_allclose(samples[1], expected, atol=2e-3)
