"""Groups of hard cases: nonsense, types, scales, shapes, and what stumps the peers."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from hard_cases.case import CASES, PARAMETERS, REFUSED, HardCase
from hard_cases.decays import Decay, with_noise
from hard_cases.truth import exponential_truth, measured_truth

Cases = Iterator[HardCase]
Rng = np.random.Generator
NOTHING: dict[str, Any] = dict.fromkeys(PARAMETERS, REFUSED)


@CASES.add("degenerate")
def degenerate(rng: Rng) -> Cases:
    """Offer what has no decay or cannot be read at all."""
    n, time = 48000, np.arange(48000) / 48000
    decay = Decay((0.8,)).samples(n, rng)
    impulse = np.zeros(n)
    impulse[0] = 1.0
    later = np.roll(impulse, 999)
    hole, infinite = decay.copy(), decay.copy()
    hole[1000], infinite[2000] = np.nan, -np.inf
    for name, samples in {
        "silence": np.zeros(n),
        "impulse at 0": impulse,
        "impulse later": later,
        "NaN inside": hole,
        "inf inside": infinite,
        "all NaN": np.full(n, np.nan),
        "white noise": rng.standard_normal(n),
        "white noise 60 s": rng.standard_normal(60 * 8000),
        "sine": np.sin(2000 * np.pi * time),
        "low sine": np.sin(100 * np.pi * time),
        "constant": np.full(n, 0.3),
        "reversed": decay[::-1].copy(),
        "one sample": np.ones(1),
        "two samples": np.array([1.0, -0.5]),
        "ten samples": decay[:10],
        "square wave": np.sign(np.sin(2000 * np.pi * time + 0.1)),
        "impulse in noise": impulse + 1e-3 * rng.standard_normal(n),
        "rising": rng.standard_normal(n) * time,
    }.items():
        yield HardCase(name, samples, 48000, NOTHING, warns=True)
    two = np.zeros(n)
    two[[0, 4800]] = 1.0, 0.5
    yield HardCase(
        "two impulses",
        two,
        48000,
        {
            "C50": 20 * np.log10(2),
            "C80": 20 * np.log10(2),
            "DRR": 20 * np.log10(2),
            "D50": 0.8,
            "TS": 0.02,
            "EDT": REFUSED,
            "T20": REFUSED,
            "T30": REFUSED,
        },
    )
    for name, samples, rate in (
        ("empty", np.zeros(0), 48000),
        ("empty rows", np.zeros((3, 0)), 48000),
        ("negative rate", decay, -48000),
        ("rate 0", decay, 0),
        ("rate NaN", decay, np.nan),
        ("a number", np.float64(3.0), 48000),
        ("words", np.array(["a", "b"]), 48000),
        ("complex", decay * 1j, 48000),
        ("time first", np.zeros((48000, 2)), 48000),
    ):
        yield HardCase(name, samples, rate, refuses=True)


@CASES.add("dtype")
def dtype(rng: Rng) -> Cases:
    """Pass the same decay in other number types."""
    decay = Decay((0.8,)).samples(64000, rng)
    truth = exponential_truth(0.8)
    for name, samples in {
        "float32": decay.astype(np.float32),
        "longdouble": decay.astype(np.longdouble),
        "float16": decay.astype(np.float16),
        "int32": (decay * 2**30).astype(np.int32),
        "int16": np.rint(decay * 32767).astype(np.int16),
        "int64": np.rint(decay * 2**40).astype(np.int64),
        "big endian": decay.astype(">f8"),
        "strided": np.repeat(decay, 2)[::2],
        "list": decay.tolist(),
        "object": decay.astype(object),
    }.items():
        yield HardCase(name, samples, 48000, truth, name in {"int16", "float16"})


@CASES.add("clipped")
def clipped(rng: Rng) -> Cases:
    """Gaussian decays clipped at a share of their peak."""
    for share in (0.9, 0.7, 0.5):
        for time in (0.5, 1.5):
            clean = Decay((time,), carrier="gauss").clean(rng)
            limit = share * np.abs(clean).max()
            samples = np.clip(clean, -limit, limit)
            many = np.sum(np.abs(samples) == limit) >= 4
            yield HardCase(
                f"at {share} {time} s",
                samples,
                48000,
                measured_truth(samples, 48000),
                True,
                warns=True if many else None,
            )


@CASES.add("ringmod")
def ringmod(_rng: Rng) -> Cases:
    """Decaying tones and beats."""
    for frequency in (40.0, 250.0, 1000.0, 7000.0):
        decay = Decay((1.0,)).envelope(96000)
        tone = decay * np.cos(2 * np.pi * frequency / 48000 * np.arange(96000))
        truth = exponential_truth(1.0)
        yield HardCase(f"{frequency} Hz", tone, 48000, truth, frequency < 100)


@CASES.add("nonmono")
def nonmono(rng: Rng) -> Cases:
    """Energy that rises first, or falls in dips."""
    time = np.arange(120000) / 48000
    for rise in (0.005, 0.02, 0.05):
        carrier = rng.choice([-1.0, 1.0], len(time))
        wave = carrier * 10.0 ** (-3 * time / 1.0) * (1 - 0.8 * np.exp(-time / rise))
        yield HardCase(f"rise {rise} s", wave, 48000, measured_truth(wave, 48000))
    for depth in (0.3, 0.6):
        carrier = rng.choice([-1.0, 1.0], len(time))
        beat = 1 + depth * np.cos(2 * np.pi * 4 * time)
        wave = carrier * 10.0 ** (-3 * time / 1.0) * beat
        yield HardCase(f"beat {depth}", wave, 48000, measured_truth(wave, 48000))
    wave = Decay((1.2,)).samples(150000, rng)
    wave[9600:10560] *= 3.0
    yield HardCase(
        "late burst of reflections", wave, 48000, measured_truth(wave, 48000)
    )


@CASES.add("scale")
def scale(rng: Rng) -> Cases:
    """Amplitudes of 1e-160 to 1e150."""
    decay = Decay((0.8,)).samples(80000, rng)
    for size in (1e-300, 1e-160, 1e-30, 1e-12, 1e-6, 1e6, 1e30, 1e150, 1e300):
        yield HardCase(f"{size:g}", decay * size, 48000, exponential_truth(0.8))


@CASES.add("shape")
def shape(rng: Rng) -> Cases:
    """Several responses at once, one of them silent."""
    times = np.array([0.4, 0.8, 1.6])
    rows = np.array([Decay((t,)).samples(120000, rng) for t in times])
    truths = [exponential_truth(t) for t in times]
    truth = {k: np.array([t[k] for t in truths]) for k in truths[0]}
    yield HardCase("(3, n)", rows, 48000, truth)
    yield HardCase(
        "(1, 3, n)", rows[None], 48000, {k: v[None] for k, v in truth.items()}
    )
    yield HardCase(
        "(3, 1, n)", rows[:, None], 48000, {k: v[:, None] for k, v in truth.items()}
    )
    silent = rows.copy()
    silent[1] = 0.0
    holed = {k: np.where([False, True, False], np.nan, v) for k, v in truth.items()}
    yield HardCase("one silent", silent, 48000, holed)
    broken = rows.copy()
    broken[1, 7] = np.nan
    yield HardCase("one NaN", broken, 48000, holed)
    yield HardCase("column order", np.asfortranarray(rows), 48000, truth)
    yield HardCase("transposed view", rows.T.copy().T, 48000, truth)


@CASES.add("rate")
def rate(rng: Rng) -> Cases:
    """Sample rates of 8 to 192 kHz."""
    for hertz in (8000, 11025, 16000, 22050, 32000, 44100, 88200, 96000, 192000):
        decay = Decay((0.6,), rate=hertz)
        truth = exponential_truth(0.6)
        if hertz == 22050:
            truth = measured_truth(decay.clean(rng), hertz)
        yield HardCase(f"{hertz} Hz", decay.clean(rng), hertz, truth, warns=False)


@CASES.add("hard")
def hard(rng: Rng) -> Cases:
    """Flutter echo, clicks, gates, coarse files, slopes hidden by noise."""
    yield from _flutter(rng)
    yield from _clicks(rng)
    for cut, step in ((-60, 0.0), (-50, 0.0), (-70, 1e-5)):
        wave = Decay((1.0,), carrier="gauss").clean(rng)
        start = int(-cut / 60 * 48000)
        truth = measured_truth(wave, 48000)
        wave[start:] = step * rng.standard_normal(len(wave) - start)
        yield HardCase(f"gate at {cut} dB to {step}", wave, 48000, truth, True)
    wave = Decay((1.0,), carrier="gauss").clean(rng)
    coarse = np.rint(wave / np.abs(wave).max() * 33).astype(np.int16)
    truth = measured_truth(wave, 48000) | {"T30": REFUSED}
    yield HardCase(
        "16 bit at -60 dBFS",
        coarse,
        48000,
        truth,
        True,
        frozenset({"T20", "C50", "C80"}),
        warns=True,
    )
    for knee, floor in ((-20, -35), (-25, -40), (-35, -40), (-35, -50), (-30, -45)):
        for late in (1.5, 3.0):
            decay = Decay((0.5, late), (0.0, float(knee)), carrier="gauss")
            yield with_noise(
                f"knee {knee} dB {late} s floor {floor} dB",
                decay,
                floor,
                rng,
                length=4.0,
            )


def _flutter(rng: Rng) -> Cases:
    for period in (0.01, 0.02, 0.05):
        for time in (0.8, 2.0):
            count = int(2.3 * time * 48000)
            wave = np.zeros(count)
            at = np.arange(0, count, int(period * 48000))
            wave[at] = 10.0 ** (-3 * at / 48000 / time) * rng.choice([-1, 1], len(at))
            truth = measured_truth(wave, 48000)
            yield HardCase(f"flutter {period} s {time} s", wave, 48000, truth, True)
            noisy = wave + 1e-4 * rng.standard_normal(count)
            yield HardCase(
                f"flutter {period} s {time} s -80 dB", noisy, 48000, truth, True
            )


def _clicks(rng: Rng) -> Cases:
    for early, level in ((0.087, -12), (0.05, -6), (0.2, -15), (0.087, -18)):
        case = with_noise("", Decay((1.0,)), -70, rng, onset=9600, length=2.5)
        wave = case.samples.copy()
        wave[9600 - int(early * 48000)] = 10 ** (level / 20) * np.abs(wave).max()
        name = f"click {early} s early at {level} dB"
        yield replace(case, name=name, samples=wave, warns=True)
    for at, level in ((1.5, -20), (0.9, -20), (0.7, -10), (1.8, 0)):
        for floor in (-60, -45):
            case = with_noise(
                "", Decay((1.0,), carrier="gauss"), floor, rng, length=2.5
            )
            wave = case.samples.copy()
            wave[int(at * 48000)] += 10 ** (level / 20) * np.abs(wave).max()
            name = f"click {at} s late at {level} dB, floor {floor}"
            yield replace(case, name=name, samples=wave, warns=True)


@CASES.add("random")
def random_group(rng: Rng) -> Cases:
    """Draw 80 mixtures."""
    yield from random_mixtures(rng, 80)


def random_mixtures(rng: Rng, count: int) -> Cases:
    """Mixtures drawn at random: rates, times, slopes, floors, direct sounds, delays."""
    for number in range(count):
        time = float(np.exp(rng.uniform(np.log(0.15), np.log(3.0))))
        rate = float(rng.choice([16000, 44100, 48000, 96000]))
        slopes, levels = (time,), (0.0,)
        if rng.random() < 0.3:
            slopes = (time, time * float(rng.uniform(1.5, 4)))
            levels = (0.0, float(rng.uniform(-35, -10)))
        ratio = float(rng.uniform(-10, 15)) if rng.random() < 0.5 else None
        decay = Decay(slopes, levels, rate, str(rng.choice(["sign", "gauss"])), ratio)
        floor = float(rng.uniform(-75, -25))
        onset = int(rng.uniform(0, 0.1) * rate)
        name = f"{number}: {slopes} {levels} {ratio} {floor:.1f} dB {decay.carrier}"
        yield with_noise(name, decay, floor, rng, onset=onset)
