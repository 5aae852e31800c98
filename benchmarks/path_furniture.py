"""Measure what the path field makes of a box standing in the way of sound.

In a 5 x 4 x 2.6 m room every leg of every path (to order 8) that meets a box of 1 m3
goes round both its sides and over its top, each way late and as faint as Kurze and
Anderson say (Applied Acoustics 4, 1971); its five faces mirror, too. The loudspeaker is
directional, poses are told 3 mm wrong, noise is at -60 dB. At unseen places: levels of
direct sounds behind the box from 1 kHz up, with and without what was found, and the
volume it shares with the box. The room without the box must hold nothing. SIMULATED.

Bar: hidden direct sounds to 3 dB, 3 dB better than without; 0.3 of the volume shared.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit

from harness import make_parser, write_results
from inverse.bands.banded_room import BandedRoom
from inverse.find import room_in_rows
from inverse.rows.fitset import FitSet
from path_rooms import fit_rows, level_errors, loudspeaker

SIZE = np.array([5.0, 4.0, 2.6])
FACTORS = np.array([0.9, 0.82, 0.86, 0.9, 0.75, 0.85])
RATE, SAMPLES, SPECTRUM, SPEED = 16000.0, 960, 1200, 343.0
ORDER, FRONT, POSE_SD_M, HEIGHTS_M = 8, 0.3, 0.003, (0.3, 1.3)
FACE, NODES = 0.7, 24
CLEAR_WALL_M, CLEAR_BOX_M = 0.4, 0.25
JUDGED_HZ = (1000.0, 2000.0, 4000.0)
SHOWN = ("level_db", "without_db", "worse_without_db", "iou", "voxels", "cpu_s")
BARS = {"level_db": 3.0, "worse_without_db": 3.0, "iou": 0.3}


@dataclass(frozen=True, eq=False)
class Truth:
    """Hold the box that stands in the room; none where `low` is not below `high`."""

    low: np.ndarray
    high: np.ndarray
    order: int = ORDER

    @property
    def empty(self) -> bool:
        """Whether there is no box."""
        return bool((self.low >= self.high).any())


def drawn_truth(seed: int) -> Truth:
    """Return a room with its box near the middle."""
    rng = np.random.default_rng(seed)
    middle = SIZE[:2] / 2 + rng.uniform(-0.4, 0.4, 2)
    low = np.append(middle - 0.5, 0.0)
    return Truth(low, low + 1.0)


@njit(cache=True)
def meets(one, other, low, high):
    """Return whether a leg meets the box."""
    first, last = 0.0, 1.0
    for axis in range(3):
        step = other[axis] - one[axis]
        if abs(step) < 1e-12:
            if one[axis] <= low[axis] or one[axis] >= high[axis]:
                return False
            continue
        near, far = (low[axis] - one[axis]) / step, (high[axis] - one[axis]) / step
        first, last = max(first, min(near, far)), min(last, max(near, far))
    return last - first > 1e-9


@njit(cache=True)
def _cross(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def taut(one, other, corners, side):
    """Return the length of a string from end to end round the corners on a side."""
    at, length = one.copy(), 0.0
    for _ in range(len(corners) + 1):
        best, found = other.copy(), -1
        for k in range(len(corners)):
            if _cross(at, best, corners[k]) * side > 1e-9:
                best, found = corners[k].copy(), k
        length += np.sqrt(((best - at) ** 2).sum())
        at = best
        if found < 0:
            break
    return length


@njit(cache=True)
def detours(one, other, low, high, longer):
    """Write how much longer the ways to both sides and over the top are."""
    gap = other - one
    whole = np.sqrt((gap**2).sum())
    corners = np.empty((4, 2))
    for k in range(4):
        corners[k, 0] = low[0] if k % 2 == 0 else high[0]
        corners[k, 1] = low[1] if k // 2 == 0 else high[1]
    for side in range(2):
        sign = 1.0 - 2.0 * side
        plan = taut(one[:2].copy(), other[:2].copy(), corners, sign)
        longer[side] = np.sqrt(plan**2 + gap[2] ** 2) - whole
    along = np.sqrt(gap[0] ** 2 + gap[1] ** 2)
    first, last = 0.0, 1.0
    for axis in range(2):
        if abs(gap[axis]) > 1e-12:
            near = (low[axis] - one[axis]) / gap[axis]
            far = (high[axis] - one[axis]) / gap[axis]
            first, last = max(first, min(near, far)), min(last, max(near, far))
    top = np.array([[first * along, high[2]], [last * along, high[2]]])
    start, end = np.array([0.0, one[2]]), np.array([along, other[2]])
    longer[2] = taut(start, end, top, 1.0) - whole


@njit(cache=True, fastmath=True)
def around(longer, step, speed, nodes, way, out):
    """Multiply spectra by what comes round a box."""
    every = (len(out) - 1) // (nodes - 1) + 1
    way[:] = 0.0
    for side in range(3):
        level = np.empty(nodes)
        for k in range(nodes):
            root = np.sqrt(2 * np.pi * 2 * max(k * every * step, 1.0) / speed)
            root *= np.sqrt(max(longer[side], 1e-9))
            loss = 5.0 + 20.0 * np.log10(root / np.tanh(root))
            level[k] = 10.0 ** (-min(loss, 24.0) / 20.0)
        turn = np.exp(-2j * np.pi * step * longer[side] / speed)
        phase = 1.0 + 0.0j
        for k in range(len(out)):
            low = k // every
            part = (k - low * every) / every
            up = min(low + 1, nodes - 1)
            way[k] += (level[low] + part * (level[up] - level[low])) * phase
            phase *= turn
    for k in range(len(out)):
        out[k] *= way[k]


@njit(cache=True, fastmath=True)
def folded(place, size, out):
    """Write where a place of the unfolded room lies in the room."""
    for axis in range(3):
        turned = place[axis] % (2 * size[axis])
        out[axis] = min(turned, 2 * size[axis] - turned)


@njit(cache=True, fastmath=True)
def add_path(value, length, step, speed, path, out):
    turn = np.exp(-2j * np.pi * step * length / speed)
    phase = value / length + 0.0j
    for k in range(len(out)):
        out[k] += path[k] * phase
        phase *= turn


@njit(cache=True, fastmath=True)
def through(start, end, size, low, high, empty, step, speed, nodes, way, path):
    """Multiply what each leg of an unfolded way meets."""
    path[:] = 1.0
    if empty:
        return
    cuts = np.empty(64)
    cuts[0], n = 0.0, 1
    for axis in range(3):
        gap = end[axis] - start[axis]
        least, most = min(start[axis], end[axis]), max(start[axis], end[axis])
        near, far = int(np.ceil(least / size[axis])), int(most // size[axis])
        for wall in range(near, far + 1):
            cuts[n] = (wall * size[axis] - start[axis]) / gap
            n += 1
    cuts[n] = 1.0
    cuts[: n + 1].sort()
    one, other = np.empty(3), np.empty(3)
    longer = np.empty(3)
    for leg in range(n):
        inner = 1e-9 * (cuts[leg + 1] - cuts[leg])
        folded(start + (cuts[leg] + inner) * (end - start), size, one)
        folded(start + (cuts[leg + 1] - inner) * (end - start), size, other)
        if meets(one, other, low, high):
            detours(one, other, low, high, longer)
            around(longer, step, speed, nodes, way, path)


@njit(cache=True, fastmath=True)
def mirrored(e, h, ahead, front, low, high, side, face, step, speed, path, out):
    """Add what a face of the box mirrors; sides low x, high x, low y, high y, top."""
    axis = min(side // 2, 2)
    plane = high[axis] if side % 2 or side == 4 else low[axis]
    sign = 1.0 if side % 2 or side == 4 else -1.0
    a, b = sign * (e[axis] - plane), sign * (h[axis] - plane)
    if a <= 0 or b <= 0:
        return
    image = h.copy()
    image[axis] = 2 * plane - h[axis]
    spot = e + a / (a + b) * (image - e)
    for other in range(3):
        if other != axis and not low[other] < spot[other] < high[other]:
            return
    length = np.sqrt(((image - e) ** 2).sum())
    path[:] = face * (1 - front + front * np.dot(image - e, ahead) / length)
    add_path(1.0, length, step, speed, path, out)


@njit(cache=True, fastmath=True)
def render(
    emitters, listeners, ahead, size, factors, front, low, high, empty, order, speed,
    step, reach, face, nodes, out,
):  # fmt: skip
    """Add all paths of all rows to spectra, shape (rows, bins)."""
    way = np.empty(out.shape[1], dtype=np.complex128)
    path = np.empty(out.shape[1], dtype=np.complex128)
    most = (reach / (2 * size)).astype(np.int64) + 1
    image, m = np.empty(3), np.empty(3)
    for row in range(len(emitters)):
        e, h = emitters[row], listeners[row]
        for number in range((2 * most[0] + 1) * (2 * most[1] + 1) * (2 * most[2] + 1)):
            m[0] = number % (2 * most[0] + 1) - most[0]
            m[1] = number // (2 * most[0] + 1) % (2 * most[1] + 1) - most[1]
            m[2] = number // ((2 * most[0] + 1) * (2 * most[1] + 1)) - most[2]
            for flip in range(8):
                value, bounces, square = 1.0, 0.0, 0.0
                for axis in range(3):
                    odd = (flip >> axis) & 1
                    image[axis] = (1 - 2 * odd) * h[axis] + 2 * m[axis] * size[axis]
                    square += (image[axis] - e[axis]) ** 2
                    first, second = abs(m[axis] - odd), abs(m[axis])
                    value *= factors[2 * axis] ** first
                    value *= factors[2 * axis + 1] ** second
                    bounces += first + second
                length = np.sqrt(square)
                if bounces > order or length > reach:
                    continue
                value *= 1 - front + front * np.dot(image - e, ahead[row]) / length
                through(e, image, size, low, high, empty, step, speed, nodes, way, path)
                add_path(value, length, step, speed, path, out[row])
        if empty or order == 0:
            continue
        for side in range(5):
            mirrored(e, h, ahead[row], front, low, high, side, face, step, speed, path,
                     out[row])  # fmt: skip


def spectra_of(
    truth: Truth, first: np.ndarray, second: np.ndarray, yaw: np.ndarray
) -> np.ndarray:
    """Return spectra of true places, shape (rows, bins)."""
    step = RATE / SPECTRUM
    ahead = np.stack([np.cos(yaw), np.sin(yaw), 0 * yaw], axis=1)
    out = np.zeros((len(first), SPECTRUM // 2 + 1), dtype=complex)
    render(
        first, second, ahead, SIZE, FACTORS, FRONT, truth.low, truth.high, truth.empty,
        truth.order, SPEED, step, (SAMPLES + 40) / RATE * SPEED, FACE, NODES, out,
    )  # fmt: skip
    return np.asarray(out * loudspeaker(SPECTRUM, RATE))


@dataclass(frozen=True, eq=False)
class Rows:
    """Hold rows as told and the places they truly stand."""

    told: FitSet
    first: np.ndarray
    second: np.ndarray
    yaw: np.ndarray


def rows_of(truth: Truth, emitters: int, listeners: int, seed: int) -> Rows:
    """Return noisy rows at places told wrong."""
    rng = np.random.default_rng(seed)
    count = emitters * listeners
    told = _clear(truth, rng, emitters).repeat(listeners, axis=0)
    heard = _clear(truth, rng, count)
    yaw = rng.uniform(0, 2 * np.pi, count)
    first = told + POSE_SD_M * rng.standard_normal(told.shape)
    second = heard + POSE_SD_M * rng.standard_normal(heard.shape)
    responses = np.fft.irfft(spectra_of(truth, first, second, yaw), SPECTRUM)
    responses = responses[:, :SAMPLES]
    loud = np.abs(responses).max(axis=1, keepdims=True)
    responses = responses + 1e-3 * loud * rng.standard_normal(responses.shape)
    held = fit_rows(responses, told, heard, RATE, SPEED, yaw)
    return Rows(held, first, second, yaw)


def _clear(truth: Truth, rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw places that stand clear of walls and box."""
    low = np.array([CLEAR_WALL_M, CLEAR_WALL_M, HEIGHTS_M[0]])
    high = np.array([SIZE[0] - CLEAR_WALL_M, SIZE[1] - CLEAR_WALL_M, HEIGHTS_M[1]])
    tried = rng.uniform(low, high, (8 * count + 50, 3))
    near, far = truth.low - CLEAR_BOX_M, truth.high + CLEAR_BOX_M
    away = ((tried < near) | (tried > far)).any(axis=1)
    return tried[away][:count]


