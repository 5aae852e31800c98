"""Compare early and late energy of control rooms with truths that share no code.

A diffuse box by radiosity (Kuttruff's integral equation, patch by patch); one dead wall
and moderate scattering, two rooms behind an opening, a staged hall with balconies and
reflectors, listed to orders 1 and 3, by independent rays; and sound that one wall of a
corner mirrors and the other scatters, by the integral over the wall. Errors are those
of complete responses, 0.7 to 5.6 kHz, without air, mean over pairs.

Bar: mean T30 0.5 %, EDT 1 %, C80 0.1 dB, G 0.05 dB, each beyond two standard errors;
0.3 dB of C80 at hidden places of the hall.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from independent_rays import STEP, C, box_triangles, energy_parameters, ray_energy
from rooms import Scene, simulate
from rooms.mesh import MeshGeometry
from rooms.rays import trace_energy

RATE = 16000
SEEDS = 6
PARTS = ["direct", "specular", "scattering", "late"]
SHOWN = ("T30", "EDT", "C80", "D50", "TS", "G")
Rows = list[dict[str, Any]]
Shares = dict[str, tuple[float, float]]


def mesh_of(triangles: np.ndarray, names: list[str], shares: Shares) -> Scene:
    """Return the scene of triangles whose surfaces absorb and scatter as stated."""
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    geometry = MeshGeometry.from_arrays(triangles.reshape(-1, 3), faces, names)
    materials = {
        name: {"absorption": absorption, "scattering": scattering}
        for name, (absorption, scattering) in shares.items()
    }
    return Scene.of_geometry(geometry, materials)


def heard(
    scene: Scene,
    ends: tuple[np.ndarray, np.ndarray],
    duration: float,
    seeds: int,
    **options: Any,
) -> np.ndarray:
    """Return parameters of simulated responses, mean over seeds, (E, L, parameters)."""
    from scipy.signal import butter, sosfiltfilt

    band = butter(4, [700, 5600], "band", fs=RATE, output="sos")

    def squares(room: Scene, *places: Any, **more: Any) -> np.ndarray:
        run = {"sample_rate": RATE, "duration": duration, "effects": PARTS}
        responses = simulate(room, *places, **run, **more).responses
        return sosfiltfilt(band, responses, axis=-1) ** 2

    # what the band keeps of a pulse heard at 10 m
    free = Scene.shoebox((30, 30, 30), absorption=1.0)
    kept = squares(free, [10.0, 15, 15], [20.0, 15, 15]).sum() * 100
    shape = len(ends[0]), len(ends[1]), round(duration / STEP), -1
    found = [
        table(
            squares(scene, *ends, seed=k, **options).reshape(shape).sum(-1) / kept, ends
        )
        for k in range(seeds)
    ]
    # the waves of the tail are the same for all pairs: only seeds even them out
    return np.mean(found, axis=0)


def table(energy: np.ndarray, ends: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return parameters of all pairs, shape (E, L, parameters)."""
    way = np.linalg.norm(ends[0][:, None] - ends[1][None], axis=-1) / C
    return np.array(
        [
            [
                [energy_parameters(e, t)[name] for name in SHOWN]
                for e, t in zip(row, times, strict=True)
            ]
            for row, times in zip(energy, way, strict=True)
        ]
    )


def errors(case: str, engine: str, got: np.ndarray, wanted: np.ndarray) -> Rows:
    """Return mean errors over pairs, times in percent, with standard errors."""
    gap = (got - wanted).reshape(-1, len(SHOWN))
    gap[:, :2] *= 100 / wanted[..., :2].reshape(-1, 2).mean(axis=0)
    mean, spread = gap.mean(axis=0), gap.std(axis=0) / np.sqrt(len(gap))
    row: dict[str, Any] = {"case": case, "engine": engine}
    for name, value, error in zip(SHOWN, mean, spread, strict=True):
        row |= {name: round(float(value), 3), f"{name}_se": round(float(error), 3)}
    print(
        f"{case:24s} {engine:14s}"
        + "".join(
            f"  {name} {value:+.2f}±{error:.2f}"
            for name, value, error in zip(SHOWN, mean, spread, strict=True)
        ),
        flush=True,
    )
    return [row]


