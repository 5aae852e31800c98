# ruff: noqa: E501 - the table of faults is one line per fault
"""How small a fault is found? For each kind: the smallest size, and false alarms.

Bar: found: 1 lost sample, 8 zeroed samples, gain steps of 0.1 dB, drifts of 1 ppm,
clipping by 0.1 dB; no false alarm.
"""

import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from capture import deconvolve, synchronized_sweep
from harness import make_parser, write_results
from sweep_cases import convolve, decaying_room, delayed

Array = NDArray[np.float64]
RATE = 48000
NOISE_DB = -60.0
CABLE_NOISE_DB = -87.0


class Bench:
    """A clean take with a loopback, and a golden loopback from another take."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.sweep = synchronized_sweep(10, 22000, 2.0, RATE, band=(20, 20000))
        self.pad = np.zeros(RATE // 4)
        self.played = np.concatenate((self.pad, self.sweep, np.zeros(RATE)))
        self.room = decaying_room(rng, RATE, 0.4)
        self.golden = self.cable()

    def cable(self) -> Array:
        """Return a fresh clean loopback."""
        return self.noisy(delayed(0.5 * self.played, 64.3), CABLE_NOISE_DB)

    def microphone(self) -> Array:
        """Return a fresh clean recording of the room."""
        heard = convolve(self.played, self.room, self.played.size)
        return self.noisy(delayed(heard, 64.3), NOISE_DB)

    def noisy(self, signal: Array, level: float) -> Array:
        """Return a signal with white noise at a level relative to it, dB."""
        noise = np.std(signal) * 10 ** (level / 20)
        return signal + noise * self.rng.standard_normal(signal.size)

    def words(self, microphone: Array, loopback: Array) -> set[str]:
        """Return what a take is flagged or marked with."""
        result = deconvolve(
            microphone,
            self.sweep,
            RATE,
            loopback=loopback,
            golden=self.golden,
            band=(20, 20000),
            length=RATE // 2,
            pre=2400,
        )
        return {*result.flags, *result.marks} - {"low_inr"}


def lose(signal: Array, count: float) -> Array:
    at, count = signal.size // 2, int(count)
    return np.concatenate((signal[:at], signal[at + count :], np.zeros(count)))


def insert(signal: Array, count: float) -> Array:
    at, count = signal.size // 2, int(count)
    return np.concatenate((signal[:at], signal[at - count : at], signal[at:-count]))


def blank(signal: Array, count: float) -> Array:
    out = signal.copy()
    at = signal.size // 2 + 5
    out[at : at + int(count)] = 0
    return out


def both(change: Callable[[Array, float], Array]) -> Callable[[Bench, float], tuple]:
    return lambda b, size: (change(b.microphone(), size), change(b.cable(), size))


def drift(b: Bench, ppm: float) -> tuple[Array, Array]:
    microphone, cable = (
        delayed(convolve(b.played, room, b.played.size), 64.3, 1e-6 * ppm)
        for room in (b.room, np.array([0.5]))
    )
    return b.noisy(microphone, NOISE_DB), b.noisy(cable, CABLE_NOISE_DB)


def clip(signal: Array, decibels: float) -> Array:
    top = np.abs(signal).max() * 10 ** (-decibels / 20)
    return np.clip(signal, -top, top)


def smoothly(signal: Array, decibels: float) -> Array:
    """Return a wave clipped before the converter's filter: no flat top is left."""
    size = 1 << int(np.ceil(np.log2(signal.size)))
    spectrum = np.fft.rfft(signal, size)
    wide = np.zeros(2 * size + 1, dtype=complex)
    wide[: spectrum.size] = 4 * spectrum
    cut = clip(np.fft.irfft(wide, 4 * size), decibels)
    back = np.fft.rfft(cut)[: spectrum.size] / 4
    return np.fft.irfft(back, size)[: signal.size]


def hum(b: Bench, decibels: float) -> tuple[Array, Array]:
    take = b.microphone()
    wave = np.sin(2 * np.pi * 50 * np.arange(take.size) / RATE)
    return take + 2**0.5 * np.std(take) * 10 ** (decibels / 20) * wave, b.cable()


def knock(b: Bench, decibels: float) -> tuple[Array, Array]:
    take = b.microphone()
    at, count = take.size // 2, RATE // 50
    burst = b.rng.standard_normal(count) * np.std(take) * 10 ** (decibels / 20)
    take[at : at + count] += burst
    return take, b.cable()


