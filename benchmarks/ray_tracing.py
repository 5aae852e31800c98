"""Measure speed, physics and convergence of the ray tracing of energy.

Segments per CPU second on a mesh of 5,000 triangles; a complete response of the
L-shaped room with 7 bands against pyroomacoustics' hybrid; energy against
scattering; the seam between images and rays; Eyring; and the error of parameters
against the number of rays, with the error that exchanging the ends makes.

Bar: 5 million segments per CPU second among 5,000 triangles; energy constant to 0.05
dB; Eyring to 5 %; at 10,000 rays Env 0.03 %, T60 0.48 %, C50 0.05 dB, EDT 0.8 ms.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir.physics import speed_of_sound
from rooms import Scene, simulate
from rooms.mesh import MeshGeometry, find_paths
from rooms.rays import trace_energy

FLOOR = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.5), (3.0, 2.5), (3.0, 5.0), (0.0, 5.0)]
EMITTER, LISTENER = np.array([1.7, 3.1, 1.4]), np.array([[4.1, 1.3, 1.9]])
BANDED = [0.10, 0.12, 0.15, 0.20, 0.22, 0.25, 0.30]
C = speed_of_sound(20.0)
STEP = 0.001
LISTED = 10


def cpu_seconds(run: Callable[[], Any]) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


def ball(center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a faceted ball of 224 triangles."""
    up, around = np.linspace(0, np.pi, 9), np.arange(16) * np.pi / 8
    rings = [
        [np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)]
        for t in up[1:-1]
        for p in around
    ]
    vertices = np.array([[0, 0, 1.0], *rings, [0, 0, -1.0]]) * radius + center
    faces, last = [], len(vertices) - 1
    for k in range(16):
        n = (k + 1) % 16
        faces += [(0, 1 + k, 1 + n), (last, last - 16 + n, last - 16 + k)]
        for ring in range(6):
            a, b = 1 + 16 * ring, 17 + 16 * ring
            faces += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
    return vertices, np.array(faces)