def box_patches(size: np.ndarray, side: float, fine: int) -> tuple[np.ndarray, ...]:
    """Return parts of square patches of a box, their middles, normals, and areas.

    Shapes are (N, fine², 3), (N, 3), (N, 3), (N,); normals point into the box.
    """
    found = []
    for axis in range(3):
        flat = [k for k in range(3) if k != axis]
        counts = [max(1, round(size[k] / side)) for k in flat]
        u, v = ((np.arange(n * fine) + 0.5) / (n * fine) for n in counts)
        grid = np.array(np.meshgrid(u, v, indexing="ij"))
        grid = grid.reshape(2, counts[0], fine, counts[1], fine)
        grid = grid.transpose(1, 3, 2, 4, 0).reshape(-1, fine * fine, 2)
        area = size[flat[0]] * size[flat[1]] / len(grid)
        for high in (0, 1):
            parts = np.full((*grid.shape[:2], 3), high * size[axis])
            parts[..., flat] = grid * size[flat]
            normal = np.zeros((len(grid), 3))
            normal[:, axis] = 1 - 2 * high
            found.append((parts, normal, np.full(len(grid), area)))
    parts, normal, area = (np.concatenate(part) for part in zip(*found, strict=True))
    return parts, parts.mean(axis=1), normal, area


def form_factors(
    parts: np.ndarray, normal: np.ndarray, area: np.ndarray, near: float
) -> np.ndarray:
    """Return what patches exchange, areas included, (N, N); by parts where near."""

    def kernel(one: Any, other: Any, n: np.ndarray, m: np.ndarray) -> np.ndarray:
        way = other - one
        square = np.einsum("...k,...k->...", way, way)
        ahead = np.maximum(np.einsum("...k,...k->...", way, n), 0)
        facing = np.maximum(-np.einsum("...k,...k->...", way, m), 0)
        return np.where(square > 0, ahead * facing / np.pi / square**2, 0.0)

    middle = parts.mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = kernel(middle[:, None], middle[None], normal[:, None], normal[None])
    gap = np.linalg.norm(middle[:, None] - middle[None], axis=-1)
    apart = np.abs(normal @ normal.T) < 0.5
    for i, j in np.argwhere((gap < near) & apart):
        some = kernel(parts[i][:, None], parts[j][None], normal[i], normal[j])
        share[i, j] = some.mean()
    share *= area[:, None] * area
    for _ in range(60):
        given = share.sum(axis=1) / area
        share /= np.sqrt(given[:, None] * given)
    return share


def radiosity(
    size: np.ndarray,
    absorption: float,
    ends: tuple[np.ndarray, np.ndarray],
    duration: float,
    side: float,
) -> np.ndarray:
    """Return energy per millisecond in a box of Lambert walls, (E, L, bins).

    H. Kuttruff, Room Acoustics, 6th ed., 2016, section 4.7: irradiation of each patch
    is what others send, later by the way between; delays fall between two bins in
    proportion, and exchange is evened so that each patch gives all it has.
    """
    from scipy.sparse import coo_array

    parts, middle, normal, area = box_patches(size, side, 8)
    bins, per_bin = round(duration / STEP), 1 / (C * STEP)
    share = form_factors(parts, normal, area, 2.5 * side)
    gap = np.linalg.norm(middle[None] - middle[:, None], axis=-1)
    to, source = np.nonzero(share > 0)
    late = gap[to, source] * per_bin
    whole = late.astype(int)
    part = late - whole
    value = (1 - absorption) * share[to, source] / area[to]
    steps = [
        coo_array(
            (
                np.concatenate([value[now] * (1 - part[now]), value[old] * part[old]]),
                (
                    np.concatenate([to[now], to[old]]),
                    np.concatenate([source[now], source[old]]),
                ),
            ),
            shape=(len(area),) * 2,
        ).tocsr()
        for k in range(int(whole.max()) + 2)
        for now, old in [(whole == k, whole == k - 1)]
    ]
    out = np.zeros((len(ends[0]), len(ends[1]), bins))
    for number, emitter in enumerate(ends[0]):
        light = np.zeros((bins + 1, len(area)))
        lead = middle - emitter
        far = np.linalg.norm(lead, axis=1)
        first = np.abs(np.einsum("ik,ik->i", lead, normal)) / far**3
        at = (far * per_bin).astype(int)
        light[at, np.arange(len(area))] += first * (1 - absorption)
        for t in range(bins):
            for k, step in enumerate(steps[: t + 1]):
                light[t] += step @ light[t - k]
        for other, listener in enumerate(ends[1]):
            lead = middle - listener
            far = np.linalg.norm(lead, axis=1)
            seen = np.abs(np.einsum("ik,ik->i", lead, normal)) / far**3 * area / np.pi
            late = (far * per_bin).astype(int)
            for k in np.unique(late):
                some = late == k
                out[number, other, k:] += light[: bins - k, some] @ seen[some]
            span = float(np.linalg.norm(emitter - listener))
            out[number, other, int(span * per_bin)] += 1 / span**2
    return out


