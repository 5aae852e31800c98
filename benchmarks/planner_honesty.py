"""Check that what the planner leaves off does not matter, on random scenes.

Each scene is simulated twice with equal seeds: as planned, and with every effect on and
computed as finely as can be. Level, T60, C50 and EDT per octave, means over a few
pairs, must differ by less than the tolerance (the just-noticeable differences of ISO
3382-1). Scenes are boxes, L-shaped rooms, random prisms, two coupled rooms with
furniture, meshes of boxes full of furniture, box rooms with stated furniture, halls
with rows of seats, and rooms with hung plates, with random materials, air, gain
patterns, sample rates and lengths.
`--wide` draws rooms of 2 to 40 m whose surfaces absorb 0.02 to 0.9 each on its own,
octave by octave; `--first` chooses scenes nothing was ever tuned on. Clarity counts
from the direct sound and is limited to -30 to 30 dB.

`--accuracy "C50 1 dB"` asks for that alone.

Bar: 99 % of the scenes within tolerance; time saved: half in boxes, 40 % elsewhere, and
80 % at a C50 of 1 dB.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir import GainPattern
from rir.room import Air
from rir.seats import SeatRows
from rooms import EffectPlan, Scene, plan_effects, simulate
from rooms.effects import EFFECTS, Tolerance
from rooms.effort import decay_parameters, parse_accuracy
from rooms.furniture import Furniture
from rooms.mesh import MeshGeometry
from rooms.places import random_places

KINDS = ("level_db", "clarity_db", "reverberation_percent", "early_decay_percent")
ALWAYS_OFF = ("hardware",)
FADE = 0.03  # s: two periods of the lowest octave's lower edge
BOX_ONLY = ("transmission", "modes", "diffraction")


Piece = tuple[Any, MeshGeometry, str]


def random_materials(rng: np.random.Generator, names: Sequence[str]) -> dict[str, Any]:
    """Draw absorption, scattering and transmission per surface and octave."""
    slope = np.exp(rng.uniform(-0.6, 0.6) * np.linspace(-1, 1, 7))
    rough = 0.0 if rng.random() < 0.3 else rng.choice([0.002, 0.01, 0.05, 0.2, 0.5])
    clear = rng.choice([0.0, 0.0, 1e-5, 1e-3, 0.01])
    return {
        name: {
            "absorption": np.clip(rng.uniform(0.05, 0.6) * slope, 0.011, 0.95).tolist(),
            "scattering": float(rough),
            "transmission": float(clear),
        }
        for name in names
    }


def random_pattern(rng: np.random.Generator) -> GainPattern:
    """Draw a pattern: omnidirectional or nearly so, of first or of third order."""
    kind = rng.random()
    if kind < 0.8:
        return GainPattern.first_order(float(rng.choice([1.0, 1.0, 0.99, 0.9, 0.5])))
    bands = 125.0 * 2.0 ** np.arange(7, dtype=np.float64)
    spread = np.concatenate([[1.0], np.zeros(15)]) * np.sqrt(4 * np.pi)
    bent = rng.normal(0, rng.choice([0.01, 0.1, 0.3]), (7, 16))
    return GainPattern(spread + bent, bands)


def box(rng: np.random.Generator) -> Scene:
    size = rng.uniform([2.5, 2.5, 2.2], [12, 9, 5])
    slope = rng.uniform(-0.6, 0.6) * np.linspace(-1, 1, 7)
    absorption = np.clip(rng.uniform(0.05, 0.6, (6, 1)) * np.exp(slope), 0.01, 0.95)
    kind = rng.random()
    scattering = 0.0 if kind < 0.3 else rng.choice([0.002, 0.01, 0.05, 0.2, 0.5])
    return Scene.shoebox(size, absorption=absorption, scattering=float(scattering))


def of_mesh(rng: np.random.Generator, geometry: MeshGeometry) -> Scene:
    return Scene.of_geometry(geometry, random_materials(rng, geometry.surface_names))


def l_shaped(rng: np.random.Generator) -> Scene:
    x, y = rng.uniform([4, 4], [12, 9])
    a, b = rng.uniform(0.3, 0.7, 2) * (x, y)
    outline = [(0, 0), (x, 0), (x, b), (a, b), (a, y), (0, y)]
    return of_mesh(rng, MeshGeometry.extruded(outline, rng.uniform(2.2, 4.5)))


def prism(rng: np.random.Generator) -> Scene:
    """Draw a star-shaped floor plan of 3 to 9 corners, convex or not."""
    count = int(rng.integers(3, 10))
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radius = rng.uniform(2.5, 6) * rng.uniform(0.55, 1, count)
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return of_mesh(rng, MeshGeometry.extruded(outline, rng.uniform(2.3, 4.5)))


def coupled(rng: np.random.Generator) -> Scene:
    from rooms.builtin import load_scene

    return of_mesh(rng, load_scene("coupled").geometry)  # pyright: ignore[reportArgumentType]


def furnished(rng: np.random.Generator) -> Scene:
    """Draw a box room with two to six boxes standing in it."""
    return of_mesh(rng, furniture_in(rng, rng.uniform([4, 4, 2.3], [9, 8, 3.5])))


def furniture_in(rng: np.random.Generator, size: Any) -> MeshGeometry:
    pieces: list[Piece] = [(np.zeros(3), MeshGeometry.box(size), "room")]
    for k in range(int(rng.integers(2, 7))):
        each = np.minimum(rng.uniform([0.4, 0.4, 0.4], [1.6, 1.2, 1.9]), 0.3 * size)
        low = np.array(
            [0.1 + (k % 3) * size[0] / 3, 0.1 + (k // 3) * size[1] / 2, 0.02]
        )
        pieces.append((low, MeshGeometry.box(each), f"piece{k}"))
    return joined(pieces)


def joined(pieces: Sequence[Piece]) -> MeshGeometry:
    """Return meshes as one; pieces are one surface each, the room has its walls."""
    vertices, faces, names, count = [], [], [], 0
    for low, mesh, name in pieces:
        vertices.append(mesh.vertices + mesh.origin + low)
        faces.append(mesh.faces + count)
        walls = [mesh.surface_names[s] for s in mesh.face_surface]
        names += walls if name == "room" else [name] * len(walls)
        count += len(mesh.vertices)
    arrays = np.concatenate(vertices), np.concatenate(faces)
    return MeshGeometry.from_arrays(*arrays, names)


def staged(rng: np.random.Generator) -> Scene:
    """Draw a box room with furniture stated piece by piece."""
    scene = box(rng)
    size = np.asarray(scene.geometry.size)
    count = int(rng.integers(1, 4))
    high = np.minimum(rng.uniform([0.5, 0.4, 0.4], [1.8, 1.0, 1.9]), 0.4 * size)
    low = np.array([[0.15 + k * size[0] / 3, 0.1, 0.0] for k in range(count)])
    pieces = random_materials(rng, [f"piece{k}" for k in range(count)])
    absorption, scattering = (
        np.array([np.broadcast_to(piece[kind], 7) for piece in pieces.values()])
        for kind in ("absorption", "scattering")
    )
    none = np.zeros((count, 7))
    told = (False,) * count
    furniture = Furniture(
        tuple(pieces), low, low + high, absorption, scattering, none, told
    )
    return replace(scene, furniture=furniture)


def seated(rng: np.random.Generator) -> Scene:
    """Draw a small hall whose floor is marked as rows of seats."""
    size = rng.uniform([10, 8, 4], [22, 16, 9])
    absorption = rng.uniform(0.05, 0.5, (6, 1)) * np.ones(7)
    rows = (None, None, None, None, SeatRows(), None)
    scattering = float(rng.choice([0.05, 0.2, 0.5]))
    return Scene.shoebox(size, absorption=absorption, scattering=scattering, seats=rows)


def reflecting(rng: np.random.Generator) -> Scene:
    """Draw a box room with a few plates hung below its ceiling."""
    size = rng.uniform([5, 4, 3], [12, 9, 6])
    plates = [(np.zeros(3), MeshGeometry.box(size), "room")]
    for k in range(int(rng.integers(1, 4))):
        wide = np.array([*rng.uniform(0.6, 0.28 * size[:2]), 0.04])
        at = np.array([0.1 * size[0] + k * size[0] / 3.2, 0.3 * size[1], 0.8 * size[2]])
        plates.append((at, MeshGeometry.box(wide), f"plate{k}"))
    return of_mesh(rng, joined(plates))


def wide_size(rng: np.random.Generator) -> Any:
    """Draw lengths of 2 to 40 m; the height is no more than 12 m."""
    longest = float(np.exp(rng.uniform(np.log(2.5), np.log(40))))
    x, y = longest, longest * rng.uniform(0.35, 1)
    return np.array([x, max(y, 2.0), np.clip(longest * rng.uniform(0.2, 0.6), 2, 12)])


def wide_materials(rng: np.random.Generator, names: Sequence[str]) -> dict[str, Any]:
    """Draw absorption on its own per surface and octave, scattering per surface."""
    rough = rng.random() < 0.7
    return {
        name: {
            "absorption": np.exp(
                np.clip(
                    rng.uniform(np.log(0.02), np.log(0.9)) + rng.normal(0, 0.4, 7),
                    np.log(0.02),
                    np.log(0.9),
                )
            ).tolist(),
            "scattering": float(
                rough * np.exp(rng.uniform(np.log(0.003), np.log(0.7)))
            ),
            "transmission": float(rng.choice([0.0, 0.0, 1e-4, 1e-2])),
        }
        for name in names
    }


def wide_outline(rng: np.random.Generator, shape: str, x: float, y: float) -> Any:
    if shape == "l-shaped":
        a, b = rng.uniform(0.25, 0.75, 2) * (x, y)
        return [(0, 0), (x, 0), (x, b), (a, b), (a, y), (0, y)]
    if shape == "coupled":
        a, thick = rng.uniform(0.35, 0.65) * x, rng.uniform(0.1, 0.3)
        low = rng.uniform(0.1, 0.5) * y
        high = low + rng.uniform(0.15, 0.4) * y
        return [
            (0, 0), (a, 0), (a, low), (a + thick, low), (a + thick, 0), (x, 0),
            (x, y), (a + thick, y), (a + thick, high), (a, high), (a, y), (0, y),
        ]  # fmt: skip
    count = int(rng.integers(3, 10))
    angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radius = rng.uniform(0.55, 1, count)
    return np.column_stack([x * radius * np.cos(angle), y * radius * np.sin(angle)]) / 2


def wide_scene(rng: np.random.Generator, shape: str) -> Scene:
    """Draw a scene of any shape, from closets to halls, of very unequal surfaces."""
    if shape in ("staged", "seated", "reflecting"):
        return SHAPES[shape](rng)
    size = wide_size(rng)
    if shape == "box":
        drawn = wide_materials(rng, [str(k) for k in range(6)]).values()
        shares = {
            kind: np.array([np.broadcast_to(m[kind], 7) for m in drawn])
            for kind in ("absorption", "scattering")
        }
        return Scene.shoebox(
            size, absorption=shares["absorption"], scattering=shares["scattering"]
        )
    if shape == "furnished":
        geometry = furniture_in(rng, np.maximum(size, (2.5, 2.5, 2.2)))
    else:
        outline = wide_outline(rng, shape, float(size[0]), float(size[1]))
        geometry = MeshGeometry.extruded(outline, float(size[2]))
    return Scene.of_geometry(geometry, wide_materials(rng, geometry.surface_names))


SHAPES: dict[str, Callable[[np.random.Generator], Scene]] = {
    "box": box,
    "l-shaped": l_shaped,
    "prism": prism,
    "coupled": coupled,
    "furnished": furnished,
    "staged": staged,
    "seated": seated,
    "reflecting": reflecting,
}


def random_scene(
    rng: np.random.Generator, shape: str, wide: bool = False
) -> tuple[Scene, int, float, Tolerance]:
    """Draw a scene, a sample rate, a length and a tolerance."""
    air = Air(
        temperature_c=float(rng.uniform(0, 35)),
        humidity_percent=float(rng.uniform(10, 90)),
    )
    patterns = random_pattern(rng), random_pattern(rng)
    scene = replace(
        wide_scene(rng, shape) if wide else SHAPES[shape](rng),
        air=air,
        emitter_gain=patterns[0],
        listener_gain=patterns[1],
    )
    rate = int(rng.choice([1000, 2000, 4000, 8000, 16000]))
    longest = float(scene.eyring_t60().max())
    easy = rng.choice([1.0, 1.0, 2.0, 4.0])
    tolerance = Tolerance(*(easy * limit for limit in vars(Tolerance()).values()))
    return scene, rate, float(np.clip(longest, 0.15, 2.0 if wide else 1.0)), tolerance


def measure(
    scene: Scene, plan: EffectPlan, rate: int, duration: float, seed: int
) -> Any:
    """Return parameters (kinds, pairs, bands) and the CPU seconds."""
    from rir.bands import crossover_gains

    rng = np.random.default_rng(seed)
    places = random_places(scene, 5, rng)
    run = {"sample_rate": rate, "duration": duration, "plan": plan, "seed": seed}
    start = time.process_time()
    h = simulate(scene, places[:1], places[1:], **run).responses[0]
    took = time.process_time() - start
    heard = scene.bands[scene.bands < rate / 2]
    n = h.shape[-1]
    # a sharp end would click in all octaves
    h = h * np.sin(np.pi / 2 * np.minimum(np.arange(n, 0, -1) / (FADE * rate), 1))
    # what lies below the lowest octave belongs to no octave
    centers = heard[0] / 2, *map(float, heard)
    weights = crossover_gains(centers, rate, 2 * n)[1:]
    bands = np.fft.irfft(np.fft.rfft(h, 2 * n)[:, None] * weights, 2 * n)[..., :n] ** 2
    way = np.linalg.norm(places.positions[1:] - places.positions[0], axis=1)
    found = decay_parameters(bands, 1 / rate, way / scene.speed_of_sound)
    # beyond 30 dB a thousandth of the energy is early, or late: its level is no clarity
    found[1] = np.clip(found[1], -30.0, 30.0)
    return found, took


def warm(scene: Scene, rate: int, *plans: EffectPlan) -> None:
    """Compile, and build what a scene keeps, so that neither plan pays for it."""
    places = random_places(scene, 2, np.random.default_rng(0))
    for plan in plans:
        options = {"sample_rate": rate, "duration": 0.05, "plan": plan}
        simulate(scene, places[:1], places[1:], **options)


def compare(
    seed: int, shape: str, wide: bool = False, accuracy: str | None = None
) -> dict[str, Any]:
    """Return the largest change of each kind over octaves, and the times."""
    rng = np.random.default_rng(seed)
    scene, rate, duration, tolerance = random_scene(rng, shape, wide)
    if accuracy is not None:
        tolerance = Tolerance.of(parse_accuracy(accuracy))
    options = {"sample_rate": rate, "duration": duration, "tolerance": tolerance}
    start = time.process_time()
    chosen = plan_effects(scene, **options)
    planning = time.process_time() - start
    never = (*ALWAYS_OFF, *(BOX_ONLY if shape == "box" else ()))
    names = [name for name in EFFECTS if name not in never]
    full = plan_effects(scene, **options, only=names)
    warm(scene, rate, chosen, full)
    rich, rich_s = measure(scene, full, rate, duration, seed)
    lean, lean_s = measure(scene, chosen, rate, duration, seed)
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.abs(lean - rich)
        change[2:] = 100 * change[2:] / rich[2:]
    known = np.isfinite(change)
    mean = np.where(known, change, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    worst = dict(zip(KINDS, mean.max(axis=1).tolist(), strict=True))
    limits = vars(tolerance)
    return {
        "seed": seed,
        "work": vars(chosen.work),
        "shape": shape,
        "off": [name for name in names if name not in chosen.on],
        "changes": worst,
        "share": float(max(worst[kind] / limits[kind] for kind in KINDS)),
        "lean_s": lean_s,
        "full_s": rich_s,
        "plan_s": planning,
    }


def summed_up(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return counts of scenes within the tolerance, and the time saved."""
    lean, full = (sum(row[key] for row in rows) for key in ("lean_s", "full_s"))
    return {
        "scenes": len(rows),
        "kept": sum(bool(row["share"] <= 1) for row in rows),
        "leaner": sum(bool(set(row["off"]) - {"patterns"}) for row in rows),
        "time_saved": 1 - lean / full,
    }


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "planner_honesty", "a scene of every third shape")
    parser.add_argument("--scenes", type=int, default=200, help="scenes of all shapes")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--wide", action="store_true", help="closets to halls")
    parser.add_argument("--accuracy", help='in place of drawn tolerances: "C50 1 dB"')
    parser.add_argument("--shapes", default=",".join(SHAPES))
    options = parser.parse_args(argv)
    shapes = options.shapes.split(",")[:: 3 if options.quick else 1]
    count = len(shapes) if options.quick else options.scenes
    rows = []
    for seed in range(options.first, options.first + count):
        row = compare(seed, shapes[seed % len(shapes)], options.wide, options.accuracy)
        rows.append(row)
        if row["share"] > 1:
            print(f"{row['shape']} {seed}: off {row['off']}, changes {row['changes']}")
    table = {shape: [r for r in rows if r["shape"] == shape] for shape in shapes}
    report = {shape: summed_up(some) for shape, some in table.items() if some}
    report["all"] = summed_up(rows)
    for shape, part in report.items():
        print(
            f"{shape:10} {part['kept']} of {part['scenes']} within tolerance,"
            f" effects off in {part['leaner']}, time saved {part['time_saved']:.0%}"
        )
    write_results(options.out, {**report, "rows": rows})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