def hidden(truth: Truth, rows: Rows) -> np.ndarray:
    """Return which direct sounds meet the box."""
    pairs = zip(rows.first, rows.second, strict=True)
    return np.array([meets(a, b, truth.low, truth.high) for a, b in pairs])


def levels(spectra: np.ndarray, hertz: np.ndarray) -> np.ndarray:
    """Return levels of the octaves judged, shape (rows, octaves), decibels."""
    power = np.abs(spectra) ** 2
    near = [np.abs(np.log2(hertz / center + 1e-9)) < 0.5 for center in JUDGED_HZ]
    told = [power[:, octave].sum(axis=1) for octave in near]
    return 10 * np.log10(np.stack(told, axis=1) + 1e-30)


def direct_errors(truth: Truth, rows: Rows, room: BandedRoom) -> np.ndarray:
    """Return errors of levels of direct sounds, shape (rows, octaves), decibels."""
    truly = spectra_of(replace(truth, order=0), rows.first, rows.second, rows.yaw)
    alone = replace(room, room=room.room.with_order(0, 0), scatterers=None)
    told = alone.images(rows.told.emitters, rows.told.listeners) * room.source
    heard = levels(truly, np.fft.rfftfreq(SPECTRUM, 1 / RATE))
    # spectra are of other lengths
    return levels(told * np.sqrt(SPECTRUM / room.grid.size), room.grid.hertz) - heard


