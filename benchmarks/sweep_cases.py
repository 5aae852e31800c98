"""Are bad takes found and good ones recovered? 71 kinds of take with known truth.

Each case is a recording made from a known response; the catalogue follows published
listings of what goes wrong with sweep measurements: noise, hum, clipping, drifting
clocks, dropped blocks, clicks, harmonics, short recordings, wrong signals.

Bar: every bad take flagged with its word, every good one recovered, no false flag.
"""

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture import deconvolve
from capture.signal.resample import evaluate_stretched
from harness import make_parser, write_results

Array = NDArray[np.float64]


@dataclass(eq=False)
class Case:
    """One take with its truth.

    Attributes
    ----------
    expected : tuple of str
        Words of which at least one must be among the flags; empty: none may be;
        ("*",): free.
    floor : float
        Error that the noise alone leaves, dB; NaN if no quality is asked.
    """

    name: str
    recording: NDArray[Any]
    excitation: Array
    sample_rate: int
    response: Array
    band: tuple[float, float]
    loopback: Array | None = None
    expected: tuple[str, ...] = ()
    floor: float = np.nan
    latency: float = 0.0


@dataclass(eq=False)
class Scene:
    """What most cases share."""

    rng: np.random.Generator
    rate: int = 48000
    band: tuple[float, float] = (20.0, 20000.0)
    seconds: float = 3.0
    t60: float = 0.5
    tail: float = 1.2
    noise_db: float = -60.0
    sweep: Array = field(init=False)
    room: Array = field(init=False)

    def __post_init__(self) -> None:
        self.sweep = plain_sweep(*self.band, self.seconds, self.rate)
        self.room = decaying_room(self.rng, self.rate, self.t60)

    def record(self, room: Array | None = None, *, noise: bool = True) -> Array:
        """Return the sweep in a room."""
        room = self.room if room is None else room
        n = self.sweep.size + round(self.tail * self.rate)
        clean = convolve(self.sweep, room, n)
        return clean + self.noise(clean) if noise else clean

    def noise(self, clean: Array, level_db: float | None = None) -> Array:
        """Return white noise at a level relative to a take."""
        level = self.noise_db if level_db is None else level_db
        rms = np.sqrt(np.mean(clean**2))
        return 10 ** (level / 20) * rms * self.rng.standard_normal(clean.size)

    def case(self, name: str, recording: NDArray[Any], **more: object) -> Case:
        """Return a case of this scene."""
        return Case(
            name,
            recording,
            self.sweep,
            self.rate,
            self.room,
            self.band,
            **more,  # type: ignore[arg-type]
        )


def plain_sweep(low: float, high: float, seconds: float, rate: int) -> Array:
    growth = seconds / np.log(high / low)
    t = np.arange(round(seconds * rate)) / rate
    sweep = 0.5 * np.sin(2 * np.pi * low * growth * np.expm1(t / growth))
    fade = round(0.005 * rate)
    ramp = np.sin(np.pi / 2 * np.arange(fade) / fade) ** 2
    sweep[:fade] *= ramp
    sweep[-fade:] *= ramp[::-1]
    return sweep


def decaying_room(rng: np.random.Generator, rate: int, t60: float) -> Array:
    n = round(min(1.3 * t60, 2.0) * rate)
    t = np.arange(n) / rate
    room = 0.05 * rng.standard_normal(n) * 10 ** (-3 * t / t60)
    room[0] = 1.0
    return np.concatenate((np.zeros(round(0.004 * rate)), 0.3 * room))


def convolve(a: Array, b: Array, n: int) -> Array:
    size = 1 << int(np.ceil(np.log2(a.size + b.size)))
    whole = np.fft.irfft(np.fft.rfft(a, size) * np.fft.rfft(b, size), size)
    out = np.zeros(n)
    count = min(n, whole.size)
    out[:count] = whole[:count]
    return out


def delayed(signal: Array, samples: float, drift: float = 0.0) -> Array:
    """Return ``signal((1 + drift) (t - samples))``, exactly."""
    size = 2 * (signal.size + int(abs(samples)) + 2048)
    spectrum = np.fft.rfft(signal, size)
    turn = np.exp(-2j * np.pi * (1 + drift) * samples * np.arange(spectrum.size) / size)
    return evaluate_stretched(spectrum * turn, size, signal.size, drift)


