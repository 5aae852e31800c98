"""Compare boxes that scatter with energy rays that are traced here.

Boxes of 2 to 40 m, absorption 0.02 to 0.9 and scattering 0 to 1, each wall its own;
rays with Lambert walls are heard where they pass balls around the listeners, more of
them the shorter the decay. Means over pairs of T30, EDT, C80 and level from 0.7 to 5.6
kHz, of the energies of transport (e) and of waveforms, whose waves add chance; a
difference counts as what is beyond two standard errors. Then milliseconds per pair and
per scene, and exchange.

Bar: T30 0.5 %, EDT 1 %, C80 0.1 dB, level 0.05 dB beyond two standard errors; 3 ms a
pair with scattering, 0.5 s long, 1 emitter and 100 listeners; exchange changes no bit.
"""

import time

import numpy as np
from numba import njit

from harness import make_parser, write_results
from rooms import Scene, simulate
from rooms.transport import (
    FINE,
    find_places,
    image_energy,
    pair_energy,
    transport_of,
)

RATE, C = 16000, 343.2
LONGEST = 2.0  # s: no decay is followed longer
BATCHES = 4  # of rays, which all listeners share: they tell what the rays stray by
STEP = 0.001
WALLS = ("x0", "x1", "y0", "y1", "floor", "ceiling")
EFFECTS = ["direct", "specular", "scattering", "late"]
BARS = np.array([0.5, 1.0, 0.1, 0.05])


@njit(cache=True, nogil=True)
def ray_energy(size, absorption, scattering, source, places, radius, steps, count, rng):
    """Return energy at places over time, in the unit of a direct sound of 1/d."""
    out = np.zeros((len(places), steps))
    at, way = np.empty(3), np.empty(3)
    for _ in range(count):
        at[:] = source
        way[2], turn = 2 * rng.random() - 1, 2 * np.pi * rng.random()
        flat = np.sqrt(1 - way[2] ** 2)
        way[0], way[1] = flat * np.cos(turn), flat * np.sin(turn)
        left, gone = 1.0, 0.0
        while gone < steps * STEP * C and left > 1e-9:
            ahead, axis = 1e30, 0
            for k in range(3):
                if abs(way[k]) > 1e-12:
                    gap = ((size[k] if way[k] > 0 else 0.0) - at[k]) / way[k]
                    if gap < ahead:
                        ahead, axis = gap, k
            for m in range(len(places)):
                along, square = 0.0, -radius * radius
                for k in range(3):
                    off = places[m, k] - at[k]
                    along += off * way[k]
                    square += off * off
                inside = along * along - square
                if inside > 0:
                    low = max(0.0, along - np.sqrt(inside))
                    high = min(ahead, along + np.sqrt(inside))
                    row = int((gone + (low + high) / 2) / C / STEP)
                    if high > low and row < steps:
                        out[m, row] += left * (high - low)
            gone += ahead
            for k in range(3):
                at[k] = min(max(at[k] + ahead * way[k], 0.0), size[k])
            far = at[axis] > size[axis] / 2
            wall = 2 * axis + (1 if far else 0)
            left *= 1 - absorption[wall]
            way[axis] = -way[axis]
            if rng.random() < scattering[wall]:
                u, turn = rng.random(), 2 * np.pi * rng.random()
                way[axis] = -np.sqrt(u) if far else np.sqrt(u)
                way[(axis + 1) % 3] = np.sqrt(1 - u) * np.cos(turn)
                way[(axis + 2) % 3] = np.sqrt(1 - u) * np.sin(turn)
    # density of energy, times 4 pi, per second of passing
    return out * 4 * np.pi / (count * 4 / 3 * np.pi * radius**3)


def band_energy(responses: np.ndarray, steps: int) -> np.ndarray:
    """Return energy from 0.7 to 5.6 kHz per millisecond, as if of all frequencies."""
    from scipy.signal import butter, sosfiltfilt, sosfreqz

    band = butter(4, [700, 5600], "band", fs=RATE, output="sos")
    _, gain = sosfreqz(band, 4096, fs=RATE)
    heard = sosfiltfilt(band, responses, axis=-1) ** 2 / np.mean(np.abs(gain) ** 4)
    return heard.reshape(len(responses), steps, -1).sum(axis=-1)


