"""Compare boxes that scatter with energy rays that are traced here.

Boxes of 2 to 40 m, absorption 0.02 to 0.9 and scattering 0 to 1, each wall its own;
rays with Lambert walls are heard where they pass balls around the listeners. Means over
pairs of T30, EDT, C80 and level from 0.7 to 5.6 kHz; a difference counts as what is
beyond two standard errors. Then milliseconds per pair and per scene, and exchange.

Bar: T30 0.5 %, EDT 1 %, C80 0.1 dB, level 0.05 dB beyond two standard errors; 3 ms a
pair with scattering, 0.5 s long, 1 emitter and 100 listeners; exchange changes no bit.
"""

import time

import numpy as np
from numba import njit

from harness import make_parser, write_results
from rooms import Scene, simulate
from rooms.transport import FINE, find_places, pair_energy, transport_of

RATE, C = 16000, 343.2
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


def compare(seed: int, rays: int, listeners: int) -> tuple[np.ndarray, np.ndarray, str]:
    """Return mean differences of one box, their standard errors, and its line."""
    size, absorption, scattering, rng = draw_box(seed)
    absorbed, spread = (
        dict(zip(WALLS, x.tolist(), strict=True)) for x in (absorption, scattering)
    )
    scene = Scene.shoebox(size, absorption=absorbed, scattering=spread)
    longest = float(np.clip(1.5 * scene.eyring_t60(air=False)[0], 0.15, 2.0))
    steps = int(longest / STEP)
    emitter = rng.uniform(0.2, 0.8, 3) * size
    places = rng.uniform(0.12, 0.88, (listeners, 3)) * size
    radius = min(0.25, 0.1 * size.min())
    truth = ray_energy(
        size, absorption, scattering, emitter, places, radius, steps, rays, rng
    )
    made = simulate(
        scene, emitter, places, sample_rate=RATE, duration=steps * STEP,
        effects=EFFECTS, seed=seed,
    )  # fmt: skip
    heard = band_energy(made.responses[0], steps)
    arrivals = np.linalg.norm(places - emitter, axis=1) / C
    ours, theirs = (
        np.array([parameters(e, t) for e, t in zip(energy, arrivals, strict=True)])
        for energy in (heard, truth)
    )
    scale = [*(100 / np.nanmean(theirs[:, :2], axis=0)), 1, 1]
    off = (ours - theirs) * scale
    mean, error = np.nanmean(off, axis=0), np.nanstd(off, axis=0) / np.sqrt(listeners)
    shown = " ".join(f"{m:+6.2f} ±{e:5.2f}" for m, e in zip(mean, error, strict=True))
    lengths = " x ".join(f"{x:4.1f}" for x in size)
    decay = f"T {np.nanmean(theirs[:, 0]):5.2f} s"
    return mean, error, f"{seed:3d}  {lengths} m  {decay}  {shown}"


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
    boxes, rays, listeners = (3, 20_000, 8) if args.quick else (30, 120_000, 24)
    print("seed  box  T30 [%]  EDT [%]  C80 [dB]  level [dB], means ± standard errors")
    beyond = np.zeros(4)
    for seed in range(args.first, args.first + boxes):
        mean, error, line = compare(seed, rays, listeners)
        excess = np.maximum(np.abs(mean) - 2 * error, 0)
        beyond = np.fmax(beyond, excess)
        print(line, "" if np.all(np.nan_to_num(excess) <= BARS) else " *", flush=True)
    swap = max(exchange_error(args.first + k) for k in range(3))
    first, each = time_pairs(20 if args.quick else 100)
    figure = (
        f"beyond two standard errors {beyond[0]:.2f} %, {beyond[1]:.2f} %,"
        f" {beyond[2]:.2f} dB, {beyond[3]:.3f} dB; {each:.1f} ms a pair,"
        f" {first:.2f} s a scene; exchange {swap:g}"
    )
    print(figure)
    write_results(args.out, {"beyond": beyond.tolist(), "ms": each, "swap": swap})


if __name__ == "__main__":
    main()