def pink(rng: np.random.Generator, n: int) -> Array:
    spectrum = np.fft.rfft(rng.standard_normal(n))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    spectrum[0] = 0
    noise = np.fft.irfft(spectrum, n)
    return noise / np.std(noise)


def error_db(case: Case, response: Array, pre: int) -> float:
    """Return the misalignment in 1.25 f1 to f2 / 1.25, dB."""
    truth = np.zeros(response.shape[-1])
    shifted = delayed_to(case.response, case.latency, truth.size - pre)
    truth[pre:] = shifted
    size = 2 * truth.size
    f = np.fft.rfftfreq(size, 1 / case.sample_rate)
    inside = (f >= 1.25 * case.band[0]) & (f <= case.band[1] / 1.25)
    wanted = np.fft.rfft(truth, size)[inside]
    off = np.fft.rfft(response, size)[..., inside] - wanted
    return float(20 * np.log10(np.linalg.norm(off) / np.linalg.norm(wanted) + 1e-30))


def delayed_to(room: Array, samples: float, n: int) -> Array:
    out = np.zeros(n)
    if samples == 0:
        out[: min(n, room.size)] = room[:n]
        return out
    padded = np.concatenate((room, np.zeros(int(samples) + 4096)))
    moved = delayed(padded, samples)
    out[: min(n, moved.size)] = moved[:n]
    return out


def catalogue(seed: int = 0) -> Iterator[Case]:
    """Make all cases."""
    rng = np.random.default_rng(seed)
    makers: list[Callable[[np.random.Generator], Iterator[Case]]] = [
        clean_cases,
        noise_cases,
        hum_cases,
        clip_cases,
        drift_cases,
        drop_cases,
        disturbance_cases,
        harmonic_cases,
        length_cases,
        latency_cases,
        take_cases,
        bad_cases,
    ]
    for make in makers:
        yield from make(rng)


def clean_cases(rng: np.random.Generator) -> Iterator[Case]:
    for rate in (16000, 22050, 44100, 48000, 96000):
        band = (20.0, min(20000.0, 0.45 * rate))
        scene = Scene(rng, rate, band, noise_db=-300)
        yield scene.case(f"clean/fs{rate}", scene.record(), floor=-66.0)
    scene = Scene(rng)
    yield scene.case("clean/quiet", 1e-3 * scene.record(), floor=np.nan)
    scene = Scene(rng)
    scene.room *= -1
    yield scene.case("polarity", scene.record(), floor=-60.0)
    scene = Scene(rng)
    whole = np.round(scene.record() * 32767 * 0.5)
    scene.room *= 0.5
    yield scene.case("clean/int16", whole.astype(np.int16), floor=-60.0)


def noise_cases(rng: np.random.Generator) -> Iterator[Case]:
    for kind in ("white", "pink"):
        for level in (60, 40, 20, 0, -20):
            scene = Scene(rng)
            clean = scene.record(noise=False)
            noise = (
                scene.noise(clean, -level)
                if kind == "white"
                else 10 ** (-level / 20) * np.std(clean) * pink(rng, clean.size)
            )
            floor = -level - 1.4 if kind == "white" else -level - 7.4
            expected = () if level >= 0 else ("*",)
            yield scene.case(
                f"noise/{kind}/{level}dB", clean + noise, floor=floor, expected=expected
            )


def hum_cases(rng: np.random.Generator) -> Iterator[Case]:
    for level in (-40, -20, 0):
        scene = Scene(rng)
        take = scene.record()
        t = np.arange(take.size) / scene.rate
        hum = np.sin(2 * np.pi * 50 * t) + 0.3 * np.sin(2 * np.pi * 150 * t + 1)
        take += 10 ** (level / 20) * 2**0.5 * np.std(take) * hum
        yield scene.case(f"hum50/{level}dB", take, floor=-21.0 + level)