def diffuse_box(quick: bool) -> Rows:
    size, absorption, duration = np.array([7.0, 5.0, 3.5]), 0.25, 0.6
    rng = np.random.default_rng(1)
    ends = rng.uniform(0.25, 0.75, (2, 3)) * size, rng.uniform(0.2, 0.8, (12, 3)) * size
    if quick:
        ends = ends[0][:1], ends[1][:2]
    energy = radiosity(size, absorption, ends, duration, 1.0 if quick else 0.5)
    wanted = table(energy, ends)
    box = Scene.shoebox(tuple(size), absorption=absorption, scattering=1.0)
    walls = [f"wall{k // 2}" for k in range(12)]
    shares = dict.fromkeys(walls, (absorption, 1.0))
    mesh = mesh_of(box_triangles(size), walls, shares)
    rays = {"rays": 1000} if quick else {}
    seeds = 1 if quick else SEEDS
    rows = errors("diffuse box", "box", heard(box, ends, duration, seeds), wanted)
    got = heard(mesh, ends, duration, seeds, **rays)
    return rows + errors("diffuse box", "mesh", got, wanted)


def judged(
    case: str,
    triangles: np.ndarray,
    names: list[str],
    shares: Shares,
    ends: tuple[np.ndarray, np.ndarray],
    duration: float,
    quick: bool,
    orders: Sequence[int] = (3,),
    kinds: Sequence[str] = (),
) -> Rows:
    """Compare a mesh with independent rays, whole and by kinds of places."""
    count = 2000 if quick else 1_000_000
    absorption, scattering = np.array([shares[name] for name in names]).T
    energy = [
        ray_energy(
            triangles,
            absorption,
            scattering,
            emitter,
            ends[1],
            rays=count,
            duration=duration,
            radius=0.4,
            seed=7 + k,
        )
        for k, emitter in enumerate(ends[0])
    ]
    wanted, rows = table(np.array(energy), ends), []
    scene, seeds = mesh_of(triangles, names, shares), 1 if quick else SEEDS
    rays = {"rays": 1000} if quick else {}
    for order in orders:
        got = heard(scene, ends, duration, seeds, max_order=order, **rays)
        rows += errors(case, f"mesh, order {order}", got, wanted)
        for kind in dict.fromkeys(kinds):
            some = np.array(kinds) == kind
            rows += errors(f"  {kind}", "", got[:, some], wanted[:, some])
    return rows


def dead_wall(quick: bool) -> Rows:
    size = np.array([6.0, 5.0, 3.0])
    rng = np.random.default_rng(0)
    ends = rng.uniform(0.2, 0.8, (2, 3)) * size, rng.uniform(0.15, 0.85, (12, 3)) * size
    walls = [f"wall{k // 2}" for k in range(12)]
    shares = {**dict.fromkeys(walls, (0.05, 0.3)), "wall4": (0.1, 0.3)}
    shares["wall5"] = (0.6, 0.3)
    triangles = box_triangles(size)
    return judged("dead ceiling", triangles, walls, shares, ends, 1.0, quick)


def quads(
    corners: Sequence[Sequence[Sequence[float]]],
) -> list[np.ndarray]:
    """Return two triangles for each quadrangle."""
    return [
        np.array([c[i], c[j], c[k]], float)
        for c in corners
        for i, j, k in ((0, 1, 2), (0, 2, 3))
    ]


