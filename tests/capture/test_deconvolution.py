"""Recovered responses against known ones."""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from capture import Deconvolution, deconvolve, synchronized_sweep
from capture.signal.resample import evaluate_stretched
from rir.errors import SignalError

Array = NDArray[np.float64]
RATE = 48000
BAND = (50.0, 18000.0)
DATA = Path(os.environ.get("RESOUNDING_DATA", "../shared/data"))
REAL = DATA / "pyfar_loopback_sweep"


@pytest.fixture(scope="module")
def sweep() -> Array:
    return synchronized_sweep(25, 21000, 1.0, RATE, band=BAND)


@pytest.fixture(scope="module")
def rooms() -> Array:
    rng = np.random.default_rng(5)
    n = RATE // 4
    rooms = rng.standard_normal((3, n)) * np.exp(-np.arange(n) / (0.03 * RATE))
    rooms[:, :200] = 0
    rooms[:, 200] = 10
    return 0.02 * rooms


def played_in(sweep: Array, room: Array, n: int) -> Array:
    size = 1 << 18
    whole = np.fft.irfft(np.fft.rfft(sweep, size) * np.fft.rfft(room, size), size)
    return whole[..., :n]


def delayed(signal: Array, samples: float, drift: float = 0.0) -> Array:
    size = 4 * signal.size
    spectrum = np.fft.rfft(signal, size)
    turn = np.exp(-2j * np.pi * (1 + drift) * samples * np.arange(spectrum.size) / size)
    return evaluate_stretched(spectrum * turn, size, signal.size, drift)


def error_db(response: Array, truth: Array, pre: int) -> float:
    wanted = np.zeros(response.shape)
    n = min(truth.shape[-1], response.shape[-1] - pre)
    wanted[..., pre : pre + n] = truth[..., :n]
    size = 2 * response.shape[-1]
    f = np.fft.rfftfreq(size, 1 / RATE)
    inside = (f > BAND[0]) & (f < BAND[1])
    off = np.fft.rfft(response - wanted, size)[..., inside]
    return 20 * np.log10(
        np.linalg.norm(off) / np.linalg.norm(np.fft.rfft(wanted, size)[..., inside])
    )


def recover(sweep: Array, take: Array, loopback: Array | None = None) -> Deconvolution:
    return deconvolve(
        take, sweep, RATE, loopback=loopback, band=BAND, length=16000, pre=2400
    )


def test_a_clean_take_gives_the_room(sweep: Array, rooms: Array) -> None:
    n = sweep.size + RATE
    result = recover(sweep, played_in(sweep, rooms[0], n))
    assert result.response.shape == (18400,)
    assert result.flags == ()
    assert np.isnan(result.latency)
    assert error_db(result.response, rooms[0], 2400) < -90


def test_a_fractional_latency_is_removed_by_the_loopback(
    sweep: Array, rooms: Array
) -> None:
    n = sweep.size + RATE
    takes = delayed(played_in(sweep, rooms[0], n), 345.37)
    cable = delayed(np.pad(np.asarray(sweep), (0, RATE)), 345.37)
    result = recover(sweep, takes, cable)
    assert result.flags == ()
    np.testing.assert_allclose(result.latency, 345.37, atol=1e-3)
    assert error_db(result.response, rooms[0], 2400) < -85


@pytest.mark.parametrize("ppm", [-30.0, 1.0, 100.0])
def test_drift_is_measured_and_corrected(
    sweep: Array, rooms: Array, ppm: float
) -> None:
    n = sweep.size + RATE
    take = delayed(played_in(sweep, rooms[0], n), 20, 1e-6 * ppm)
    cable = delayed(np.pad(np.asarray(sweep), (0, RATE)), 20, 1e-6 * ppm)
    result = recover(sweep, take, cable)
    np.testing.assert_allclose(result.drift_ppm, ppm, atol=0.02)
    assert "clock_drift" in result.marks
    assert result.flags == ()
    assert error_db(result.response, rooms[0], 2400) < -70


def test_many_channels_are_as_exact_as_one(sweep: Array, rooms: Array) -> None:
    n = sweep.size + RATE // 2
    take = np.tile(played_in(sweep, rooms, n), (4, 1))[:11]
    together = recover(sweep, take).response
    alone = recover(sweep, take[7]).response
    np.testing.assert_allclose(together[7], alone, atol=1e-12 * np.abs(alone).max())