def clip_cases(rng: np.random.Generator) -> Iterator[Case]:
    for percent in (1, 3, 10):
        scene = Scene(rng)
        take = scene.record()
        top = np.quantile(np.abs(take), 1 - percent / 100)
        yield scene.case(
            f"clip/{percent}pct", np.clip(take, -top, top), expected=("clipped",)
        )


def drift_cases(rng: np.random.Generator) -> Iterator[Case]:
    for ppm in (1, 3, 10, 30, 100):
        scene = Scene(rng)
        clean = scene.record(noise=False)
        loop = np.concatenate((scene.sweep, np.zeros(clean.size - scene.sweep.size)))
        take = delayed(clean, 0, ppm * 1e-6)
        yield scene.case(
            f"drift/{ppm}ppm/loopback",
            take + scene.noise(take),
            loopback=delayed(loop, 0, ppm * 1e-6),
            floor=-61.0,
        )
    for ppm in (10, 100):
        scene = Scene(rng)
        take = delayed(scene.record(noise=False), 0, ppm * 1e-6)
        yield scene.case(
            f"drift/{ppm}ppm/no_loopback", take + scene.noise(take), expected=("*",)
        )


def broken(signal: Array, kind: str, at: int, size: int) -> Array:
    if kind == "removed":
        return np.concatenate((signal[:at], signal[at + size :], np.zeros(size)))
    if kind == "zeroed":
        out = signal.copy()
        out[at : at + size] = 0
        return out
    return np.concatenate((signal[:at], signal[at - size : at], signal[at:-size]))


LOST = ("lost_samples", "inserted_samples", "zeroed_samples", "loopback_break")
WORD = {
    "removed": ("lost_samples",),
    "zeroed": ("zeroed_samples", "loopback_break"),
    "repeated": ("inserted_samples",),
}