def bend(b: Bench, percent: float) -> tuple[Array, Array]:
    # A cubic of the played signal, band limited so that nothing folds back.
    cube = 4 * percent / 100 * (b.played / 0.5) ** 3 * 0.5
    spectrum = np.fft.rfft(cube)
    spectrum[int(0.8 * spectrum.size) :] = 0
    heard = convolve(b.played + np.fft.irfft(spectrum, cube.size), b.room, cube.size)
    return b.noisy(delayed(heard, 64.3), NOISE_DB), b.cable()


FAULTS: dict[str, tuple[str, list[float], Callable[[Bench, float], tuple], set[str]]] = {
    "lost samples": ("samples", [256, 64, 8, 1], both(lose), {"lost_samples", "loopback_break", "loopback_changed"}),
    "inserted samples": ("samples", [256, 64, 8, 1], both(insert), {"inserted_samples", "loopback_break", "loopback_changed"}),
    "zeroed samples": ("samples", [256, 64, 8], both(blank), {"zeroed_samples", "loopback_break", "loopback_changed"}),
    "gain change": ("dB", [1, 0.3, 0.1, 0.06], lambda b, s: (b.microphone(), 10 ** (s / 20) * b.cable()), {"gain_change"}),
    "latency change": ("samples", [64, 8, 1.5], lambda b, s: (delayed(b.microphone(), s), delayed(b.cable(), s)), {"latency_change"}),
    "clock drift": ("ppm", [100, 10, 1, 0.3], drift, {"clock_drift"}),
    "clipping, loopback": ("dB", [1, 0.3, 0.1, 0.01], lambda b, s: (b.microphone(), clip(b.cable(), s)), {"clipped"}),
    "clipping, microphone": ("dB", [1, 0.3, 0.1, 0.03], lambda b, s: (clip(b.microphone(), s), b.cable()), {"clipped"}),
    "clipping before a filter": ("dB", [3, 1, 0.3, 0.1], lambda b, s: (smoothly(b.microphone(), s), b.cable()), {"clipped"}),
    "knock of 20 ms": ("dB re take", [0, -10, -20, -25], knock, {"event"}),
    "hum": ("dB re take", [-20, -30, -40, -45], hum, {"hum"}),
    "third harmonic": ("%", [10, 5, 3.5], bend, {"distortion"}),
    "constant": ("FS", [0.1, 0.01, 0.003, 0.0015], lambda b, s: (b.microphone() + s, b.cable()), {"dc_offset"}),
    "silent channel": ("", [1], lambda b, _: (0 * b.microphone(), b.cable()), {"silent_channel"}),
    "swapped channels": ("", [1], lambda b, _: (b.cable(), b.microphone()), {"swapped_channels"}),
    "crosstalk": ("dB re direct", [-18, -40, -50, -60], lambda b, s: (b.microphone() + 0.3 * 10 ** (s / 20) * delayed(b.played, 64.3), b.cable()), {"crosstalk"}),
}  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Print the table and write it as JSON."""
    parser = make_parser(__doc__, "fault_detection")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--clean", type=int, default=40)
    chosen = parser.parse_args(argv)
    repeats, clean = (1, 1) if chosen.quick else (chosen.repeats, chosen.clean)
    wrong: dict[str, int] = dict.fromkeys(FAULTS, 0)
    for number in range(clean):
        bench = Bench(np.random.default_rng((7, number)))
        words = bench.words(bench.microphone(), bench.cable())
        for name, (_, _, _, expected) in FAULTS.items():
            wrong[name] += bool(words & expected)
    rows = []
    print(f"{'fault':24s} {'smallest found':>20s}   rates by size; false of {clean}")
    for name, (unit, sizes, make, expected) in FAULTS.items():
        rates = {}
        for size in sizes[-1:] if chosen.quick else sizes:
            found = 0
            for number in range(repeats):
                bench = Bench(np.random.default_rng((3, number)))
                found += bool(bench.words(*make(bench, size)) & expected)
            rates[size] = found / repeats
        sure = [size for size, rate in rates.items() if rate == 1.0]
        smallest = f"{sure[-1]:g} {unit}" if sure else "none"
        row = {"fault": name, "unit": unit, "rates": rates, "false": wrong[name]}
        rows.append(row)
        told = ", ".join(f"{size:g}: {rate:.0%}" for size, rate in rates.items())
        print(f"{name:24s} {smallest:>20s}   {told}; {wrong[name]}")
    write_results(chosen.out, {"clean": clean, "rows": rows})
    return 0


if __name__ == "__main__":
    sys.exit(main())