def coupled_rooms(quick: bool) -> Rows:
    hard = box_triangles([6, 5, 3.0])
    soft = box_triangles([4, 4, 3.0]) + np.array([6.0, 0.5, 0])
    middle = np.concatenate([hard[2:4], soft[:2]])
    kept = [t for t in (*hard, *soft) if not any(np.array_equal(t, m) for m in middle)]
    # the wall between, open from y = 2 to 3.2 and up to 2.2 m
    wall = quads(
        [
            [(6, 0, 0), (6, 2, 0), (6, 2, 3), (6, 0, 3)],
            [(6, 3.2, 0), (6, 5, 0), (6, 5, 3), (6, 3.2, 3)],
            [(6, 2, 2.2), (6, 3.2, 2.2), (6, 3.2, 3), (6, 2, 3)],
        ]
    )
    names = ["hard"] * 10 + ["soft"] * 10 + ["hard"] * len(wall)
    shares = {"hard": (0.06, 0.2), "soft": (0.4, 0.4)}
    emitters = np.array([[2.0, 1.5, 1.5], [8.2, 3.4, 1.4]])
    listeners = np.array(
        [[4.1, 3.6, 1.2], [1.3, 4.0, 1.7], [8.9, 1.5, 1.2], [7.2, 4.0, 1.6]]
    )
    triangles, ends = np.array([*kept, *wall]), (emitters, listeners)
    return judged("coupled rooms", triangles, names, shares, ends, 1.2, quick)


HALL_SHARES: Shares = {
    "floor": (0.1, 0.1),
    "seats": (0.6, 0.6),
    "ceiling": (0.08, 0.3),
    "walls": (0.1, 0.3),
    "rear": (0.2, 0.4),
    "stage": (0.3, 0.5),
    "balcony": (0.25, 0.4),
    "reflector": (0.05, 0.1),
}
HALL_PLACES = {
    "stalls": [(13, 10, 1.7), (18, 5, 2.4), (18, 14, 2.4), (21, 10, 2.8)],
    "under the balcony": [(25, 10, 3.5), (27.5, 4, 3.8), (28, 16, 3.9)],
    "on the balcony": [(26, 8, 8.0), (28, 15, 8.2)],
    "at the sides": [(12, 18.7, 7.2), (16, 1.2, 3.9)],
    "on stage": [(-5, 6, 1.5), (6, 3, 1.5)],
}


def staged_hall() -> tuple[np.ndarray, list[str]]:
    """Return a hall of 30 x 20 x 12 m with open panels, and its surfaces' names."""
    x, y, z = 30, 20, 12
    parts: list[tuple[str, Any]] = [
        ("floor", [(0, 0, 0), (10, 0, 0), (10, y, 0), (0, y, 0)]),
        ("seats", [(10, 0, 0), (x, 0, 3), (x, y, 3), (10, y, 0)]),
        ("ceiling", [(0, 0, z), (x, 0, z), (x, y, z), (0, y, z)]),
        ("rear", [(x, 0, 3), (x, y, 3), (x, y, z), (x, 0, z)]),
        ("walls", [(0, 0, 0), (0, 4, 0), (0, 4, z), (0, 0, z)]),
        ("walls", [(0, 16, 0), (0, y, 0), (0, y, z), (0, 16, z)]),
        ("walls", [(0, 4, 8), (0, 16, 8), (0, 16, z), (0, 4, z)]),
        ("stage", [(-8, 4, 0), (0, 4, 0), (0, 16, 0), (-8, 16, 0)]),
        ("stage", [(-8, 4, z), (0, 4, z), (0, 16, z), (-8, 16, z)]),
        ("stage", [(-8, 4, 0), (-8, 16, 0), (-8, 16, z), (-8, 4, z)]),
        ("balcony", [(22, 0, 6.2), (x, 0, 7.2), (x, y, 7.2), (22, y, 6.2)]),
        ("balcony", [(22, 0, 6.2), (22, y, 6.2), (22, y, 7.2), (22, 0, 7.2)]),
    ]
    for side in (0, y):
        foot = [(0, side, 0), (10, side, 0), (10, side, z), (0, side, z)]
        parts.append(("walls", foot))
        parts.append(
            ("walls", [(10, side, 0), (x, side, 3), (x, side, z), (10, side, z)])
        )
    for side in (4, 16):
        wing = [(-8, side, 0), (0, side, 0), (0, side, z), (-8, side, z)]
        parts.append(("stage", wing))
    for a, b in ((0, 2.5), (y, y - 2.5)):
        parts.append(
            ("balcony", [(10, a, 5.5), (22, a, 6.2), (22, b, 6.2), (10, b, 5.5)])
        )
        parts.append(
            ("balcony", [(10, b, 5.5), (22, b, 6.2), (22, b, 7.2), (10, b, 6.5)])
        )
    for k, left in enumerate((1.5, 4.5, 7.5)):
        low, right = 8.5 + 0.5 * k, left + 2.5
        for near in (4, 10.5):
            far, high = near + 5.5, low + 0.6
            sail = [(left, near, low), (right, near, high), (right, far, high)]
            parts.append(("reflector", [*sail, (left, far, low)]))
    for a, b in ((1, 3.5), (19, 16.5)):
        parts.append(("reflector", [(2, a, 6), (9, a, 6.5), (9, b, 8.5), (2, b, 8)]))
    triangles = np.array(quads([corners for _, corners in parts]))
    return triangles, [name for name, _ in parts for _ in range(2)]


