"""Measure which walls the path field finds, and that it invents none.

An L-shaped room with a notch that is not half, heard by several numbers of
emitters with 3 mm pose errors and noise 60 dB down; truth with mirror paths to
order 12 and edge diffraction, which the model lacks, and in one case scattering
with a late part. The same L as drawn on paper 5 cm wrong. Then what must hold no
wall: noise, and what must not be told wrong: one emitter and eight listeners,
poses in one plane and on one line. CPU seconds of one thread.

Bar: walls to 5 mm and 0.5 degrees in 1 CPU second from 120 responses; no wall that is
not there.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from harness import make_parser, write_results
from inverse.acoustics import Acoustics
from inverse.find import room_in_rows
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.polyhedron import Polyhedron
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet
from inverse.search import PriorKnowledge
from inverse.walls.box import assemble_boxes
from inverse.walls.scan import scan_planes, scan_signals
from path_rooms import BENT, CLEAR, ROUGH, level_errors, spoiled
from rir import GainPattern
from rooms import Scene
from rooms.mesh import MeshGeometry

OUTLINE = [(0, 0), (6, 0), (6, 2.2), (3.4, 2.2), (3.4, 5), (0, 5)]
HEIGHT, RATE = 3.0, 16000
MARGIN_M, JITTER_M, NOISE_DB = 0.4, 0.003, -60.0
FOUND_M, FOUND_DEG = 0.05, 3.0
SCANNED = (5, 3), (5, 24, 3)


def l_scene(scattering: float = 0.0, cardioid: bool = False) -> Scene:
    """Return the room."""
    shape = MeshGeometry.extruded(OUTLINE, HEIGHT)
    walls = {"all": {"absorption": 0.23, "scattering": scattering}}
    gain = GainPattern.cardioid() if cardioid else GainPattern.omni()
    return replace(Scene.of_geometry(shape, walls, name="L"), emitter_gain=gain)


def box_scene() -> Scene:
    """Return a box for the cases of poor poses."""
    return Scene.shoebox((6.0, 5.0, 3.0), absorption=0.23)


def places(rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw places in the L, away from its walls."""
    found: list[np.ndarray] = []
    high = np.array([6.0, 5.0, HEIGHT]) - MARGIN_M
    while len(found) < count:
        place = rng.uniform(np.full(3, MARGIN_M), high)
        if place[0] < 3.4 - MARGIN_M or place[1] < 2.2 - MARGIN_M:
            found.append(place)
    return np.array(found)


def rows_of(
    scene: Scene,
    emitters: np.ndarray,
    listeners: np.ndarray,
    rng: np.random.Generator,
    *,
    effects: Sequence[str] = BENT,
    jitter: float = JITTER_M,
    noise_db: float = NOISE_DB,
    duration: float = 0.1,
) -> FitSet:
    """Simulate rows: emitters (E, 3) with listeners (E, L, 3) each; spoil poses."""
    yaws = rng.uniform(0, 2 * np.pi, len(emitters))
    return spoiled(
        scene,
        emitters,
        yaws,
        listeners,
        rng,
        rate=RATE,
        duration=duration,
        effects=effects,
        max_order=12,
        jitter=jitter,
        noise_db=noise_db,
    )


def l_rows(scene: Scene, emitters: int, listeners: int, seed: int, **how: Any):
    """Return rows of the L at random places."""
    rng = np.random.default_rng(seed)
    ends = places(rng, emitters), places(rng, emitters * listeners)
    return rows_of(scene, ends[0], ends[1].reshape(emitters, -1, 3), rng, **how)


def planes_of(heard: Acoustics) -> np.ndarray:
    """Return the planes found, shape (P, 4)."""
    fitted = heard.fitted
    if fitted is None:
        return np.empty((0, 4))
    if isinstance(fitted, FittedMesh):
        return fitted.room.shape.planes
    box = fitted.room.box
    return box.planes[box.found]


