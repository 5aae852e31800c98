"""Measure the path field in a box that has what the model lacks.

A 6 x 4 x 3 m box rendered in the frequency domain, image by image: locally reacting
walls of complex impedance that changes with frequency (so reflection depends on
frequency and angle), air, ten scatterers reached over at most one wall on each leg,
a loudspeaker that grows directional with frequency and is turned at random in every
take, a high-pass and a roll-off from 7 kHz, noise at -60 dB of the peak, reflections
up to order 10 - and poses that are told 3 mm wrong in each coordinate at both ends.
Fitted to five emitters and to one, asked at emitters never heard, in CPU seconds of
one thread. The floor is the truth against itself with poses 3 mm off. SIMULATED.

Bar: STFT 0.50, Amp 0.07, Env 0.8, T60 3.5 %, C50 0.3 dB, EDT 5 ms in 30 CPU seconds.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from fields.evaluate import compare_rows
from harness import make_parser, write_results
from inverse.acoustics import Acoustics
from inverse.find import room_in_rows
from inverse.rows.fitset import FitSet
from path_rooms import fit_rows, level_errors, loudspeaker
from rir.physics import air_absorption, speed_of_sound

SIZE = np.array([6.0, 4.0, 3.0])
RATE, SAMPLES, SPECTRUM = 16000.0, 1600, 2048
ORDER, SCATTERERS, POSE_SD_M, CLEAR_M = 10, 10, 0.003, 0.5
TEMPERATURE_C = 20.0
NODES_HZ = np.concatenate([[0.0], np.geomspace(30.0, 8000.0, 39)])
RESISTANCE = np.array([18.0, 10.0, 14.0, 8.0, 5.0, 9.0])
MASS = np.array([0.9, 0.3, 0.6, 0.1, 0.4, 0.2])
STIFFNESS = np.array([0.6, 2.0, 1.0, 3.0, 1.2, 2.5])
BARS = {"STFT": 0.5, "Amp": 0.07, "Env": 0.8, "T60": 3.5, "C50": 0.3, "EDT": 5.0}


@dataclass(frozen=True, eq=False)
class Truth:
    """Hold what the room is made of, at the nodes of frequency."""

    impedance: np.ndarray
    air: np.ndarray
    front: np.ndarray
    scatterers: np.ndarray
    strengths: np.ndarray
    chain: np.ndarray
    speed: float
    order: int = ORDER


def drawn_truth(seed: int = 0) -> Truth:
    """Return the room."""
    rng = np.random.default_rng(seed)
    hertz = np.maximum(NODES_HZ, 20.0) / 1000
    reactance = MASS[:, None] * hertz - STIFFNESS[:, None] / hertz
    resistance = RESISTANCE[:, None] * hertz**-0.15
    loss = air_absorption(NODES_HZ, TEMPERATURE_C, 50.0, 101.325)
    places = rng.uniform(0.6, SIZE - 0.6, (SCATTERERS, 3))
    radius = rng.uniform(0.12, 0.3, SCATTERERS)
    # a rigid sphere: (k a)^2 below k a = 1, half its radius above
    wave = (2 * np.pi * NODES_HZ / 343.0 * radius[:, None]) ** 2
    strengths = 0.5 * radius[:, None] * wave / (1 + wave)
    return Truth(
        resistance + 1j * reactance,
        np.asarray(loss) * np.log(10) / 20,
        0.6 * hertz**2 / (hertz**2 + 1.5**2),
        places,
        strengths,
        loudspeaker(SPECTRUM, RATE),
        speed_of_sound(TEMPERATURE_C),
    )


@njit(cache=True, fastmath=True)
def reflected(impedance, cosine, count, out):
    for k in range(len(out)):
        product = impedance[k] * cosine
        factor = (product - 1) / (product + 1)
        for _ in range(count):
            out[k] *= factor


@njit(cache=True, fastmath=True)
def added(nodes, at, part, length, speed, step, last, out):
    turn = np.exp(-2j * np.pi * step * length / speed)
    phase = 1.0 + 0.0j
    for k in range(last):
        low = at[k]
        value = nodes[low] + part[k] * (nodes[low + 1] - nodes[low])
        out[k] += value * phase
        phase *= turn


@njit(cache=True, fastmath=True)
def leg(start, end, index, parity, size, impedance, nodes, away):
    """Mirror `start`, multiply walls into nodes, return the length."""
    square = 0.0
    for axis in range(3):
        mirrored = (1 - 2 * parity[axis]) * start[axis]
        away[axis] = end[axis] - mirrored - 2 * index[axis] * size[axis]
        square += away[axis] ** 2
    length = np.sqrt(square)
    for axis in range(3):
        cosine = abs(away[axis]) / length
        low, high = abs(index[axis] - parity[axis]), abs(index[axis])
        reflected(impedance[2 * axis], cosine, low, nodes)
        reflected(impedance[2 * axis + 1], cosine, high, nodes)
        away[axis] *= (1 - 2 * parity[axis]) / length
    return length


@njit(cache=True, fastmath=True)
def render(
    first, second, ahead, size, impedance, air, front, scatterers, strengths,
    chain, at, part, speed, order, reach, step, last, out,
):  # fmt: skip
    count = len(air)
    nodes, legs = (
        np.empty(count, dtype=np.complex128),
        np.empty((2, 7, count), dtype=np.complex128),
    )
    lengths, facing = np.zeros((2, 7)), np.zeros(7)
    index, parity = np.zeros(3), np.zeros(3)
    away = np.zeros(3)
    most = (reach / (2 * size)).astype(np.int64) + 1
    for row in range(len(first)):
        for image in range((2 * most[0] + 1) * (2 * most[1] + 1)):
            index[0] = image % (2 * most[0] + 1) - most[0]
            index[1] = image // (2 * most[0] + 1) - most[1]
            for mz in range(-most[2], most[2] + 1):
                index[2] = mz
                for flip in range(8):
                    square, bounces = 0.0, 0.0
                    for axis in range(3):
                        parity[axis] = (flip >> axis) & 1
                        sign = 1 - 2 * parity[axis]
                        gap = second[row, axis] - sign * first[row, axis]
                        gap -= 2 * index[axis] * size[axis]
                        square += gap * gap
                        bounces += abs(index[axis] - parity[axis])
                        bounces += abs(index[axis])
                    if square > reach * reach or bounces > order:
                        continue
                    nodes[:] = 1.0
                    length = leg(
                        first[row], second[row], index, parity, size, impedance,
                        nodes, away,
                    )  # fmt: skip
                    cosine = np.dot(away, ahead[row])
                    for k in range(count):
                        gain = 1 - front[k] + front[k] * cosine
                        nodes[k] *= gain * np.exp(-air[k] * length) / length
                    added(nodes, at, part, length, speed, step, last, out[row])
        for point in range(len(scatterers)):
            for end in range(2):
                here = first[row] if end == 0 else second[row]
                for wall in range(7):
                    index[:], parity[:] = 0.0, 0.0
                    if wall > 0:
                        parity[(wall - 1) // 2] = 1.0
                        index[(wall - 1) // 2] = (wall - 1) % 2
                    legs[end, wall, :] = 1.0
                    lengths[end, wall] = leg(
                        here, scatterers[point], index, parity, size, impedance,
                        legs[end, wall], away,
                    )  # fmt: skip
                    if end == 0:
                        facing[wall] = np.dot(away, ahead[row])
            for one in range(7):
                for other in range(7):
                    length = lengths[0, one] + lengths[1, other]
                    if length > reach:
                        continue
                    spread = lengths[0, one] * lengths[1, other]
                    for k in range(count):
                        gain = 1 - front[k] + front[k] * facing[one]
                        gain *= strengths[point, k] * np.exp(-air[k] * length)
                        nodes[k] = legs[0, one, k] * legs[1, other, k] * gain / spread
                    added(nodes, at, part, length, speed, step, last, out[row])
        for k in range(last):
            out[row, k] *= chain[k]


def rendered(
    truth: Truth, first: np.ndarray, second: np.ndarray, yaw: np.ndarray
) -> np.ndarray:
    """Return responses of true places, shape (rows, samples)."""
    hertz = np.fft.rfftfreq(SPECTRUM, 1 / RATE)
    low = np.clip(np.searchsorted(NODES_HZ, hertz, "right") - 1, 0, len(NODES_HZ) - 2)
    part = (hertz - NODES_HZ[low]) / (NODES_HZ[low + 1] - NODES_HZ[low])
    ahead = np.stack([np.cos(yaw), np.sin(yaw), 0 * yaw], axis=1)
    spectra = np.zeros((len(first), len(hertz)), dtype=complex)
    render(
        first, second, ahead, SIZE, truth.impedance, truth.air, truth.front,
        truth.scatterers, truth.strengths, truth.chain, low, part, truth.speed,
        truth.order, (SAMPLES + 40) / RATE * truth.speed, RATE / SPECTRUM,
        len(hertz) - 1, spectra,
    )  # fmt: skip
    return np.fft.irfft(spectra, SPECTRUM)[:, :SAMPLES]


def rows_of(
    truth: Truth, emitters: int, listeners: int, seed: int, sigma: float = POSE_SD_M
) -> FitSet:
    """Return rows as they are measured: noisy, at places told `sigma` wrong."""
    rng = np.random.default_rng(seed)
    count = emitters * listeners
    told = _clear(truth, rng, emitters).repeat(listeners, axis=0)
    heard = _clear(truth, rng, count)
    yaw = rng.uniform(0, 2 * np.pi, count)
    errors = sigma * rng.standard_normal((2, count, 3))
    responses = rendered(truth, told + errors[0], heard + errors[1], yaw)
    loud = np.abs(responses).max(axis=1, keepdims=True)
    responses += 1e-3 * loud * rng.standard_normal(responses.shape)
    return fit_rows(responses, told, heard, RATE, truth.speed, yaw)


def _clear(truth: Truth, rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw places that stand clear of walls and scatterers."""
    kept = np.zeros((0, 3))
    while len(kept) < count:
        tried = rng.uniform(CLEAR_M, SIZE - CLEAR_M, (count, 3))
        gap = np.linalg.norm(tried[:, None] - truth.scatterers, axis=2)
        kept = np.concatenate([kept, tried[gap.min(axis=1) > CLEAR_M]])
    return kept[:count]


