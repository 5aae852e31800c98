"""Draw what accuracy costs: error against seconds for every knob, scene by scene.

One emitter, four listeners. One knob is turned at a time, all else is as the planner
has it; the reference has the highest order, 64,000 rays and every effect that changes
anything. Errors are of C50, the mean over octaves and pairs; seconds are CPU seconds of
one pair. The cheapest setting within the just-noticeable difference of 1 dB is marked.

`--picture docs/pictures/accuracy-costs.png` draws the page of the documents,
`--draw results/accuracy_costs.json` does so from what was measured before.
"""

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir.arrays import FloatArray
from rooms import Scene, plan_effects, simulate
from rooms.builtin import load_scene
from rooms.cost import clarity_per_octave, merge_bands, scaled_tolerance
from rooms.places import random_places

JND = 1.0  # dB of C50, ISO 3382-1 table A.1
RATE = 16000
BEST = {"rays": 64_000, "max_order": 5}
LEAST = 0.003  # dB: what is nearer to the reference is drawn here


def hall() -> Scene:
    """Return a hall of 24 x 16 x 9 m with an audience and absorbing back wall."""
    materials = {
        "floor": "audience_on_upholstered_seats",
        "wall1": "heavy_curtain",
        "all": {"material": "plaster_on_masonry", "scattering": 0.2},
    }
    outline = [(0, 0), (24, 2), (24, 14), (0, 16)]
    return Scene.extruded(outline, 9.0, materials, name="hall")


SCENES: dict[str, tuple[Callable[[], Scene], float]] = {
    "kitchen": (lambda: load_scene("kitchen"), 0.5),
    "l-shaped": (lambda: load_scene("l-shaped"), 0.6),
    "coupled": (lambda: load_scene("coupled"), 0.8),
    "hall": (hall, 1.2),
}


def knobs_of(scene: Scene, duration: float) -> dict[str, list[tuple[str, Any]]]:
    """Return knobs, each with its named options of `simulate`."""
    plan = plan_effects(scene, sample_rate=RATE, duration=duration)
    room = plan.stage(scene)
    knobs: dict[str, list[tuple[str, Any]]] = {
        "as planned": [("plan", {})],
        "order": [(str(n), {"max_order": n}) for n in (0, 1, 2, 4)],
        "rays": [(str(n), {"rays": n}) for n in (1000, 4000, 16000)],
        "accuracy": [
            (f"C50 {limit:g} dB", {"accuracy": f"C50 {limit:g} dB"})
            for limit in (0.3, 1.0, 2.0)
        ],
        "tolerance": [
            (f"x{k:g}", {"tolerance": scaled_tolerance(k)}) for k in (0.25, 2, 4)
        ],
        "bands": [(str(n), {"scene": merge_bands(room, n)}) for n in (1, 3)],
        "length": [
            (f"{part * duration:.2f} s", {"duration": part * duration})
            for part in (0.25, 0.5)
        ],
    }
    off = [name for name in plan.on if name not in ("direct", "specular", "late")]
    knobs["effect off"] = [
        (name, {"effects": [other for other in plan.on if other != name]})
        for name in off
    ]
    return knobs


def responses(scene: Scene, places: Any, options: dict[str, Any]) -> FloatArray:
    """Return the responses of one emitter to all others with some options."""
    chosen = {"sample_rate": RATE, **options}
    room = chosen.pop("scene", scene)
    plan = None
    if "tolerance" in chosen:
        limits = {k: v for k, v in chosen.items() if k != "accuracy"}
        plan = plan_effects(room, **limits)
        chosen.pop("tolerance")
    return simulate(room, places[:1], places[1:], **chosen, plan=plan).responses