def parameters(energy: np.ndarray, arrival: float) -> list[float]:
    """Return T30, EDT [s], C80 and level [dB] of energies per millisecond."""
    left = np.cumsum(energy[::-1])[::-1]
    curve = 10 * np.log10(np.maximum(left / left[0], 1e-30))
    times = []
    for high, low in ((-5, -35), (1, -10)):
        some = np.nonzero((curve < high) & (curve > low))[0]
        slope = np.polyfit(some, curve[some], 1)[0] if len(some) > 2 else np.nan
        times.append(-60 * STEP / slope if slope < 0 else np.nan)
    split = int(arrival / STEP) + 80
    late = left[split] if split < len(left) and left[split] > 1e-5 * left[0] else np.nan
    return [*times, 10 * np.log10((left[0] - late) / late), 10 * np.log10(left[0])]


def draw_box(
    seed: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.random.Generator]:
    """Return lengths, absorption, scattering, and what draws places."""
    rng = np.random.default_rng(seed)
    size = np.exp(rng.uniform(np.log(2), np.log(40), 3))
    return size, rng.uniform(0.02, 0.9, 6), rng.uniform(0, 1, 6), rng


def energies(
    size: np.ndarray,
    walls: tuple[np.ndarray, np.ndarray],
    ends: tuple[np.ndarray, np.ndarray],
    steps: int,
) -> np.ndarray:
    """Return what transport brings from an emitter to places per step, no waveforms."""
    absorption, scattering = (wall[:, None] for wall in walls)
    box = transport_of(size, absorption, scattering, C, steps * STEP, FINE)
    kept = (1 - absorption) * (1 - scattering)
    emitter, places = ends
    (one,) = find_places(box, emitter[None])
    span = C, STEP, steps
    out, _ = image_energy(size, kept, ends, span, (0, np.zeros(steps)))
    out = STEP * out[..., 0]
    for row, other in zip(out, find_places(box, places), strict=True):
        row += STEP * pair_energy(box, one, other, STEP, steps)[:, 0]
        apart = float(np.linalg.norm(other.position - emitter))
        row[int(apart / C / STEP)] += 1 / apart**2
    return out