def overlap(truth: Truth, room: BandedRoom) -> float:
    """Return the volume of what was found and the box over that of either."""
    if room.occluders is None:
        return 0.0
    solid, fine = room.occluders.solid, 5
    sizes = room.room.box.high - room.room.box.low
    counts = np.array(solid.shape) * fine
    axes = [(np.arange(n) + 0.5) * s / n for n, s in zip(counts, sizes, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) + room.room.box.low
    points = points @ room.room.box.axes + room.room.box.origin
    truly = ((points > truth.low) & (points < truth.high)).all(axis=-1)
    for axis in range(3):
        solid = solid.repeat(fine, axis=axis)
    return float((solid & truly).sum() / max((solid | truly).sum(), 1))


def measured(truth: Truth, train: Rows, test: Rows) -> dict[str, Any]:
    """Fit, and judge unseen emitters."""
    start = time.process_time()
    heard = room_in_rows(train.told)
    told: dict[str, Any] = {"cpu_s": time.process_time() - start}
    answer = heard.predict(test.told.emitters, test.told.listeners, SAMPLES)
    told["nmse_db"] = float(np.median(level_errors(test.told.responses, answer)))
    told["alarms"] = heard.alarms
    room = getattr(heard.fitted, "banded", None)
    held = None if room is None else room.occluders
    told["voxels"] = 0 if held is None else int(held.solid.sum())
    if room is None or truth.empty:
        return told
    behind = hidden(truth, test)
    told["hidden_percent"] = 100 * float(behind.mean())
    told["iou"] = overlap(truth, room)
    rooms = {"level_db": room, "without_db": replace(room, occluders=None)}
    for name, one in rooms.items():
        gap = np.abs(direct_errors(truth, test, one)[behind])
        told[name] = float(gap.mean())
        told[name.replace("_db", "_by_octave_db")] = gap.mean(axis=0).tolist()
    told["worse_without_db"] = told["without_db"] - told["level_db"]
    return told


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0."""
    parser = make_parser(__doc__, "path_furniture", "one room, few rows")
    options = parser.parse_args(argv)
    seeds, emitters, listeners = ((0,), 2, 5) if options.quick else ((0, 1, 2), 6, 60)
    print("SIMULATED  " + "  ".join(f"{name:>16}" for name in SHOWN))
    results: dict[str, Any] = {"bars": BARS}
    for seed in seeds:
        truth = drawn_truth(seed)
        if options.quick:
            truth = replace(truth, order=3)
        rooms = {f"box {seed}": truth}
        if not options.quick:
            rooms[f"empty {seed}"] = replace(truth, low=truth.high)
        for name, one in rooms.items():
            train = rows_of(one, emitters, listeners, 10 * seed)
            test = rows_of(one, emitters + 2, listeners // 2, 10 * seed + 1)
            results[name] = measured(one, train, test)
            shown = [results[name].get(key, float("nan")) for key in SHOWN]
            print(f"{name:10} " + "  ".join(f"{value:16.2f}" for value in shown))
    write_results(options.out, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