def drop_cases(rng: np.random.Generator) -> Iterator[Case]:
    for share in (0.3, 0.75):
        for kind in ("removed", "zeroed", "repeated"):
            scene = Scene(rng)
            take = scene.record()
            loop = np.zeros(take.size)
            loop[: scene.sweep.size] = scene.sweep
            at = round(share * scene.sweep.size)
            yield scene.case(
                f"drop256/{kind}@{share}",
                broken(take, kind, at, 256),
                loopback=broken(loop, kind, at, 256),
                expected=WORD[kind],
            )
    for kind in ("removed", "zeroed", "repeated"):
        scene = Scene(rng)
        take = broken(scene.record(), kind, scene.sweep.size // 2, 256)
        words = (*WORD[kind], "event")
        yield scene.case(f"drop256/{kind}@0.5/no_loopback", take, expected=words)


def disturbance_cases(rng: np.random.Generator) -> Iterator[Case]:
    for level in (0.01, 0.1):
        scene = Scene(rng)
        yield scene.case(f"dc/{level}", scene.record() + level, floor=-60.0)
    for height, length, share in ((0.5, 0.0005, 0.4), (0.5, 0.0005, 0.8)):
        scene = Scene(rng)
        take = scene.record()
        at = round(share * scene.sweep.size)
        take[at : at + round(length * scene.rate)] += height
        name = f"click/{height}FS/{1e3 * length:g}ms@{share}"
        yield scene.case(name, take, expected=("*",))
    scene = Scene(rng)
    take = scene.record()
    at = scene.sweep.size // 2
    take[at : at + 960] += 0.3 * rng.standard_normal(960)
    yield scene.case("burst/0.3FS/20ms@0.5", take, expected=("event",))


def harmonic_cases(rng: np.random.Generator) -> Iterator[Case]:
    for second, third, expected in (
        (-40, -50, ()),
        (-30, -40, ("*",)),
        (-20, -30, ("distortion",)),
    ):
        scene = Scene(rng)
        take = scene.record(room=scene.room, noise=False)
        clean_sweep = scene.sweep
        scene.sweep = harmonics(clean_sweep, second, third)
        take = scene.record()
        scene.sweep = clean_sweep
        yield scene.case(
            f"hammerstein/H2{second}dB_H3{third}dB", take, expected=expected
        )


def harmonics(sweep: Array, second: float, third: float) -> Array:
    size = 1 << int(np.ceil(np.log2(sweep.size)))
    spectrum = np.fft.rfft(sweep, size)
    wide = np.zeros(2 * size + 1, dtype=complex)
    wide[: spectrum.size] = 4 * spectrum
    x = np.fft.irfft(wide, 4 * size) / 0.5
    x += 2 * 10 ** (second / 20) * x**2 + 4 * 10 ** (third / 20) * x**3
    return 0.5 * np.fft.irfft(np.fft.rfft(x)[: spectrum.size] / 4, size)[: sweep.size]


def length_cases(rng: np.random.Generator) -> Iterator[Case]:
    scene = Scene(rng, seconds=0.3, t60=1.5, tail=2.2)
    yield scene.case("short_sweep/0.3s_rir2s", scene.record(), floor=-49.0)
    for seconds, t60, tail in ((0.3, 1.5, 0.3), (3.0, 1.2, 0.1), (3.0, 0.8, 0.02)):
        scene = Scene(rng, seconds=seconds, t60=t60, tail=tail)
        words = ("tail_cut", "short_recording")
        name = f"short_sweep/{seconds:g}s_tail_cut_{tail:g}s"
        yield scene.case(name, scene.record(), expected=words)
    scene = Scene(rng, tail=0.45, t60=0.5)
    yield scene.case("tail/enough", scene.record(), floor=-45.0)


def latency_cases(rng: np.random.Generator) -> Iterator[Case]:
    for name, latency in (("int1234", 1234.0), ("frac1234.37", 1234.37)):
        scene = Scene(rng)
        take = scene.record(noise=False)
        loop = np.concatenate((scene.sweep, np.zeros(take.size - scene.sweep.size)))
        take = delayed(take, latency)
        noisy = take + scene.noise(take)
        yield scene.case(
            f"latency/{name}", noisy, loopback=delayed(loop, latency), floor=-60.0
        )
        case = scene.case(f"latency/{name}/no_loopback", noisy, floor=-58.0)
        case.latency = latency
        yield case


def take_cases(rng: np.random.Generator) -> Iterator[Case]:
    scene = Scene(rng)
    clean = scene.record(noise=False)
    quiet = np.stack([clean + scene.noise(clean, -40) for _ in range(4)])
    yield scene.case("takes/4_clean", quiet[:, np.newaxis], floor=-46.0)
    loud = np.stack([clean + scene.noise(clean, -10) for _ in range(4)])
    yield scene.case("takes/4_snr10", loud[:, np.newaxis], floor=-17.0)
    burst = quiet.copy()
    at = scene.sweep.size // 2
    burst[1, at : at + 960] += 0.3 * rng.standard_normal(960)
    words = ("outlier_take", "event")
    yield scene.case(
        "takes/4_one_burst", burst[:, np.newaxis], floor=-45.0, expected=words
    )
    drop = quiet.copy()
    drop[2] = broken(drop[2], "removed", at, 256)
    words = ("outlier_take", *LOST)
    yield scene.case(
        "takes/4_one_drop", drop[:, np.newaxis], floor=-45.0, expected=words
    )


def bad_cases(rng: np.random.Generator) -> Iterator[Case]:
    scene = Scene(rng)
    take = scene.record()
    cut = round(0.3 * scene.rate)
    yield scene.case("bad/first_0.3s_missing", take[cut:], expected=("missing_start",))
    stop = round(0.6 * scene.sweep.size)
    silent = take.copy()
    silent[stop:] = 0
    words = ("stops_early", "short_recording", "event")
    yield scene.case("bad/stops_at_60pct", silent, expected=words)
    noisy = silent + scene.noise(take)
    yield scene.case("bad/stops_at_60pct_noise", noisy, expected=words)
    yield scene.case("bad/cut_at_60pct", take[:stop], expected=words)
    ramp = 10 ** (np.linspace(0, 6, take.size) / 20)
    loop = np.concatenate((scene.sweep, np.zeros(take.size - scene.sweep.size)))
    yield scene.case(
        "bad/agc_6dB_ramp", take * ramp, loopback=loop * ramp, expected=("gain_change",)
    )
    yield scene.case("bad/agc_6dB_ramp/no_loopback", take * ramp, expected=("*",))
    stretched = plain_sweep(*scene.band, scene.seconds * 48 / 44.1, scene.rate)
    wrong = convolve(stretched, scene.room, take.size + 14000)
    looped = np.concatenate((scene.sweep, np.zeros(wrong.size - scene.sweep.size)))
    words = ("wrong_rate", "no_sweep")
    wrong += scene.noise(wrong)
    yield scene.case("bad/rate_44k1_as_48k", wrong, expected=words)
    yield scene.case(
        "bad/rate_44k1_as_48k/loopback", wrong, loopback=looped, expected=words
    )
    other = plain_sweep(100, 10000, 2.0, scene.rate)
    yield scene.case(
        "bad/other_sweep",
        scene.noise(take, -60) + convolve(other, scene.room, take.size),
        expected=(*words, "missing_start"),
    )
    back = convolve(scene.sweep[::-1], scene.room, take.size)
    yield scene.case("bad/reversed", back, expected=(*words, "missing_start"))
    yield scene.case(
        "bad/noise_only",
        0.1 * rng.standard_normal(take.size),
        expected=("no_sweep", "noise"),
    )
    yield scene.case("bad/silent", np.zeros(take.size), expected=("silent_channel",))
    holed = take.copy()
    holed[1000] = np.nan
    yield scene.case("bad/nan", holed, expected=("non_finite",))
    yield scene.case(
        "bad/silent_loopback",
        take,
        loopback=np.zeros(take.size),
        expected=("silent_loopback",),
    )


def judge(case: Case) -> dict[str, object]:
    """Deconvolve a case and score it."""
    pre = round(0.05 * case.sample_rate)
    length = round(
        min(1.0, 0.05 + case.response.size / case.sample_rate) * case.sample_rate
    )
    length += int(np.ceil(case.latency)) + 400
    begin = time.process_time()
    result = deconvolve(
        case.recording,
        case.excitation,
        case.sample_rate,
        loopback=case.loopback,
        band=case.band,
        length=length,
        pre=pre,
    )
    seconds = time.process_time() - begin
    response = result.response.reshape(-1, result.response.shape[-1])[0]
    error = error_db(case, response, pre)
    free = case.expected == ("*",)
    flagged = bool(set(case.expected) & set(result.flags))
    verdict_ok = free or (flagged if case.expected else not result.flags)
    quality = None if np.isnan(case.floor) else bool(error <= case.floor + 3)
    return {
        "case": case.name,
        "error_db": round(error, 1),
        "floor_db": case.floor,
        "quality": quality,
        "flags": list(result.flags),
        "marks": list(result.marks),
        "reasons": list(result.reasons),
        "expected": list(case.expected),
        "verdict_right": verdict_ok,
        "seconds": round(seconds, 3),
    }


def main(argv: list[str] | None = None) -> int:
    """Print the table and write it as JSON."""
    parser = make_parser(__doc__, "sweep_cases", "Every fifth case.")
    parser.add_argument("--only", default="", help="Cases whose name holds this.")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(argv)
    rows = []
    for number, case in enumerate(catalogue(chosen.seed)):
        if (chosen.quick and number % 5) or chosen.only not in case.name:
            continue
        row = judge(case)
        rows.append(row)
        good = "ok " if row["verdict_right"] and row["quality"] is not False else "BAD"
        flags = ",".join(row["flags"]) or "-"  # type: ignore[arg-type]
        marks = ",".join(row["marks"]) or "-"  # type: ignore[arg-type]
        print(
            f"{good} {row['case']:36s} {row['error_db']:7.1f} dB "
            f"(floor {row['floor_db']:6.1f})  {flags}  ({marks})"
        )
    asked = [row for row in rows if row["quality"] is not None]
    must = [row for row in rows if row["expected"] and row["expected"] != ["*"]]
    calm = [row for row in rows if not row["expected"]]
    print(
        f"{len(rows)} cases; quality {sum(bool(row['quality']) for row in asked)} of "
        f"{len(asked)}; bad takes flagged rightly "
        f"{sum(bool(row['verdict_right']) for row in must)} of {len(must)}; "
        "false alarms "
        f"{sum(not row['verdict_right'] for row in calm)} of {len(calm)}"
    )
    write_results(chosen.out, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