def measure(name: str, quick: bool) -> list[dict[str, Any]]:
    """Return points of error and seconds of all settings in a scene."""
    build, duration = SCENES[name]
    scene, duration = build(), 0.3 if quick else duration
    places = random_places(scene, 2 if quick else 5, np.random.default_rng(0))
    centers = scene.bands[scene.bands < RATE / 2]

    def clarity(made: FloatArray) -> FloatArray:
        return clarity_per_octave(made, RATE, centers)

    base = {"duration": duration}
    best = {**base, **BEST, "tolerance": scaled_tolerance(0.01)}
    truth = clarity(responses(scene, places, {**best, "rays": 4000} if quick else best))
    points = []
    knobs = knobs_of(scene, duration)
    for knob in list(knobs)[:3] if quick else knobs:
        for setting, options in knobs[knob][:1] if quick else knobs[knob]:
            # compiled code, filters, and planning: once for a room, however many pairs
            responses(scene, places[:2], {**base, **options})
            start = time.process_time()
            made = responses(scene, places, {**base, **options})
            seconds = (time.process_time() - start) / (len(places) - 1)
            error = float(np.mean(np.abs(clarity(made) - truth)))
            points.append(
                {"knob": knob, "setting": setting, "seconds": seconds, "error": error}
            )
    return points


def cheapest(points: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the cheapest point within what can be heard."""
    heard = [point for point in points if point["error"] <= JND]
    return min(heard, key=lambda point: point["seconds"], default=None)


def draw(scenes: dict[str, list[dict[str, Any]]], path: Path) -> None:
    """Draw one panel for each scene."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, ScalarFormatter

    figure = Figure(figsize=(9.5, 7.5), layout="constrained")
    grid = figure.subplots(2, 2, squeeze=False, sharey=True).ravel()
    marks = dict(zip(("as planned", *_KNOBS), "Ps^Dovx*", strict=True))
    for axis, (name, points) in zip(grid, scenes.items(), strict=False):
        axis.axhline(JND, color="0.6", ls="--", lw=1)
        axis.set(xscale="log", yscale="log", title=name)
        for k, (knob, mark) in enumerate(marks.items()):
            own = [p for p in points if p["knob"] == knob]
            x = [1000 * p["seconds"] for p in own]
            y = [max(p["error"], LEAST) for p in own]
            line = "none" if knob in ("effect off", "as planned") else "-"
            style = {"marker": mark, "color": f"C{k}", "lw": 0.8, "label": knob}
            axis.plot(
                x, y, linestyle=line, ms=8 if knob == "as planned" else 5, **style
            )
            for p, a, b in zip(own, x, y, strict=True):
                axis.annotate(
                    p["setting"], (a, b), xytext=(3, 3), fontsize=6,
                    textcoords="offset points", color=f"C{k}",
                )  # fmt: skip
        best = cheapest(points)
        if best is not None:
            place = 1000 * best["seconds"], max(best["error"], LEAST)
            axis.plot(*place, "o", ms=16, mfc="none", mec="k")
        for ticks in (axis.xaxis, axis.yaxis):
            ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ticks.set_major_formatter(ScalarFormatter())
            ticks.set_minor_locator(LogLocator(subs=()))
    for axis in grid[2:]:
        axis.set_xlabel("CPU ms a pair")
    for axis in grid[::2]:
        axis.set_ylabel("error of C50 [dB]")
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "SIMULATED: one knob turned, all else as planned; dashed: just noticeable;"
        " circle: the cheapest within it",
        fontsize=9,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


_KNOBS = ("order", "rays", "accuracy", "tolerance", "bands", "length", "effect off")


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "accuracy_costs", "one scene, three settings")
    parser.add_argument("--picture", type=Path, help="where to draw")
    parser.add_argument("--draw", type=Path, help="results to draw, not measured anew")
    options = parser.parse_args(argv)
    if options.draw is not None:
        scenes = json.loads(options.draw.read_text(encoding="utf-8"))
    else:
        scenes = {}
        for name in ("l-shaped",) if options.quick else SCENES:
            scenes[name] = measure(name, options.quick)
            best = cheapest(scenes[name])
            for point in scenes[name]:
                print(
                    f"{name:9s} {point['knob']:10s} {point['setting']:12s}"
                    f" {1000 * point['seconds']:8.1f} ms {point['error']:7.3f} dB",
                    "<- cheapest within 1 dB" if point is best else "",
                )
        write_results(options.out, scenes)
    if options.picture is not None:
        draw(scenes, options.picture)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
