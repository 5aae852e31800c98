"""Compare the kitchen as it is planned with exhaustive simulations of its furniture.

The preset with its counter, cupboards, refrigerator and table, as the planner makes it,
against the same walls and pieces with all effects, many rays and one order more, and
below 300 Hz against a wave grid of more than twice the resolution; means over pairs of
places, per octave. The cost is that of a pair against the bare kitchen's, each by its
own plan, for one listener of an emitter, five and twenty.

Bar: levels within 1 dB, C50 within 0.3 dB, at most 3 times the cost of the bare room.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir.arrays import FloatArray
from rir.bands import crossover_gains
from rir.physics import decibels
from rooms import Scene, plan_effects, simulate
from rooms.builtin import load_scene
from rooms.places import random_places
from rooms.wave_grid import WaveGrid

RATE, DURATION = 16000, 0.5
LOW = ((88.0, 177.0), (177.0, 300.0))
"""What a grid is compared in [Hz]: the lowest octave, and the next up to 300 Hz."""


def split(responses: FloatArray, bounds: Sequence[tuple[float, float]]) -> FloatArray:
    """Return the responses in bands with sharp ends, shape (..., bands, n)."""
    n = responses.shape[-1]
    spectra = np.fft.rfft(responses, 2 * n)
    f = np.fft.rfftfreq(2 * n, 1 / RATE)
    parts = [spectra * ((f >= a) & (f < b)) for a, b in bounds]
    return np.stack([np.fft.irfft(p, 2 * n)[..., :n] for p in parts], axis=-2)


def octaves(responses: FloatArray, bands: FloatArray) -> FloatArray:
    """Return the responses in octaves, shape (..., bands, n)."""
    n = responses.shape[-1]
    centers = tuple(map(float, bands))
    weights = crossover_gains(centers, RATE, 2 * n)
    spectra = np.fft.rfft(responses, 2 * n)[..., None, :] * weights
    return np.fft.irfft(spectra, 2 * n)[..., :n]


def measures(signals: FloatArray, arrival: FloatArray) -> FloatArray:
    """Return level and C50 [dB] of signals (E, L, bands, n): (2, E, L, bands)."""
    energy = signals**2
    late = np.arange(signals.shape[-1]) / RATE >= arrival[..., None, None] + 0.05
    total, after = energy.sum(axis=-1), np.where(late, energy, 0.0).sum(axis=-1)
    return np.stack([decibels(total), decibels((total - after) / after)])


def low_truth(scene: Scene, ends: Any, cells: float) -> FloatArray:
    """Return both low bands of a fine grid, each with its octave's walls.

    Shape (E, L, 2, n), at the rate of the benchmark.
    """
    parts = [
        _grid_band(scene.furnished, octave, ends, cells) for octave in range(len(LOW))
    ]
    return np.stack(parts, axis=2)


def _grid_band(scene: Scene, octave: int, ends: Any, cells: float) -> FloatArray:
    from scipy.signal import resample

    walls = np.repeat(scene.absorption[:, [octave]], len(scene.bands), axis=1)
    grid = WaveGrid(replace(scene, absorption=walls), LOW[-1][1], cells)
    out = []
    for emitter in ends[0].positions:
        # the pressure of a closed room stays up: fade it, far behind what is heard
        heard = grid.responses(emitter, ends[1].positions, 2 * DURATION)
        steps = heard.shape[-1]
        left = np.minimum(np.arange(steps, 0, -1) / (steps / 3), 1.0)
        faded = heard * np.sin(np.pi / 2 * left) ** 2
        count = round(steps * RATE / grid.sample_rate)
        same = np.asarray(resample(faded, count, axis=-1), dtype=np.float64)
        band = split(same, LOW[octave : octave + 1])[:, 0, : round(RATE * DURATION)]
        out.append(band * grid.sample_rate / RATE)
    return np.array(out)


def cpu_s(run: Any) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


def timed(
    scene: Scene, ends: Any, plans: Any, listeners: int, times: int
) -> dict[str, float]:
    """Return the least time of a pair [ms], furnished and bare, and their ratio."""
    some = ends[0][:1], ends[1][:listeners]
    fixed: dict[str, Any] = {"sample_rate": RATE, "duration": DURATION}
    least = [np.inf, np.inf]
    for _ in range(times):
        for k, plan in enumerate(plans):
            took = cpu_s(lambda p=plan: simulate(scene, *some, plan=p, **fixed))
            least[k] = min(least[k], 1000 * took / listeners)
    ratio = least[0] / least[1]
    print(
        f"{listeners} listeners an emitter: furnished {least[0]:.1f} ms a pair, bare"
        f" {least[1]:.1f} ms: x{ratio:.1f}"
    )
    found = {"furnished_ms": least[0], "bare_ms": least[1], "ratio": ratio}
    return {"listeners": listeners} | {k: float(v) for k, v in found.items()}


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "furnished_kitchen", "four pairs, fewer rays")
    options = parser.parse_args(argv)
    quick = options.quick
    scene = load_scene("kitchen")
    count = (1, 4) if quick else (2, 20)
    drawn = sum(count) if quick else 54
    places = random_places(scene, drawn, np.random.default_rng(2))
    ends = places[: count[0]], places[count[0] : sum(count)]
    fixed: dict[str, Any] = {"sample_rate": RATE, "duration": DURATION}
    plan = plan_effects(scene, **fixed)
    bare = plan_effects(scene, without=["furniture"], **fixed)
    print("on:", ", ".join(plan.on))
    planned = simulate(scene, *ends, plan=plan, **fixed).responses
    rays = 4000 if quick else 40_000
    best = simulate(
        scene, *ends, effects=plan.on, rays=rays, max_order=4, **fixed
    ).responses
    apart = ends[1].positions[None] - ends[0].positions[:, None]
    arrival = np.linalg.norm(apart, axis=-1) / scene.speed_of_sound
    rows: list[dict[str, Any]] = []

    def compare(name: str, ours: FloatArray, truth: FloatArray, bands: Any) -> None:
        off = measures(ours, arrival) - measures(truth, arrival)
        for kind, values in zip(("level", "C50"), off, strict=True):
            mean = values.mean(axis=(0, 1))
            spread = values.std(axis=(0, 1))
            print(f"{name}, {kind} [dB]: {np.round(mean, 2)} ± {np.round(spread, 2)}")
            rows.append(
                {
                    "against": name,
                    "kind": kind,
                    "bands": list(bands),
                    "mean_db": mean.tolist(),
                    "spread_db": spread.tolist(),
                }
            )

    bands = scene.bands
    compare("mesh", octaves(planned, bands), octaves(best, bands), bands)
    many = ends if quick else (places[:4], places[4:])  # modes differ from pair to pair
    low = simulate(scene, *many, plan=plan, **fixed).responses
    apart = many[1].positions[None] - many[0].positions[:, None]
    arrival = np.linalg.norm(apart, axis=-1) / scene.speed_of_sound
    grid = low_truth(scene, many, 10.0 if quick else 16.0)
    compare("grid", split(low, LOW), grid, LOW)
    times = [
        timed(scene, ends, (plan, bare), some, 1 if quick else 5)
        for some in ((1, 4) if quick else (1, 5, 20))
    ]
    write_results(options.out, {"rows": rows, "times": times})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