def wall_errors(planes: np.ndarray, truth: Polyhedron) -> dict[str, Any]:
    """Compare the planes found with the true ones, at the middle of each wall."""
    middles = np.array(
        [
            truth.vertices[truth.faces[truth.plane_of == k]].reshape(-1, 3).mean(0)
            for k in range(len(truth.planes))
        ]
    )
    away, turn = [], []
    matched = set()
    for plane in planes:
        angle = np.degrees(np.arccos(np.clip(truth.planes[:, :3] @ plane[:3], -1, 1)))
        gap = np.abs(middles @ plane[:3] - plane[3])
        near = np.flatnonzero((angle < FOUND_DEG) & (gap < FOUND_M))
        if len(near):
            best = int(near[np.argmin(gap[near])])
            matched.add(best)
            away.append(1000 * gap[best])
            turn.append(angle[best])
    return {
        "found": len(matched),
        "of": len(truth.planes),
        "false": len(planes) - len(away),
        "mm": float(max(away, default=np.nan)),
        "deg": float(max(turn, default=np.nan)),
    }


def scores(heard: Acoustics, test: FitSet) -> dict[str, float]:
    """Score answers at unseen emitters; NMSE of 50 ms up to 4 kHz."""
    from scipy.signal import resample_poly

    told = heard.predict(test.emitters, test.listeners, test.n_samples)
    early = round(0.05 * RATE)

    def low(sound: np.ndarray) -> np.ndarray:
        return resample_poly(sound[:, :early], 1, 2, axis=1)

    def clarity(sound: np.ndarray) -> np.ndarray:
        power = sound**2 + 1e-30
        return 10 * np.log10(power[:, :early].sum(1) / power[:, early:].sum(1))

    paths = told
    if heard.fitted is not None:
        paths = heard.fitted.predict(test.emitters, test.listeners, test.n_samples)
    gap = np.abs(clarity(told) - clarity(test.responses))
    return {
        "nmse_db": float(np.median(level_errors(low(test.responses), low(told)))),
        "paths_nmse_db": float(
            np.median(level_errors(low(test.responses), low(paths)))
        ),
        "c50_db": float(gap.mean()),
    }


def l_case(
    train: FitSet, test: FitSet, shape: Polyhedron | None = None
) -> dict[str, Any]:
    """Hear one L and say what was found."""
    truth = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, HEIGHT))
    start = time.process_time()
    heard = room_in_rows(train, prior=PriorKnowledge(shape))
    seconds = time.process_time() - start
    volume = float("nan")
    if isinstance(heard.fitted, FittedMesh):
        volume = float(heard.fitted.room.shape.mesh.volume)
    return {
        **wall_errors(planes_of(heard), truth),
        **scores(heard, test),
        "volume_percent": 100 * (volume / truth.mesh.volume - 1),
        "cpu_s": seconds,
        "alarms": heard.alarms,
    }


def l_cases(quick: bool) -> dict[str, dict[str, Any]]:
    """Run the L-shaped room."""
    told: dict[str, dict[str, Any]] = {}
    plain = l_scene()
    clean: dict[str, Any] = {"jitter": 0.0, "noise_db": -200.0}
    if quick:
        clear = {**clean, "effects": CLEAR}
        rows, test = (l_rows(plain, 2, n, 77 + n, **clear) for n in (9, 4))
        return {"L, 2 emitters": l_case(rows, test)}
    test = l_rows(plain, 2, 15, 77, **clean)
    sizes = {12: 50, 5: 60, 3: 100}
    for emitters, listeners in sizes.items():
        train = l_rows(plain, emitters, listeners, emitters)
        told[f"L, {emitters} emitters"] = l_case(train, test)
    clear = l_rows(plain, 5, 60, 4, effects=CLEAR, **clean)
    clear_test = l_rows(plain, 3, 10, 78, effects=CLEAR, **clean)
    told["L, clean"] = l_case(clear, clear_test)
    shape = Polyhedron.of_mesh(MeshGeometry.extruded(OUTLINE, HEIGHT))
    planes = shape.planes.copy()
    planes[:, 3] += np.random.default_rng(3).uniform(-0.05, 0.05, len(planes))
    drawn = shape.moved(planes)
    told["L, clean, drawn 5 cm wrong"] = l_case(clear, clear_test, drawn)
    aimed = l_scene(cardioid=True)
    told["L, 12 cardioids"] = l_case(
        l_rows(aimed, 12, 50, 1), l_rows(aimed, 3, 10, 79, **clean)
    )
    rough = l_scene(scattering=0.1)
    how: dict[str, Any] = {"effects": ROUGH, "duration": 0.2}
    told["L, scattering 0.1"] = l_case(
        l_rows(rough, 5, 60, 2, **how), l_rows(rough, 3, 10, 80, **how, **clean)
    )
    return told


