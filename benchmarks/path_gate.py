"""Ask whether the path field knows when its paths are right.

Three questions, each with a truth of images rendered here: do waveforms fail where
the coherence horizon says; are wrong paths switched off and right ones left alone;
and what does a length of 1 s cost beside 0.1 s. SIMULATED.

Bar: a length of 1 s costs at most 1.6 times what 0.1 s does.
"""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from fields.evaluate import compare_rows
from harness import make_parser, write_results
from inverse.find import room_in_rows
from inverse.late.coherence_horizon import Uncertainty
from inverse.late.completion import Completion
from inverse.paths.bank import ideal_bank
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.room import OMNI
from path_rooms import fit_rows
from rir import Poses

RATE, SPEED = 16000.0, 343.0
ROOMS = {
    "6 x 4 x 3 m": (6.0, 4.0, 3.0),
    "9 x 5 x 2.8 m": (9.0, 5.0, 2.8),
    "4 x 3.5 x 2.5 m": (4.0, 3.5, 2.5),
}
CORNERED = "L of 6 x 5 x 3 m"
OUTLINE = ((0.0, 0.0), (6.0, 0.0), (6.0, 2.2), (3.4, 2.2), (3.4, 5.0), (0.0, 5.0))
REFLECTION = 0.9
DRIFT_K = 0.5
POSE_SD_M = 0.003


def image_kernel() -> Callable[..., None]:
    """Return a compiled renderer of the images of a box."""
    from numba import njit

    @njit(cache=False)
    def render(first, second, size, reflection, speeds, rate, out):
        taps = 24
        rows, length = out.shape
        for row in range(rows):
            far = speeds[row] * length / rate
            most = (far / size).astype(np.int64) // 2 + 1
            for i in range(-most[0], most[0] + 1):
                for j in range(-most[1], most[1] + 1):
                    for k in range(-most[2], most[2] + 1):
                        for flip in range(8):
                            square = 0.0
                            count = 0
                            for axis in range(3):
                                n = i if axis == 0 else (j if axis == 1 else k)
                                back = (flip >> axis) & 1
                                place = first[row, axis] * (1 - 2 * back)
                                gap = place + 2 * n * size[axis] - second[row, axis]
                                square += gap * gap
                                count += abs(2 * n - back)
                            distance = np.sqrt(square)
                            if distance >= far:
                                continue
                            level = reflection**count / distance
                            time = distance / speeds[row] * rate
                            start = int(np.floor(time)) - taps + 1
                            for tap in range(2 * taps):
                                place = start + tap
                                if place < 0 or place >= length:
                                    continue
                                x = place - time
                                wave = 1.0
                                if abs(x) > 1e-9:
                                    wave = np.sin(np.pi * x) / (np.pi * x)
                                wave *= 0.5 + 0.5 * np.cos(np.pi * x / taps)
                                out[row, place] += level * wave

    return render


def images(
    render: Callable[..., None],
    ends: tuple[np.ndarray, np.ndarray],
    size: tuple[float, float, float],
    duration: float,
    *,
    reflection: float = REFLECTION,
    speeds: np.ndarray | None = None,
) -> np.ndarray:
    """Return responses between places in a box, shape (rows, n)."""
    out = np.zeros((len(ends[0]), round(duration * RATE)))
    each = np.full(len(out), SPEED) if speeds is None else speeds
    render(ends[0], ends[1], np.array(size), reflection, each, RATE, out)
    return out