def floor_of(truth: Truth, rows: FitSet) -> dict[str, float]:
    """Return what poses `POSE_SD_M` off cost, all else known."""
    rng = np.random.default_rng(9)
    sine, cosine = rows.emitters.orientations[:, 2:].T
    yaw = 2 * np.arctan2(sine, cosine)
    ends = rows.emitters.positions, rows.listeners.positions
    moved = [end + POSE_SD_M * rng.standard_normal(end.shape) for end in ends]
    return scored(
        rendered(truth, ends[0], ends[1], yaw), rendered(truth, moved[0], moved[1], yaw)
    )


def scored(heard: np.ndarray, told: np.ndarray) -> dict[str, float]:
    """Return the six metrics and the waveform error of an answer."""
    metrics = compare_rows(heard, told, RATE)
    kept = {name: float(metrics[name]) for name in BARS}
    return kept | {"NMSE": float(np.median(level_errors(heard, told)))}


def measured(train: FitSet, test: FitSet) -> tuple[dict[str, Any], Acoustics]:
    """Fit, and score unseen emitters."""
    start = time.process_time()
    heard = room_in_rows(train)
    seconds = time.process_time() - start
    told = heard.predict(test.emitters, test.listeners, test.n_samples)
    found = scored(test.responses, told)
    return {"cpu_s": seconds, **found, "alarms": heard.alarms}, heard


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0."""
    parser = make_parser(__doc__, "path_hard", "few rows")
    options = parser.parse_args(argv)
    truth = drawn_truth()
    emitters, listeners, unseen = (3, 6, 4) if options.quick else (5, 200, 30)
    train = rows_of(truth, emitters, listeners, 0)
    test = rows_of(truth, 2 if options.quick else 10, unseen, 1)
    print("SIMULATED  " + "  ".join(f"{k:>6}" for k in (*BARS, "NMSE", "CPU-s")))
    results: dict[str, Any] = {"bars": BARS}
    nearest = np.array([_nearest(train, test, row) for row in range(len(test))])
    results["nearest row"] = scored(test.responses, train.responses[nearest])
    results["3 mm floor"] = floor_of(truth, test)
    _print("nearest", results["nearest row"])
    _print("floor", results["3 mm floor"])
    sets = {f"{emitters} places": train}
    if not options.quick:
        # once before the clock runs: compiling is no fitting
        room_in_rows(train.spread(100))
        sets["1 place"] = train.rows(np.flatnonzero(train.places == 0))
    for name, rows in sets.items():
        results[name], _ = measured(rows, test)
        _print(name, results[name])
        for alarm in results[name]["alarms"]:
            print(f"    {alarm}")
    _print("bar", BARS)
    write_results(options.out, results)
    return 0


def _nearest(train: FitSet, test: FitSet, row: int) -> int:
    gap = train.emitters.positions - test.emitters.positions[row]
    other = train.listeners.positions - test.listeners.positions[row]
    return int(np.argmin((gap**2).sum(axis=1) + (other**2).sum(axis=1)))


def _print(name: str, found: dict[str, Any]) -> None:
    shown = [found.get(key, float("nan")) for key in (*BARS, "NMSE", "cpu_s")]
    print(f"{name:10} " + "  ".join(f"{value:6.3f}" for value in shown))


if __name__ == "__main__":
    raise SystemExit(main())