def hall(quick: bool) -> Rows:
    triangles, names = staged_hall()
    emitters = np.array([[3.0, 9, 1.5], [-4, 12, 1.6]])
    listeners = np.array([p for some in HALL_PLACES.values() for p in some], float)
    kinds = [kind for kind, some in HALL_PLACES.items() for _ in some]
    orders = (1,) if quick else (1, 3)
    ends = emitters[:1] if quick else emitters, listeners
    return judged(
        "staged hall", triangles, names, HALL_SHARES, ends, 1.6, quick, orders, kinds
    )


def corner(quick: bool) -> Rows:
    """Return errors of what a smooth wall mirrors onto a rough one, near their edge."""
    rows = []
    size = np.array([6.0, 5.0, 3.0])
    names = ["x0", "x1", "y0", "y1", "floor", "ceiling"]
    room = MeshGeometry.box(size)
    order = [names.index(name) for name in room.surface_names]
    absorption, scattering = np.ones(6), np.zeros(6)
    absorption[[0, 4]], scattering[4] = 0.2, 1.0
    for gap in (0.2, 0.5, 1.0, 2.0):
        a, b = np.array([gap, 2.4, gap]), np.array([1.2 * gap, 2.6, 0.9 * gap])
        result = trace_energy(
            room,
            absorption[order][:, None],
            scattering[order][:, None],
            [a],
            [b],
            rays=2000 if quick else 20_000,
            duration=0.05,
            time_step=0.001,
            speed_of_sound=C,
            skip_specular_up_to=1,
        )
        wanted = _lambert(a, b, size) + sum(
            0.8 * _lambert(*ends, size)
            for ends in ((_mirrored(a), b), (a, _mirrored(b)))
        )
        twice = 0.8**2 * _lambert(_mirrored(a), _mirrored(b), size)
        got = float(result.energy.sum())
        level = 10 * np.log10(got / (wanted + twice))
        rows.append({"case": "corner", "gap_m": gap, "level_db": round(level, 3)})
        print(f"{'corner':24s} {gap:g} m from both walls: {level:+.2f} dB", flush=True)
    return rows


def _mirrored(point: np.ndarray) -> np.ndarray:
    return point * [-1, 1, 1]


def _lambert(a: np.ndarray, b: np.ndarray, size: np.ndarray) -> float:
    """Return the energy of one scattering by the floor, from a to b.

    Images in the wall x = 0 see the floor through it, as far as there is a wall.
    """
    x, y = (np.sinh(np.linspace(-7, 7, 1601)) for _ in range(2))
    x, y = (np.abs(x) / x[-1] if k == 0 else x / x[-1] for k, x in enumerate((x, y)))
    # finest at the edge, and opposite the places
    x = np.sort(np.unique(x)) * size[0]
    y = np.sort(np.unique(np.clip(2.5 + y * 2.5, 0, size[1])))
    wide = np.outer(np.gradient(x), np.gradient(y))
    x, y = np.meshgrid(x, y, indexing="ij")
    spans = [np.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + p[2] ** 2) for p in (a, b)]
    flux = a[2] / spans[0] ** 3 * b[2] / spans[1] ** 3
    return float(np.sum(flux * wide) * 0.8 / np.pi)


CASES: dict[str, Callable[[bool], Rows]] = {
    "diffuse box": diffuse_box,
    "dead wall": dead_wall,
    "coupled rooms": coupled_rooms,
    "staged hall": hall,
    "corner": corner,
}
"""Control cases: a new one is a function here."""


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "early_energy", "few rays: does it run?")
    parser.add_argument("--only", help="one case: " + ", ".join(CASES))
    options = parser.parse_args(argv)
    rows: Rows = []
    for name, case in CASES.items():
        if options.only in (None, name):
            start = time.process_time()
            rows += case(options.quick)
            print(f"  {time.process_time() - start:.1f} CPU s", flush=True)
    write_results(options.out, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
