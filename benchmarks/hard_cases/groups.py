"""Groups of hard cases: decays, noises, ends, onsets, offsets."""

from collections.abc import Iterator

import numpy as np

from hard_cases.case import CASES, HardCase
from hard_cases.decays import Decay, pink_noise, with_noise
from hard_cases.truth import exponential_truth, measured_truth

Cases = Iterator[HardCase]
Rng = np.random.Generator


@CASES.add("pure")
def pure(rng: Rng) -> Cases:
    """Exponential decays without noise, 0.05-12 s at 8-192 kHz."""
    for time, rate in [
        (0.05, 8000),
        (0.05, 48000),
        (0.1, 16000),
        (0.3, 44100),
        (0.5, 22050),
        (1.0, 48000),
        (2.0, 96000),
        (4.0, 48000),
        (12.0, 8000),
        (12.0, 48000),
        (0.5, 192000),
        (0.02, 48000),
    ]:
        decay = Decay((time,), rate=rate)
        truth = measured_truth(decay.clean(rng), rate)
        if time >= 0.1:
            truth |= exponential_truth(time)
        for name in ("C50", "C80"):
            if truth[name] > 90:
                del truth[name]
        samples = decay.clean(rng, 90.0)
        yield HardCase(f"sign {time} s {rate} Hz", samples, rate, truth, warns=False)
        gauss = Decay((time,), rate=rate, carrier="gauss").clean(rng)
        truth = measured_truth(gauss, rate)
        for name in ("C50", "C80"):
            if truth[name] > 90:
                del truth[name]
        yield HardCase(f"gauss {time} s {rate} Hz", gauss, rate, truth, warns=False)


@CASES.add("noise")
def noise(rng: Rng) -> Cases:
    """Floors of -100..-20 dB, white, pink and hum."""
    for floor in (-100, -80, -70, -60, -50, -45, -40, -35, -30, -25, -20):
        for time in (0.3, 1.2, 3.0):
            for carrier in ("sign", "gauss"):
                decay = Decay((time,), carrier=carrier)
                yield with_noise(f"{carrier} {time} s {floor} dB", decay, floor, rng)
    for floor in (-60, -45, -35):
        decay = Decay((1.0,), carrier="gauss")
        count = 3 * 48000
        hiss = pink_noise(count, rng)
        yield with_noise(f"pink {floor} dB", decay, floor, rng, length=3, noise=hiss)
        hum = np.sqrt(2) * np.sin(2 * np.pi * 50 / 48000 * np.arange(count) + 1)
        yield with_noise(f"hum {floor} dB", decay, floor, rng, length=3, noise=hum)


@CASES.add("double")
def double(rng: Rng) -> Cases:
    """Two slopes, the knee at -10..-30 dB, little or no noise."""
    for knee in (-10.0, -15.0, -20.0, -30.0):
        for early, late in ((0.4, 1.5), (0.8, 2.5)):
            decay = Decay((early, late), (0.0, knee))
            clean = decay.clean(rng)
            truth = measured_truth(clean, decay.rate)
            yield HardCase(
                f"clean {early}/{late} s knee {knee}",
                clean,
                decay.rate,
                truth,
                warns=None,
            )
            noisy = Decay((early, late), (0.0, knee), carrier="gauss")
            yield with_noise(f"{early}/{late} s knee {knee} -80 dB", noisy, -80, rng)


@CASES.add("direct")
def direct(rng: Rng) -> Cases:
    """Add a direct sound of -10..20 dB above the reverberation."""
    for ratio in (-10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0):
        for time in (0.5, 1.5):
            decay = Decay((time,), direct_db=ratio)
            clean = decay.clean(rng)
            truth = measured_truth(clean, decay.rate, direct=True)
            optional = frozenset(k for k, v in truth.items() if np.isnan(v))
            truth = {k: v for k, v in truth.items() if not np.isnan(v)}
            yield HardCase(
                f"DRR {ratio} {time} s",
                clean,
                decay.rate,
                truth,
                optional=optional,
                warns=None if ratio > 5 else False,
            )
            noisy = Decay((time,), direct_db=ratio, carrier="gauss")
            yield with_noise(f"DRR {ratio} {time} s -60 dB", noisy, -60 - ratio, rng)


