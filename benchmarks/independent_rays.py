"""Energy rays among triangles with Lambert scattering: a judge that shares no code.

Every ray tries every triangle, is reflected by a mirror or by Lambert's law as chance
has it, loses what the triangle absorbs, and is heard in balls around the places. Both
sides of a triangle reflect. The direct sound is told by sight and 1/d² instead of the
few rays that meet it. Slow and plain on purpose; reads nothing of `rooms`.

Used by other benchmarks; alone it checks itself. Bar: the mean energy of a lossless
box 4 pi c / V within 1 %, Eyring's decay in a diffuse one within 5 %.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from harness import make_parser, write_results

C = 343.2  # m/s
STEP = 0.001  # s


@njit(cache=True, nogil=True, fastmath=True)
def _first(table, ox, oy, oz, dx, dy, dz):
    """Return distance and number of the triangle that a ray meets first."""
    best, face = 1e30, -1
    for f in range(len(table)):
        along = table[f, 0] * dx + table[f, 1] * dy + table[f, 2] * dz
        if abs(along) < 1e-12:
            continue
        t = table[f, 3] - table[f, 0] * ox - table[f, 1] * oy - table[f, 2] * oz
        t /= along
        if t <= 1e-7 or t >= best:
            continue
        x, y, z = ox + t * dx, oy + t * dy, oz + t * dz
        # barycentric coordinates as planes: both must be positive, their sum below 1
        u = table[f, 4] * x + table[f, 5] * y + table[f, 6] * z + table[f, 7]
        v = table[f, 8] * x + table[f, 9] * y + table[f, 10] * z + table[f, 11]
        if u >= -1e-9 and v >= -1e-9 and u + v <= 1 + 2e-9:
            best, face = t, f
    return best, face


@njit(cache=True, nogil=True, fastmath=True)
def _trace(table, kept, spread, source, places, count, reach, radius, per_bin, rng):
    bins = int(reach * per_bin)
    out = np.zeros((len(places), bins))
    volume = 4 / 3 * np.pi * radius**3
    for _ in range(count):
        ox, oy, oz = source
        dz, turn = 2 * rng.random() - 1, 2 * np.pi * rng.random()
        flat = np.sqrt(1 - dz * dz)
        dx, dy = flat * np.cos(turn), flat * np.sin(turn)
        energy, gone, order = 4 * np.pi / count, 0.0, 0
        while gone < reach and energy * count > 1e-7:
            length, face = _first(table, ox, oy, oz, dx, dy, dz)
            for m in range(len(places) if order > 0 else 0):
                wx, wy, wz = places[m, 0] - ox, places[m, 1] - oy, places[m, 2] - oz
                b = wx * dx + wy * dy + wz * dz
                inside = b * b - wx * wx - wy * wy - wz * wz + radius * radius
                if inside <= 0:
                    continue
                half = np.sqrt(inside)
                start, end = max(0.0, b - half), min(length, b + half)
                at = int((gone + (start + end) / 2) * per_bin)
                if end > start and at < bins:
                    out[m, at] += energy * (end - start) / volume
            if face < 0:
                break
            gone += length
            order += 1
            ox, oy, oz = ox + length * dx, oy + length * dy, oz + length * dz
            energy *= kept[face]
            nx, ny, nz = table[face, 0], table[face, 1], table[face, 2]
            along = nx * dx + ny * dy + nz * dz
            if along > 0:
                nx, ny, nz, along = -nx, -ny, -nz, -along
            if rng.random() >= spread[face]:
                dx, dy, dz = (
                    dx - 2 * along * nx,
                    dy - 2 * along * ny,
                    dz - 2 * along * nz,
                )
            else:
                # a point of the unit sphere around the tip of the normal
                up, turn = 2 * rng.random() - 1, 2 * np.pi * rng.random()
                flat = np.sqrt(1 - up * up)
                dx, dy, dz = nx + flat * np.cos(turn), ny + flat * np.sin(turn), nz + up
                size = np.sqrt(dx * dx + dy * dy + dz * dz)
                dx, dy, dz = dx / size, dy / size, dz / size
            ox, oy, oz = ox + 1e-7 * nx, oy + 1e-7 * ny, oz + 1e-7 * nz
    return out


def _table(triangles: np.ndarray) -> np.ndarray:
    """Return planes of the triangles and of their barycentric coordinates, (F, 12)."""
    a, b, c = np.moveaxis(np.asarray(triangles, dtype=float), 1, 0)
    one, other = b - a, c - a
    normal = np.cross(one, other)
    square = np.einsum("fk,fk->f", normal, normal)[:, None]
    unit = normal / np.sqrt(square)
    u, v = np.cross(other, normal) / square, np.cross(normal, one) / square
    dot = lambda x, y: np.einsum("fk,fk->f", x, y)[:, None]  # noqa: E731
    return np.hstack([unit, dot(unit, a), u, -dot(u, a), v, -dot(v, a)])


def ray_energy(
    triangles: np.ndarray,
    absorption: np.ndarray,
    scattering: np.ndarray,
    source: Sequence[float],
    places: np.ndarray,
    *,
    rays: int,
    duration: float,
    radius: float = 0.5,
    seed: int = 1,
) -> np.ndarray:
    """Return energy per millisecond at places, direct sound 1/d², (places, bins).

    Parameters
    ----------
    triangles : ndarray, shape (F, 3, 3)
        Corners [m].
    absorption, scattering : ndarray, shape (F,)
        Shares of each triangle.
    source : sequence of float
        Position [m].
    places : ndarray, shape (P, 3)
        Positions [m], further than `radius` from any triangle.
    rays, duration, radius, seed : int, float, float, int
        Number of rays, length [s], radius of the balls [m], key of chance.
    """
    table, origin = _table(triangles), np.asarray(source, dtype=float)
    places = np.asarray(places, dtype=float)
    kept = 1.0 - np.asarray(absorption, dtype=float)
    spread = np.asarray(scattering, dtype=float)
    per_bin, rng = 1 / (C * STEP), np.random.default_rng(seed)
    reach = duration * C
    energy = _trace(
        table, kept, spread, origin, places, rays, reach, radius, per_bin, rng
    )
    for k, place in enumerate(places):
        way = place - origin
        gap = float(np.linalg.norm(way))
        if _first(table, *origin, *(way / gap))[0] >= gap:
            energy[k, int(gap * per_bin)] += 1 / gap**2
    return energy


def energy_parameters(energy: np.ndarray, arrival: float) -> dict[str, float]:
    """Return T30, EDT [s], C80 [dB], D50 [%], TS [ms], G [dB] of energy per ms."""
    left = np.cumsum(energy[::-1])[::-1]
    level = 10 * np.log10(left / left[0] + 1e-30)
    late, first = (level < -5) & (level > -35), level > -10
    time = np.arange(len(energy)) * STEP
    slope = lambda use: -60 / float(np.polyfit(time[use], level[use], 1)[0])  # noqa: E731
    start = int(arrival / STEP)
    return {
        "T30": slope(late),
        "EDT": slope(first),
        "C80": float(
            10 * np.log10(energy[: start + 80].sum() / energy[start + 80 :].sum())
        ),
        "D50": float(100 * energy[: start + 50].sum() / energy.sum()),
        "TS": float(1000 * (energy @ (time - arrival)) / energy.sum()),
        "G": float(10 * np.log10(energy.sum() * 100)),
    }


def box_triangles(size: np.ndarray | Sequence[float]) -> np.ndarray:
    """Return the twelve triangles of a box with a corner at the origin."""
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4)]
    sides.append((1, 5, 7, 3))
    faces = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return (corner * np.asarray(size, dtype=float))[np.array(faces)]


def main(argv: Sequence[str] | None = None) -> int:
    options = make_parser(__doc__, "independent_rays").parse_args(argv)
    size, rays = np.array([6.0, 5.0, 3.0]), 4_000 if options.quick else 100_000
    shape, volume = box_triangles(size), float(np.prod(size))
    places = np.array([[4.1, 1.3, 1.9], [2.0, 2.0, 1.0]])
    same = lambda share: np.full(12, share)  # noqa: E731
    run = lambda lost, s: ray_energy(  # noqa: E731
        shape, same(lost), same(s), [1.7, 3.1, 1.4], places, rays=rays, duration=0.8
    ).sum(axis=0)
    kept = run(0.0, 0.5)[100:].mean() / (2 * 4 * np.pi * C * STEP / volume)
    area = 2 * float(size @ np.roll(size, 1))
    eyring = 24 * np.log(10) * volume / (-C * area * np.log(0.8))
    decay = energy_parameters(run(0.2, 0.6), 0.01)["T30"]
    rows = {"lossless_ratio": float(kept), "t30_s": decay, "eyring_s": eyring}
    for name, value in rows.items():
        print(f"{name:15s} {value:.4f}")
    write_results(options.out, rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
