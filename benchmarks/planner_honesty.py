"""Check that what the planner leaves off does not matter, on random scenes.

Each scene is simulated twice with equal seeds: as planned, and with every effect
on. Level, T60, C50 and EDT per octave, means over a few pairs, must differ by less
than the tolerance (the just-noticeable differences of ISO 3382-1).
"""

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rir import GainPattern
from rir.room import Air
from rooms import Plan, Scene, plan_effects, simulate
from rooms.effects import EFFECTS, Tolerance
from rooms.effort import decay_parameters
from rooms.places import random_places

KINDS = ("level_db", "clarity_db", "reverberation_percent", "early_decay_percent")
BOX_ONLY = ("transmission", "modes", "motion", "hardware", "diffraction")


def random_scene(rng: np.random.Generator) -> tuple[Scene, int, float]:
    """Draw a box, its materials, air and patterns, a sample rate and a length."""
    size = rng.uniform([2.5, 2.5, 2.2], [12, 9, 5])
    slope = rng.uniform(-0.6, 0.6) * np.linspace(-1, 1, 7)
    absorption = np.clip(rng.uniform(0.05, 0.6, (6, 1)) * np.exp(slope), 0.01, 0.95)
    kind = rng.random()
    scattering = 0.0 if kind < 0.3 else rng.choice([0.002, 0.01, 0.05, 0.2, 0.5])
    alpha = rng.choice([1.0, 1.0, 0.99, 0.9, 0.5])
    air = Air(
        temperature_c=float(rng.uniform(10, 30)),
        humidity_percent=float(rng.uniform(20, 80)),
    )
    scene = Scene.shoebox(
        size,
        absorption=absorption,
        scattering=float(scattering),
        air=air,
        emitter_gain=GainPattern.first_order(float(alpha)),
    )
    rate = int(rng.choice([1000, 2000, 4000, 8000, 16000]))
    longest = float(scene.eyring_t60().max())
    return scene, rate, float(np.clip(longest, 0.15, 1.0))


def measure(scene: Scene, plan: Plan, rate: int, duration: float, seed: int) -> Any:
    """Return parameters (kinds, pairs, bands) and the CPU seconds."""
    from rooms.bands import band_weights

    rng = np.random.default_rng(seed)
    places = random_places(scene, 5, rng)
    run = {"sample_rate": rate, "duration": duration, "plan": plan, "seed": seed}
    h = simulate(scene, places[:1], places[1:], **run).responses[0]
    start = time.process_time()
    simulate(scene, places[:1], places[1:], **run)
    took = time.process_time() - start
    heard = scene.bands[scene.bands < rate / 2]
    n = h.shape[-1]
    weights = band_weights(tuple(map(float, heard)), rate, 2 * n)
    bands = np.fft.irfft(np.fft.rfft(h, 2 * n)[:, None] * weights, 2 * n)[..., :n] ** 2
    return decay_parameters(bands, 1 / rate), took


def compare(seed: int) -> dict[str, Any]:
    """Return the largest change of each kind over octaves, and the times."""
    rng = np.random.default_rng(seed)
    scene, rate, duration = random_scene(rng)
    chosen = plan_effects(scene, sample_rate=rate, duration=duration)
    names = [name for name in EFFECTS if name not in BOX_ONLY]
    full = plan_effects(scene, sample_rate=rate, duration=duration, only=names)
    lean, lean_s = measure(scene, chosen, rate, duration, seed)
    rich, rich_s = measure(scene, full, rate, duration, seed)
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.abs(lean - rich)
        change[2:] = 100 * change[2:] / rich[2:]
    mean = np.nanmean(np.where(np.isfinite(change), change, np.nan), axis=1)
    worst = np.nanmax(np.nan_to_num(mean), axis=1)
    off = [name for name in names if name not in chosen.on]
    return {
        "seed": seed,
        "off": off,
        "changes": dict(zip(KINDS, worst.tolist(), strict=True)),
        "lean_s": lean_s,
        "full_s": rich_s,
    }


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="6 scenes, not 200")
    parser.add_argument("--out", default="results/planner_honesty.json")
    options = parser.parse_args(argv)
    count = 6 if options.quick else 200
    limits = vars(Tolerance())
    compare(0)  # compile first
    rows = [compare(seed) for seed in range(count)]
    for row in rows:
        row["kept"] = all(row["changes"][kind] <= limits[kind] for kind in KINDS)
        if not row["kept"]:
            print(f"scene {row['seed']}: off {row['off']}, changes {row['changes']}")
    kept = sum(row["kept"] for row in rows)
    saved = 1 - sum(r["lean_s"] for r in rows) / sum(r["full_s"] for r in rows)
    leaner = [row for row in rows if set(row["off"]) - {"patterns"}]
    print(f"{kept} of {count} scenes within tolerance ({100 * kept / count:.1f} %)")
    print(f"effects left off in {len(leaner)} scenes; time saved {100 * saved:.0f} %")
    path = Path(options.out)
    path.parent.mkdir(parents=True, exist_ok=True)
    report = {"kept": kept, "scenes": count, "time_saved": saved, "rows": rows}
    path.write_text(json.dumps(report, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