def differences(
    ours: np.ndarray, theirs: np.ndarray, arrivals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean differences over places, and standard errors of places and rays.

    `theirs` holds batches of rays, shape (batches, places, steps).
    """
    here, there, *each = (
        np.array([parameters(e, t) for e, t in zip(energy, arrivals, strict=True)])
        for energy in (ours, theirs.mean(axis=0), *theirs)
    )
    scale = np.array([*(100 / np.nanmean(there[:, :2], axis=0)), 1, 1])
    off = (here - there) * scale
    known = np.maximum(np.isfinite(off).sum(axis=0), 1)
    places = np.nanstd(off, axis=0) / np.sqrt(known)
    with np.errstate(invalid="ignore"):
        batches = [np.nanmean((one - there) * scale, axis=0) for one in each]
    rays = np.nanstd(batches, axis=0, ddof=1) / np.sqrt(len(each))
    return np.nanmean(off, axis=0), np.hypot(places, np.nan_to_num(rays))


def shown(mean: np.ndarray, error: np.ndarray) -> str:
    words = " ".join(f"{m:+6.2f} ±{e:5.2f}" for m, e in zip(mean, error, strict=True))
    return words + ("  " if np.all(excess(mean, error) <= BARS) else " *")


def excess(mean: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Return what is beyond two standard errors."""
    return np.nan_to_num(np.maximum(np.abs(mean) - 2 * error, 0))


def compare(seed: int, rays: int, listeners: int) -> np.ndarray:
    """Return excesses of one box's energies and waveforms, (2, 4); print its line."""
    size, absorption, scattering, rng = draw_box(seed)
    absorbed, spread = (
        dict(zip(WALLS, x.tolist(), strict=True)) for x in (absorption, scattering)
    )
    scene = Scene.shoebox(size, absorption=absorbed, scattering=spread)
    longest = float(np.clip(1.5 * scene.eyring_t60(air=False)[0], 0.15, LONGEST))
    steps, count = int(longest / STEP), int(rays * LONGEST / longest)
    emitter = rng.uniform(0.2, 0.8, 3) * size
    places = rng.uniform(0.12, 0.88, (listeners, 3)) * size
    radius = min(0.25, 0.1 * size.min())
    rays = count // BATCHES
    ear = emitter, places, radius, steps, rays, rng
    truth = np.stack(
        [ray_energy(size, absorption, scattering, *ear) for _ in range(BATCHES)]
    )
    made = simulate(
        scene, emitter, places, sample_rate=RATE, duration=steps * STEP,
        effects=EFFECTS, seed=seed,
    )  # fmt: skip
    ends = emitter, places
    ours = energies(size, (absorption, scattering), ends, steps)
    heard = band_energy(made.responses[0], steps)
    arrivals = np.linalg.norm(places - emitter, axis=1) / C
    found = [differences(each, truth, arrivals) for each in (ours, heard)]
    lengths = " x ".join(f"{x:4.1f}" for x in size)
    one, other = (shown(*each) for each in found)
    print(f"{seed:3d}  {lengths} m  {longest:4.2f} s  e {one}  {other}", flush=True)
    return np.array([excess(*each) for each in found])


def time_pairs(listeners: int) -> tuple[float, float]:
    """Return CPU seconds of a scene, and CPU milliseconds of each further pair."""
    rng, size = np.random.default_rng(0), np.array([6.0, 5.0, 3.0])
    places = rng.uniform(0.1, 0.9, (listeners, 3)) * size
    run = {"sample_rate": RATE, "duration": 0.5, "effects": EFFECTS}
    spent = []
    for count, absorption in ((1, 0.2), (1, 0.21), (listeners, 0.21)):
        scene = Scene.shoebox(size, absorption=absorption, scattering=0.2)
        start = time.process_time()
        simulate(scene, size * 0.3, places[:count], **run)
        spent.append(time.process_time() - start)
    return spent[1], 1000 * spent[2] / listeners


def exchange_error(seed: int) -> float:
    """Return the largest difference that exchanging the ends of a pair makes."""
    size, absorption, scattering, rng = draw_box(seed)
    walls = absorption[:, None], scattering[:, None]
    box = transport_of(size, *walls, C, 0.3, FINE)
    one, other = find_places(box, rng.uniform(0, 1, (2, 3)) * size)
    there = pair_energy(box, one, other, STEP, 300)
    back = pair_energy(box, other, one, STEP, 300)
    return float(np.abs(there - back).max())


def main() -> None:
    parser = make_parser(__doc__, "box_transport")
    parser.add_argument("--first", type=int, default=500, help="seed of the first box")
    args = parser.parse_args()
    boxes, rays, listeners = (3, 20_000, 8) if args.quick else (30, 300_000, 24)
    print("seed  box  T30 [%]  EDT [%]  C80 [dB]  level [dB], means ± standard errors")
    seeds = range(args.first, args.first + boxes)
    found = np.array([compare(seed, rays, listeners) for seed in seeds])
    within = (found <= BARS).sum(axis=0)
    beyond = found.max(axis=0)
    swap = max(exchange_error(args.first + k) for k in range(3))
    first, each = time_pairs(20 if args.quick else 100)
    for name, most, count in zip(
        ("energies", "waveforms"), beyond, within, strict=True
    ):
        print(
            f"{name}: beyond two standard errors {most[0]:.2f} %, {most[1]:.2f} %,"
            f" {most[2]:.2f} dB, {most[3]:.3f} dB; within the bar of {boxes}: T30"
            f" {count[0]}, EDT {count[1]}, C80 {count[2]}, level {count[3]}"
        )
    print(f"{each:.1f} ms a pair, {first:.2f} s a scene; exchange {swap:g}")
    results = {"beyond": beyond.tolist(), "within": within.tolist()}
    write_results(args.out, results | {"ms": each, "swap": swap})


if __name__ == "__main__":
    main()