def test_dividing_without_checks_gives_the_same_responses(
    sweep: Array, rooms: Array
) -> None:
    take = played_in(sweep, rooms, sweep.size + RATE)
    loopback = np.pad(np.asarray(sweep), (0, RATE))
    options = {"loopback": loopback, "band": BAND, "length": 16000, "pre": 2400}
    judged = deconvolve(take, sweep, RATE, **options)
    plain = deconvolve(take, sweep, RATE, checks=False, **options)
    np.testing.assert_array_equal(plain.response, judged.response)
    assert plain.latency == judged.latency
    assert (plain.flags, plain.marks, plain.figures) == ((), (), {})


def test_noise_of_the_loopback_does_not_enter(sweep: Array, rooms: Array) -> None:
    rng = np.random.default_rng(1)
    n = sweep.size + RATE
    cable = np.pad(np.asarray(sweep), (0, RATE))
    cable = cable + 1e-3 * np.std(cable) * rng.standard_normal(n)
    result = recover(sweep, played_in(sweep, rooms[0], n), cable)
    assert error_db(result.response, rooms[0], 2400) < -64


def test_a_bad_take_of_four_is_left_out(sweep: Array, rooms: Array) -> None:
    rng = np.random.default_rng(2)
    n = sweep.size + RATE
    clean = played_in(sweep, rooms, n)
    takes = np.stack([clean + 1e-4 * rng.standard_normal(clean.shape) for _ in "abcd"])
    takes[2] = np.roll(takes[2], -64, axis=-1)
    result = recover(sweep, takes)
    assert result.accepted == (True, True, False, True)
    assert "outlier_take" in result.flags
    assert len(result.takes) == 4
    assert error_db(result.response, rooms, 2400) < -50


def test_integers_and_broken_channels(sweep: Array, rooms: Array) -> None:
    n = sweep.size + RATE
    take = played_in(sweep, rooms, n)
    whole = np.round(take / np.abs(take).max() * 30000).astype(np.int16)
    scaled = recover(sweep, whole).response
    wanted = rooms / np.abs(take).max() * 30000 / 32768
    assert error_db(scaled, wanted, 2400) < -55
    take[1, 500] = np.nan
    result = recover(sweep, take)
    assert result.flags == ("non_finite",)
    assert np.isnan(result.response[1]).all()
    assert error_db(result.response[[0, 2]], rooms[[0, 2]], 2400) < -90


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"recording": np.zeros((5000, 2))}, "time must be"),
        ({"band": (100.0, 30000.0)}, "cannot be recovered"),
        ({"pre": -1}, "cannot be kept"),
        ({"sample_rate": 0}, "sample rate"),
        ({"excitation": np.zeros(100)}, "nothing to divide by"),
        ({"loopback": np.zeros((3, 60000))}, "3 loopbacks for 1 takes"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    sweep: Array, arguments: dict, message: str
) -> None:
    usual = {"recording": np.zeros(60000), "excitation": sweep, "sample_rate": RATE}
    with pytest.raises(SignalError, match=message):
        deconvolve(**{**usual, **arguments})  # type: ignore[arg-type]


@pytest.mark.skipif(not REAL.exists(), reason=f"no real recording at {REAL}")
def test_the_real_recording_gives_its_authors_response() -> None:
    from scipy.signal import butter, sosfilt

    from rir.files.audio import read_audio

    data = np.load(REAL / "derived_pyfar_sweep.npz")
    [theirs], rate = read_audio(REAL / "impulse_response_measurement.wav")
    result = deconvolve(
        data["microphone"],
        data["excitation"],
        rate,
        loopback=data["loopback"],
        band=(63, 20000),
        length=40000,
        pre=2205,
    )
    assert abs(result.latency - 12640) < 0.5
    assert result.flags == ()
    assert "hum" in result.marks
    t = np.arange(theirs.size) / rate
    window = np.where(t < 0.01, np.sin(np.pi / 2 * t / 0.01) ** 2, 1)
    window *= np.cos(np.pi / 2 * np.clip((t - 0.5) / 0.1, 0, 1)) ** 2
    high_pass = butter(8, 40, "high", fs=rate, output="sos")
    ours = sosfilt(high_pass, result.response)[2205 : 2205 + theirs.size] * window
    size = 1 << 17
    f = np.fft.rfftfreq(size, 1 / rate)
    inside = (f >= 63) & (f <= 20000)
    a, b = (np.fft.rfft(row, size)[inside] for row in (ours, theirs))
    gain = (np.vdot(a, b) / np.vdot(a, a)).real
    assert 20 * np.log10(np.linalg.norm(b - gain * a) / np.linalg.norm(b)) < -75