@CASES.add("length")
def length(rng: Rng) -> Cases:
    """Short decays in long records, and zeros appended."""
    for time, seconds in ((0.5, 60), (0.2, 30), (1.0, 20)):
        decay = Decay((time,), carrier="gauss", rate=16000)
        yield with_noise(f"{time} s in {seconds} s", decay, -60, rng, length=seconds)
    for zeros in (1.0, 10.0):
        decay = Decay((0.8,))
        clean = decay.clean(rng, 70.0)
        padded = np.concatenate([clean, np.zeros(int(zeros * decay.rate))])
        yield HardCase(
            f"{zeros} s of zeros behind", padded, decay.rate, exponential_truth(0.8)
        )


@CASES.add("onset")
def onset(rng: Rng) -> Cases:
    """Delayed direct sound behind silence or noise; inverted; pre-ringing."""
    for delay in (0.001, 0.01, 0.1, 1.0):
        decay = Decay((0.8,))
        clean = np.concatenate([np.zeros(int(delay * 48000)), decay.clean(rng)])
        yield HardCase(
            f"silence {delay} s", clean, 48000, exponential_truth(0.8), warns=False
        )
        yield HardCase(f"inverted {delay} s", -clean, 48000, exponential_truth(0.8))
        for floor in (-60, -30):
            noisy = Decay((0.8,), carrier="gauss")
            yield with_noise(
                f"noise {floor} dB {delay} s",
                noisy,
                floor,
                rng,
                onset=int(delay * 48000),
                length=delay + 2.0,
            )
    wave = Decay((0.8,)).clean(rng)
    wave[0], wave[960] = 1.0, 10**0.75
    yield HardCase(
        "louder reflection 20 ms later", wave, 48000, measured_truth(wave, 48000)
    )
    ringing = np.concatenate([0.05 * np.sinc(np.arange(-20, 0) + 0.5), wave])
    yield HardCase("ringing before", ringing, 48000, measured_truth(wave, 48000))


@CASES.add("dc")
def offset(rng: Rng) -> Cases:
    """Add a steady offset."""
    for size in (0.1, 0.01, 1e-3, -1e-2):
        decay = Decay((0.8,), carrier="gauss")
        case = with_noise(f"offset {size}", decay, -60, rng, length=2.5)
        peak = np.abs(case.samples).max()
        yield HardCase(
            case.name,
            case.samples + size * peak,
            48000,
            case.truth,
            True,
            case.optional,
            warns=True,
        )
        clean = Decay((0.8,)).clean(rng)
        yield HardCase(
            f"clean, offset {size}",
            clean + size,
            48000,
            exponential_truth(0.8),
            warns=True,
        )


@CASES.add("truncated")
def truncated(rng: Rng) -> Cases:
    """Decays cut before or behind the range they need, with and without zeros."""
    for cut in (12.0, 20.0, 24.0, 30.0, 34.0, 40.0, 45.0, 60.0):
        for time, zeros in ((1.0, 0), (1.0, 48000), (0.3, 0), (3.0, 0)):
            for carrier in ("sign", "gauss"):
                decay = Decay((time,), carrier=carrier)
                clean = decay.clean(rng)
                truth = measured_truth(clean, decay.rate)
                optional = set()
                for name, needed in {"EDT": 10.0, "T20": 25.0, "T30": 35.0}.items():
                    if cut < needed:
                        truth[name] = float("nan")
                    elif cut < needed + 5.0:
                        optional.add(name)
                count = int(cut / 60 * time * decay.rate)
                for name, split in (("C50", 0.05), ("C80", 0.08)):
                    if split > 0.9 * count / decay.rate:
                        del truth[name]
                    if split > 0.9 * count / decay.rate and name == "C50":
                        del truth["D50"]
                samples = np.concatenate([clean[:count], np.zeros(zeros)])
                yield HardCase(
                    f"{carrier} {time} s cut at -{cut} dB, {zeros} zeros",
                    samples,
                    decay.rate,
                    truth,
                    carrier == "gauss",
                    frozenset(optional),
                    warns=True if cut < 36 else None,
                )