def case(low: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a box of 48 triangles: a cupboard, a table."""
    room = MeshGeometry.box(size)
    a, b, c = np.moveaxis(room.corners + room.origin + low, 1, 0)
    d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = ((a, d, f), (d, b, e), (f, e, c), (d, e, f))
    corners = np.concatenate([np.stack(part, 1) for part in parts]).reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def furnished(balls: int, cases: int) -> MeshGeometry:
    """Return a room of 8 x 6 x 3 m with balls and boxes in it."""
    rng, room = np.random.default_rng(0), MeshGeometry.box((8, 6, 3))
    vertices, faces = [room.vertices + room.origin], [room.faces]
    places = [(x, y) for x in np.arange(0.8, 7.6, 1.3) for y in (1, 2.3, 3.7, 5)]
    pieces = [
        ball(np.array([x, y, rng.uniform(0.6, 2.4)]), 0.35) for x, y in places[:balls]
    ]
    for k in range(cases):
        low = np.array([0.1 + 0.7 * (k % 11), 0.1 + 0.95 * (k // 11), 0.0])
        pieces.append(case(low, rng.uniform([0.2, 0.2, 0.3], [0.5, 0.8, 1.2])))
    for points, triangles in pieces:
        faces.append(triangles + sum(len(part) for part in vertices))
        vertices.append(points)
    return MeshGeometry.from_arrays(np.concatenate(vertices), np.concatenate(faces))


def traced(room: MeshGeometry, absorption: Any, scattering: float, **options: Any):
    bands = np.size(absorption)
    return trace_energy(
        room,
        np.tile(np.reshape(absorption, (1, bands)), (room.surfaces, 1)),
        np.full((room.surfaces, bands), scattering),
        EMITTER[None],
        LISTENER,
        **{"duration": 0.5, "time_step": STEP, "speed_of_sound": C, **options},
    )


def measure_speed(rays: int, rounds: int) -> list[dict[str, float]]:
    """Return segments per CPU second, best of several rounds, of 7 bands.

    All that makes a histogram of them counts: patches, places, and the exchange.
    Rays that only ask whether a surface sees a place are not counted as segments.
    """
    rows = []
    rooms = {
        "L": MeshGeometry.extruded(FLOOR, 3),
        "furniture": furnished(8, 66),
        "balls": furnished(22, 0),
    }
    for name, room in rooms.items():
        for scattering in (0.0, 0.1, 0.5):
            traced(room, BANDED, scattering, rays=16)
            spent, segments = [], 0
            for _ in range(rounds):
                start = time.process_time()
                segments = traced(room, BANDED, scattering, rays=rays).segments
                spent.append(time.process_time() - start)
            rows.append(
                {
                    "room": name,
                    "triangles": len(room.faces),
                    "scattering": scattering,
                    "segments_per_second": segments / min(spent),
                }
            )
    return rows


def peer_response(rays: int, scattering: float) -> None:
    import pyroomacoustics as pra

    pra.constants.set("num_threads", 1)
    bands = [125 * 2**k for k in range(7)]
    material = pra.Material({"coeffs": BANDED, "center_freqs": bands}, scattering)
    room = pra.Room.from_corners(
        np.array(FLOOR).T, fs=16000, materials=material, max_order=3, ray_tracing=True
    )
    room.extrude(3.0, materials=material)
    room.set_ray_tracing(
        n_rays=rays, receiver_radius=0.5, time_thres=0.5, hist_bin_size=0.004
    )
    room.add_source(EMITTER.tolist())
    room.add_microphone_array(LISTENER.T)
    room.compute_rir()


def our_response(
    rays: int, scattering: float, ends: tuple[Any, Any] = (EMITTER, LISTENER)
) -> np.ndarray:
    material = {"absorption": BANDED, "scattering": scattering}
    scene = Scene.extruded(FLOOR, 3.0, material)
    effects = ["direct", "specular", "scattering", "late"]
    return simulate(
        scene,
        *ends,
        sample_rate=16000,
        duration=0.5,
        max_order=3,
        rays=rays,
        effects=effects,
    ).responses[0, 0]


def compare(rays: int, scattering: float, rounds: int) -> dict[str, float]:
    our_response(64, scattering)
    ours, theirs = [], []
    for _ in range(rounds):
        theirs.append(cpu_seconds(lambda: peer_response(rays, scattering)))
        ours.append(cpu_seconds(lambda: our_response(rays, scattering)))
    there = our_response(rays, scattering)
    back = our_response(rays, scattering, (LISTENER[0], EMITTER[None]))
    gap = np.linalg.norm(there - back) / np.linalg.norm(there)
    return {
        "rays": rays,
        "scattering": scattering,
        "ours_s": min(ours),
        "peer_s": min(theirs),
        "ratio": min(theirs) / min(ours),
        "swap_db": 20 * np.log10(max(gap, 1e-20)),
    }


def check_energy(rays: int) -> list[dict[str, float]]:
    """Return the late energy of a lossless room, against 4 pi c / V [dB]."""
    room = MeshGeometry.box((4.5, 5.0, 4.0))
    rows = []
    for scattering in (0.0, 0.05, 0.1, 0.3, 0.5, 0.9):
        result = traced(room, [0.0], scattering, rays=rays, skip_specular_up_to=-1)
        level = result.energy[0, 0, 0, 100:].mean() * room.volume / STEP
        rows.append(
            {
                "scattering": scattering,
                "db": 10 * np.log10(level / (4 * np.pi * C)),
                "error_db": 4.34
                * float(result.total_error.sum() / result.energy.sum()),
            }
        )
    return rows


def check_seam(rays: int) -> list[dict[str, float]]:
    room, rows = MeshGeometry.box((4.5, 5.0, 4.0)), []
    reflection = np.full((6, 1), np.sqrt(0.8 * 0.9))
    for order in range(7):
        rest = traced(room, [0.2], 0.1, rays=rays, skip_specular_up_to=order)
        paths = find_paths(room, EMITTER, LISTENER, max_order=order)
        total = rest.energy.sum() + np.sum(paths.gains(reflection) ** 2)
        error = 4.34 * float(rest.total_error.sum() / total)
        rows.append({"order": order, "db": 10 * np.log10(total), "error_db": error})
    return rows


def check_eyring(rays: int) -> list[dict[str, float]]:
    room = MeshGeometry.box((6, 5, 3))
    wanted = 24 * np.log(10) * room.volume / (-C * room.areas.sum() * np.log(0.8))
    rows = []
    for scattering in (0.3, 0.5, 1.0):
        result = traced(
            room, [0.2], scattering, rays=rays, skip_specular_up_to=-1, duration=0.9
        )
        t60 = parameters(result.energy[0, 0, 0])["T60"]
        rows.append({"scattering": scattering, "t60": t60, "eyring": wanted})
    return rows


def parameters(energy: np.ndarray) -> dict[str, Any]:
    """Return T60 [s], EDT [s], C50 [dB] and the envelope of an energy over time."""
    left = np.cumsum(energy[::-1])[::-1]
    level = 10 * np.log10(np.maximum(left / left[0], 1e-12))
    t = np.arange(len(energy)) * STEP

    def decay(high: float, low: float) -> float:
        use = (level <= high) & (level >= low)
        return float(-60 / np.polyfit(t[use], level[use], 1)[0])

    early = energy[: round(0.05 / STEP)].sum()
    wide = energy[: len(energy) // 4 * 4].reshape(-1, 4).sum(axis=1)
    return {
        "T60": decay(-5, -25),
        "EDT": decay(0, -10),
        "C50": float(10 * np.log10(early / (energy.sum() - early))),
        "Env": np.sqrt(wide),
    }


def whole_energy(room: MeshGeometry, rays: int, seed: int) -> np.ndarray:
    """Return energy over time with the paths up to `LISTED` in it, shape (bins,)."""
    rest = traced(room, [0.2], 0.1, rays=rays, seed=seed, skip_specular_up_to=LISTED)
    paths = find_paths(room, EMITTER, LISTENER, max_order=LISTED)
    gains = paths.gains(np.full((room.surfaces, 1), np.sqrt(0.8 * 0.9)))[:, 0]
    energy = rest.energy[0, 0, 0].copy()
    at = (paths.length / C / STEP).astype(int)
    inside = at < len(energy)
    np.add.at(energy, at[inside], gains[inside] ** 2)
    return energy


ERRORS = ("Env_percent", "T60_percent", "C50_db", "EDT_ms")


def converge(counts: Sequence[int], reference: int, runs: int) -> list[dict[str, Any]]:
    """Return the mean errors of parameters against a run with many rays."""
    room = MeshGeometry.extruded(FLOOR, 3)
    wanted = parameters(whole_energy(room, reference, 12345))
    rows = []
    for count in counts:
        errors = []
        for seed in range(max(2, min(runs, 4_000_000 // count))):
            got = parameters(whole_energy(room, count, seed))
            errors.append(
                [
                    100
                    * np.mean(np.abs(got["Env"] - wanted["Env"]))
                    / wanted["Env"].max(),
                    100 * abs(got["T60"] / wanted["T60"] - 1),
                    abs(got["C50"] - wanted["C50"]),
                    1000 * abs(got["EDT"] - wanted["EDT"]),
                ]
            )
        mean = np.mean(errors, axis=0)
        rows.append({"rays": count, **dict(zip(ERRORS, mean.tolist(), strict=True))})
    if len(rows) > 1:
        x = np.log([row["rays"] for row in rows])
        slopes = {
            name: float(np.polyfit(x, np.log([row[name] for row in rows]), 1)[0])
            for name in ERRORS
        }
        rows.append({"rays": "slope", **slopes})
    return rows


def shown(title: str, rows: list[dict[str, Any]]) -> None:
    print(title)
    for row in rows:
        cells = (
            f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
            for name, value in row.items()
        )
        print("  " + "  ".join(cells))


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "ray_tracing", "fewer rays")
    options = parser.parse_args(argv)
    quick = options.quick
    parts: dict[str, list[dict[str, Any]]] = {
        "speed": measure_speed(2000, 1) if quick else measure_speed(100_000, 7),
        "against pyroomacoustics": [
            compare(2000 if quick else 100_000, scattering, 1 if quick else 2)
            for scattering in (0.0, 0.1)
        ],
        "energy of a lossless room": check_energy(1000 if quick else 100_000),
        "images to an order and rays beyond": check_seam(1000 if quick else 200_000),
        "reverberation against Eyring": check_eyring(2000 if quick else 40_000),
        "error against rays": converge((500, 2000), 8000, 2)
        if quick
        else converge((1000, 10_000, 100_000), 3_000_000, 16),
    }
    for title, rows in parts.items():
        shown(title, rows)
    write_results(options.out, parts)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