def poor_cases(quick: bool) -> dict[str, dict[str, Any]]:
    """Run what cannot tell all walls, and noise."""
    scene, rng = box_scene(), np.random.default_rng(11)
    truth = Polyhedron.of_mesh(MeshGeometry.box((6.0, 5.0, 3.0)))
    size = np.array([6.0, 5.0, 3.0])

    def drawn(emitters: int, listeners: int) -> list[np.ndarray]:
        return [
            rng.uniform(0.5, size - 0.5, (emitters, 3)),
            rng.uniform(0.5, size - 0.5, (emitters, listeners, 3)),
        ]

    few, plane, line = drawn(1, 8), drawn(4, 30), drawn(3, 30)
    for part in plane:
        part[..., 2] = 1.2
    for part in line:
        share = part[..., :1].copy() / 6
        part[...] = np.array([0.6, 1.0, 1.0]) + share * np.array([4.5, 3.0, 0.9])
    told = {}
    cases = {"1 emitter, 8 listeners": few}
    if not quick:
        cases |= {"poses in a plane": plane, "poses on a line": line}
    train = None
    for name, ends in cases.items():
        train = rows_of(scene, ends[0], ends[1], rng, effects=CLEAR)
        told[name] = poor(train, truth)
    if not quick:
        aimed = Scene.shoebox(
            (6.0, 5.0, 3.0), absorption=0.3, emitter_gain=GainPattern.cardioid()
        )
        lone = np.random.default_rng(3)
        ends = [lone.uniform(0.5, size - 0.5, shape) for shape in ((1, 3), (1, 120, 3))]
        rows = rows_of(aimed, ends[0], ends[1], lone, effects=CLEAR)
        told["1 cardioid"] = poor(rows, truth)
    if train is not None:
        noise = rng.standard_normal(train.responses.shape)
        told["noise only"] = poor(replace(train, responses=noise), truth)
    return told


def poor(train: FitSet, truth: Polyhedron) -> dict[str, Any]:
    """Hear a set and count what was invented."""
    start = time.process_time()
    heard = room_in_rows(train)
    seconds = time.process_time() - start
    return {
        **wall_errors(planes_of(heard), truth),
        "cpu_s": seconds,
        "alarms": heard.alarms,
    }


def scanned(draws: int) -> dict[str, dict[str, Any]]:
    """Scan 120 rows of a box with five cardioids, without a fit."""
    size = (6.0, 4.0, 3.0)
    cardioid = GainPattern.cardioid()
    scene = Scene.shoebox(size, absorption=0.3, emitter_gain=cardioid)
    truth, told = Polyhedron.of_mesh(MeshGeometry.box(size)), {}
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        ends = [rng.uniform(0.5, np.array(size) - 0.5, shape) for shape in SCANNED]
        clean: dict[str, Any] = {"jitter": 0.0, "noise_db": -200.0, "effects": CLEAR}
        rows = rows_of(scene, ends[0], ends[1], rng, **clean)
        start = time.process_time()
        direct = read_direct(rows)
        signals = scan_signals(rows, direct)
        boxes = assemble_boxes(signals, scan_planes(signals))
        seconds = time.process_time() - start
        planes = boxes[0].planes[boxes[0].found] if boxes else np.empty((0, 4))
        found = wall_errors(planes, truth)
        told[f"scan of a box, {seed}"] = {**found, "cpu_s": seconds, "alarms": []}
    return told


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0."""
    parser = make_parser(__doc__, "path_geometry", "one L, one box, noise")
    parser.add_argument("--only", default="", help="scan, L or poor")
    options = parser.parse_args(argv)
    results: dict[str, dict[str, Any]] = {}
    if options.only in ("", "scan"):
        results |= scanned(1 if options.quick else 3)
    if options.only in ("", "L"):
        results |= l_cases(options.quick)
    if options.only in ("", "poor"):
        results |= poor_cases(options.quick)
    for name, case in results.items():
        line = (
            f"{name:28} {case['cpu_s']:5.1f} CPU-s  {case['found']} of "
            f"{case.get('of', 0)} walls, {case['false']} false, "
            f"{case['mm']:6.2f} mm {case['deg']:.2f} deg"
        )
        if "nmse_db" in case:
            line += (
                f"  volume {case['volume_percent']:+.2f} %  NMSE {case['nmse_db']:.1f} "
                f"(paths {case['paths_nmse_db']:.1f}) dB  C50 {case['c50_db']:.2f} dB"
            )
        print(line)
        for alarm in case["alarms"]:
            print(f"    {alarm}")
    write_results(options.out, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