def pairs(
    size: tuple[float, float, float], count: int, places: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return both ends of pairs inside a box."""
    rng = np.random.default_rng(seed)
    inside = np.array(size) - 0.6
    emitters = 0.3 + rng.random((places, 3)) * inside
    listeners = 0.3 + rng.random((count, 3)) * inside
    return np.repeat(emitters, -(-count // places), axis=0)[:count], listeners


def coherence_horizon(
    frequencies: np.ndarray,
    speed_of_sound: float,
    uncertainty: Uncertainty,
    *,
    longest_s: float = 10.0,
) -> np.ndarray:
    """Return until when waveforms can be promised at each frequency, seconds.

    There the error reaches half the energy (-3 dB): 2 (1 - exp(-(k s)^2 / 2)) =
    1/2, k s = 0.76.
    """
    times = np.geomspace(1e-4, longest_s, 2000)
    spread = uncertainty.length_sd(times * speed_of_sound)
    allowed = 0.76 * speed_of_sound / (2 * np.pi * np.asarray(frequencies))
    inside = np.searchsorted(np.maximum.accumulate(spread), allowed)
    return np.where(inside > 0, times[np.clip(inside - 1, 0, len(times) - 1)], 0.0)


def horizon_errors(render: Callable[..., None], count: int) -> dict[str, float]:
    """Return the NMSE round the predicted horizon, dB, of rooms and octaves.

    Every row has its own air; each coordinate of both ends is off by 3 mm.
    """
    uncertainty = Uncertainty(pose_sd_m=POSE_SD_M, temperature_sd_k=DRIFT_K)
    found = {}
    for name in (*ROOMS, CORNERED):
        told, truth = _told_and_truth(render, name, count)
        for octave in (1000.0, 2000.0, 4000.0):
            end = float(coherence_horizon(np.array([octave]), SPEED, uncertainty)[0])
            wrong = _energy_near(truth - told, end, octave)
            ratio = wrong / _energy_near(truth, end, octave)
            key = f"{name}, {octave:.0f} Hz, {1e3 * end:.0f} ms"
            found[key] = float(10 * np.log10(ratio))
    return found


def _told_and_truth(
    render: Callable[..., None], name: str, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return responses at the stated places and where the ends really stood."""
    rng = np.random.default_rng(1)
    size = ROOMS.get(name, (6.0, 2.0, 3.0))
    count = count if name in ROOMS else 8 * count
    ends = pairs(size, count, 4, 2)
    moved = tuple(one + POSE_SD_M * rng.standard_normal(one.shape) for one in ends)
    speeds = SPEED * (1 + 0.0018 * DRIFT_K * rng.standard_normal(count))
    if name == CORNERED:
        return _in_the_corner(ends, (moved[0], moved[1]), speeds)
    told = images(render, ends, size, 0.2)
    truth = images(render, (moved[0], moved[1]), size, 0.2, speeds=speeds)
    return told, truth


def _in_the_corner(
    ends: tuple[np.ndarray, np.ndarray],
    moved: tuple[np.ndarray, np.ndarray],
    speeds: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of an L, by the mirror paths of its flat faces."""
    from rooms.mesh import MeshGeometry

    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, 3.0))
    walls = np.full(len(shape.planes), REFLECTION)
    room = MeshRoom(shape, SPEED, 0.0, walls, OMNI, OMNI, ideal_bank(36), RATE, 9, 60.0)
    told, truth = [], []
    for row, speed in enumerate(speeds):
        mine = slice(row, row + 1)
        first, second = Poses.of(ends[0][mine]), Poses.of(ends[1][mine])
        held = room.holding(first, second, round(0.2 * RATE))
        told.append(held.render(first, second, round(0.2 * RATE))[0])
        other = replace(held, speed_of_sound=float(speed))
        there = Poses.of(moved[0][mine]), Poses.of(moved[1][mine])
        truth.append(other.render(*there, round(0.2 * RATE))[0])
    return np.array(told), np.array(truth)


def _energy_near(responses: np.ndarray, time_s: float, frequency: float) -> float:
    """Return the energy of a third of an octave within 8 ms of a time."""
    half = round(0.008 * RATE)
    middle = min(max(round(time_s * RATE), half), responses.shape[1] - half)
    part = responses[:, middle - half : middle + half] * np.hanning(2 * half)
    bins = np.fft.rfftfreq(2 * half, 1 / RATE)
    inside = np.abs(np.log2(np.maximum(bins, 1) / frequency)) <= 1 / 6
    return float((np.abs(np.fft.rfft(part)[:, inside]) ** 2).sum())


def wrong_paths(render: Callable[..., None], count: int) -> dict[str, float]:
    """Return what the gate does in a room without the planes it was told."""
    size = ROOMS["6 x 4 x 3 m"]
    ends = pairs(size, count, 5, 3)
    told = images(render, ends, size, 0.1)
    rng = np.random.default_rng(0)
    times = np.arange(told.shape[1]) / RATE
    direct = np.linalg.norm(ends[0] - ends[1], axis=1) / SPEED
    diffuse = rng.standard_normal(told.shape) * np.exp(-35 * times)
    truth = np.where(times > direct[:, None] + 0.003, 0.06 * diffuse, told)
    rows = fit_rows(truth, *ends, RATE, SPEED)
    completion = Completion.fit(rows, told, None)
    late = completion.tiles.times >= 0.03
    off = float((completion.gate.shares[..., late] < 0.5).mean())
    poor = completion.gate.coherence[..., late] < 0.3
    answer = completion.apply(told, rows.emitters, rows.listeners)
    before = compare_rows(truth, told, RATE)
    after = compare_rows(truth, answer, RATE)
    return {
        "tiles after 30 ms switched off": off,
        "tiles after 30 ms with coherence below 0.3": float(poor.mean()),
        "alarms": float(len(completion.alarms)),
        **{f"{name} of paths": before[name] for name in ("C50", "T60", "STFT")},
        **{f"{name} completed": after[name] for name in ("C50", "T60", "STFT")},
    }


def right_paths(render: Callable[..., None], count: int) -> dict[str, float]:
    """Return what is changed where the paths are right to -34 dB."""
    size = ROOMS["6 x 4 x 3 m"]
    ends = pairs(size, count, 5, 4)
    truth = images(render, ends, size, 0.1)
    told = images(render, ends, size, 0.1, reflection=REFLECTION * 1.002)
    rows = fit_rows(truth, *ends, RATE, SPEED)
    completion = Completion.fit(rows, told, None)
    fresh = pairs(size, count, 7, 5)
    early = images(render, fresh, size, 0.1, reflection=REFLECTION * 1.002)
    emitters, listeners = Poses.of(fresh[0]), Poses.of(fresh[1])
    answer = completion.apply(early, emitters, listeners)
    back = completion.apply(early, listeners, emitters)
    change = compare_rows(early, answer, RATE)
    return {
        "STFT change": change["STFT"],
        "C50 change, dB": change["C50"],
        "energy changed, dB": float(
            10 * np.log10(((answer - early) ** 2).sum() / (early**2).sum() + 1e-30)
        ),
        "swap error": float(np.abs(answer - back).max() / np.abs(answer).max()),
    }


def length_cost(count: int, longest: float) -> dict[str, float]:
    """Return CPU seconds of completing 0.1 s and the longest response."""
    found = {}
    size = ROOMS["6 x 4 x 3 m"]
    ends = pairs(size, count, 5, 6)
    rng = np.random.default_rng(0)
    for duration in (0.1, 0.1, longest):
        times = np.arange(round(duration * RATE)) / RATE
        sound = rng.standard_normal((count, len(times))) * np.exp(-10 * times)
        rows = fit_rows(sound, *ends, RATE, SPEED)
        early = np.where(times < 0.1, sound, 0.0)
        started = time.process_time()
        completion = Completion.fit(rows, early, None)
        fitted = time.process_time()
        some = rows.emitters[:50], rows.listeners[:50]
        completion.apply(early[:50], *some)
        done = time.process_time()
        found[f"fit {duration} s, CPU s"] = fitted - started
        found[f"render {duration} s, CPU ms"] = 1e3 * (done - fitted) / 50
    return found


def whole_length(
    render: Callable[..., None], count: int, longest: float
) -> dict[str, float]:
    """Return CPU seconds of hearing the same room from 0.1 s and the longest response.

    Images to 0.12 s and, from 15 ms after the direct sound, noise as loud.
    """
    size = ROOMS["6 x 4 x 3 m"]
    ends = pairs(size, count, 5, 6)
    times = np.arange(round(longest * RATE)) / RATE
    told = np.zeros((count, len(times)))
    early = images(render, ends, size, 0.12)
    told[:, : early.shape[1]] = early
    noise = np.random.default_rng(0).standard_normal(told.shape)
    direct = np.linalg.norm(ends[0] - ends[1], axis=1)[:, None] / SPEED
    told += 0.1 * np.exp(-10 * times) * noise * (times > direct + 0.015)
    rows = fit_rows(told, *ends, RATE, SPEED)
    found = {}
    for duration in (0.1, 0.1, longest):
        part = rows.cut(round(duration * RATE))
        started = time.process_time()
        heard = room_in_rows(part)
        fitted = time.process_time()
        some = rows.emitters[:20], rows.listeners[:20]
        heard.predict(*some, part.n_samples)
        done = time.process_time()
        found[f"hear {duration} s, CPU s"] = fitted - started
        found[f"answer {duration} s, CPU ms"] = 1e3 * (done - fitted) / 20
    ratio = found[f"hear {longest} s, CPU s"] / found["hear 0.1 s, CPU s"]
    found[f"{longest:g} s over 0.1 s (1 s: 1.6)"] = ratio
    return found


def main(argv: Sequence[str]) -> int:
    """Print the answers and write them."""
    parser = make_parser(__doc__, "path_gate")
    options = parser.parse_args(argv)
    count, longest = (6, 0.2) if options.quick else (120, 1.0)
    judged, whole = (1, 12) if options.quick else (count, 3 * count)
    render = image_kernel()
    found = {
        "NMSE at the horizon, dB (-3 +-1.5)": horizon_errors(render, judged),
        "wrong paths": wrong_paths(render, count),
        "right paths": right_paths(render, count),
        "length of the completion": length_cost(3 * count, longest),
        "length of the whole": whole_length(render, whole, longest),
    }
    print("SIMULATED")
    for title, rows in found.items():
        print(title)
        for name, value in rows.items():
            print(f"  {name:48} {value:10.3g}")
    write_results(options.out, {"simulated": True, **found})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
