"""Measure what is found of two rooms joined by a doorway, without a drawing.

Rooms of 5 and 4 m with a wall between them and an opening in it; responses by
mirror paths to order 12 and bent sound, noise 60 dB down, poses 3 mm off; openings,
thickness and loudspeakers differ from draw to draw. Asked for: who sees whom, which
places share a room, all faces and the volume, when sound arrives from room to room,
waveforms at unseen emitters, and late energy at unseen emitters of rough rooms.
SIMULATED. CPU seconds of one thread.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from harness import make_parser, write_results
from inverse.find import room_in_rows
from inverse.late.features import PlaceFeatures
from inverse.late.late_maps import chi_square_bias, fit_maps
from inverse.late.slopes import common_rates, region_curves
from inverse.paths.polyhedral import FittedMesh
from inverse.rows.direct import read_direct
from inverse.rows.fitset import FitSet
from inverse.rows.onsets import read_onsets
from inverse.rows.sight import read_sight
from inverse.walls.joining import find_joined
from inverse.walls.opening import Opening, Slab
from path_rooms import BENT, ROUGH, SPEED, BoxRegions, spoiled
from rir import GainPattern
from rooms import Scene
from rooms.mesh import MeshGeometry

RATE, ORDER = 16000, 12
MARGIN_M, JITTER_M, NOISE_DB = 0.4, 0.003, -60.0
EMITTERS, LISTENERS = (3, 2), 60
HIDDEN_PAIRS = 100
QUIET_DB = -100.0
LATE_S, BIN_S, LATE_BINS, LATE_HZ = 0.6, 0.02, (3, 29), (500.0, 4000.0)


@dataclass(frozen=True)
class House:
    """Two rooms, the wall between them and the hole in it, metres."""

    split: float = 5.0
    thick: float = 0.2
    hole: tuple[float, float, float] = (1.5, 2.4, 2.05)
    cardioid: bool = False
    scattering: float = 0.0

    @property
    def rooms(self) -> np.ndarray:
        """Corners of both rooms, shape (2, 2, 3)."""
        far = self.split + self.thick
        return np.array(
            [[[0, 0, 0], [self.split, 4, 2.6]], [[far, 0, 0], [far + 4, 4, 2.6]]]
        )

    @property
    def opening(self) -> Opening:
        """The hole, in the wall seen from the first room."""
        frame = np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
        limits = np.array([0.0, 4, 0, 2.6])
        slab = Slab(np.array([self.split, 0, 0]), frame, self.thick, limits)
        low, high, top = self.hole
        return Opening(slab, np.array([low, high, 0, top]), np.ones(4, bool), 1.0)

    def scene(self, absorption: tuple[float, float] = (0.23, 0.23)) -> Scene:
        """Return the scene; each room has an absorption of its own."""
        low, high, top = self.hole
        far = self.split + self.thick
        door = np.array([[self.split, low, 0], [far, high, top]])
        mesh = of_blocks(np.concatenate([self.rooms, door[None]]), self.split)
        walls = {
            name: {"absorption": one, "scattering": self.scattering}
            for name, one in zip(("first", "second"), absorption, strict=True)
        }
        gain = GainPattern.cardioid() if self.cardioid else GainPattern.omni()
        return replace(
            Scene.of_geometry(mesh, walls, name="two rooms"), emitter_gain=gain
        )


def of_blocks(blocks: np.ndarray, split: float) -> MeshGeometry:
    """Return the hull of blocks of air, shape (blocks, 2, 3), surfaces by side."""
    axes = [np.unique(blocks[:, :, k]) for k in range(3)]
    middles = [(one[1:] + one[:-1]) / 2 for one in axes]
    grid = np.stack(np.meshgrid(*middles, indexing="ij"), -1)
    air = np.zeros(grid.shape[:3], dtype=bool)
    for low, high in blocks:
        air |= ((grid > low) & (grid < high)).all(axis=-1)
    quads = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        part = np.moveaxis(np.pad(air, 1), axis, 0).astype(int)
        for place, i, j in np.argwhere(part[1:] != part[:-1]):
            for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = np.empty(3)
                corner[axis] = axes[axis][place]
                corner[others[0]] = axes[others[0]][i - 1 + u]
                corner[others[1]] = axes[others[1]][j - 1 + v]
                quads.append(corner)
    flat = np.array(quads).reshape(-1, 4, 3)
    corners = np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])
    names = np.where(corners[:, :, 0].mean(axis=1) > split, "second", "first")
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return MeshGeometry.from_arrays(vertices, faces.reshape(-1, 3), list(names))


def drawn(rng: np.random.Generator, room: np.ndarray, count: int) -> np.ndarray:
    """Draw places in a room, away from its walls."""
    return rng.uniform(room[0] + MARGIN_M, room[1] - MARGIN_M, (count, 3))


def rows_of(
    house: House,
    scene: Scene,
    rng: np.random.Generator,
    *,
    emitters: tuple[int, int] = EMITTERS,
    listeners: int = LISTENERS,
    effects: Sequence[str] = BENT,
    jitter: float = JITTER_M,
    noise_db: float = NOISE_DB,
    duration: float = 0.1,
) -> FitSet:
    """Simulate rows, half of each emitter's listeners in the other room."""
    rooms = house.rooms
    first = np.concatenate([drawn(rng, rooms[k], emitters[k]) for k in (0, 1)])
    seconds, yaws = [], []
    for _ in first:
        there = rng.random((listeners, 1)) < 0.5
        far, near = (drawn(rng, rooms[k], listeners) for k in (1, 0))
        seconds.append(np.where(there, far, near))
        yaws.append(2 * rng.uniform(0, np.pi))
    return spoiled(
        scene,
        first,
        np.array(yaws),
        np.array(seconds),
        rng,
        rate=RATE,
        duration=duration,
        effects=effects,
        max_order=ORDER,
        jitter=jitter,
        noise_db=noise_db,
    )


def sides(house: House, rows: FitSet) -> tuple[np.ndarray, np.ndarray]:
    """Return whether each end is in the second room."""
    middle = house.split + house.thick / 2
    ends = rows.emitters.positions, rows.listeners.positions
    return ends[0][:, 0] > middle, ends[1][:, 0] > middle


def true_ways(house: House, rows: FitSet) -> np.ndarray:
    """Return the shortest way of each row."""
    ends = rows.emitters.positions, rows.listeners.positions
    far, ways = sides(house, rows), rows.distances.copy()
    turned, across = far[0][:, None], far[0] != far[1]
    ordered = np.where(turned, *ends[::-1]), np.where(turned, *ends)
    ways[across] = house.opening.ways(ordered[0][across], ordered[1][across])
    return ways


def sight_case(house: House, rows: FitSet) -> dict[str, float]:
    """Score bits of sight, regions and first arrivals."""
    ways = true_ways(house, rows)
    seen = ways - rows.distances < 1e-6
    start = time.process_time()
    direct = read_direct(rows)
    sight = read_sight(rows, direct)
    regions = sight.regions(rows)
    spent = time.process_time() - start
    known = np.isfinite(sight.bits)
    numbers = regions.numbers(rows.listeners.positions)
    right = float((numbers == sides(house, rows)[1]).mean())
    hidden = np.flatnonzero(sight.bits == 0)
    some = rows.rows(hidden[np.random.default_rng(0).permutation(len(hidden))])
    some = some.rows(np.arange(min(len(some), HIDDEN_PAIRS)))
    onsets = read_onsets(some, direct)
    late = onsets.lengths - true_ways(house, some)
    return {
        "known": float(known.mean()),
        "wrong_bits": float((sight.bits[known] != seen[known]).mean()),
        "regions": float(regions.count),
        "right_room": max(right, 1 - right),
        "onset_cm": 100 * float(np.nanmedian(np.abs(late))),
        "pairs": float(len(some)),
        "sight_s": spent,
    }  # fmt: skip


def joined_case(house: House, rows: FitSet) -> dict[str, Any]:
    """Put the rooms together without a fit and score their faces."""
    start = time.process_time()
    direct = read_direct(rows)
    sight = read_sight(rows, direct)
    joined = find_joined(rows, direct, sight, sight.regions(rows))
    told: dict[str, Any] = {"cpu_s": time.process_time() - start}
    told["alarms"] = joined.alarms
    if joined.shape is None or len(joined.openings) != 1:
        return told
    return told | shape_scores(house, rows, joined.shape, joined.openings[0])


def shape_scores(
    house: House, rows: FitSet, shape: Any, opening: Opening
) -> dict[str, float]:
    """Score a shape with the opening it was given."""
    found = opening.slab
    ways = found.origin + opening.hole[:2, None] * found.frame[1]
    across = np.not_equal(*sides(house, rows))
    pairs = rows.emitters.positions[across], rows.listeners.positions[across]
    ahead = found.local(pairs[0])[:, :1] > 0
    told = opening.ways(np.where(ahead, *pairs), np.where(ahead, *pairs[::-1]))
    gap = told - true_ways(house, rows)[across]
    return {
        **held(house, rows, shape),
        "edge_cm": 100 * float(np.abs(np.sort(ways[:, 1]) - house.hole[:2]).max()),
        "thick_cm": 100 * abs(found.thick - house.thick),
        "first_samples": float(np.sqrt((gap**2).mean()) / SPEED * RATE),
        "lintel_told": float(opening.known[3]),
    }  # fmt: skip


def held(house: House, rows: FitSet, shape: Any) -> dict[str, float]:
    """Return the share of poses inside a shape and the error of its volume."""
    ends = np.concatenate([rows.emitters.positions, rows.listeners.positions])
    truth = float(house.scene().geometry.volume)
    return {
        "inside": float(1 - shape.mesh.outside(ends).mean()),
        "volume_percent": 100 * (float(shape.mesh.volume) / truth - 1),
    }


def fit_case(house: House, rows: FitSet, test: FitSet) -> dict[str, Any]:
    """Hear the rooms as the path field does and score unseen emitters."""
    start = time.process_time()
    heard = room_in_rows(rows)
    told: dict[str, Any] = {"cpu_s": time.process_time() - start}
    answer = heard.predict(test.emitters, test.listeners, test.n_samples)
    gap = ((answer - test.responses) ** 2).sum(axis=1) / (test.responses**2).sum(axis=1)
    far = np.not_equal(*sides(house, test))
    told |= {
        "several": float(isinstance(heard.fitted, FittedMesh)),
        "nmse_db": 10 * float(np.log10(np.median(gap))),
        "cross_nmse_db": 10 * float(np.log10(np.median(gap[far]))),
        "alarms": heard.alarms,
    }
    if isinstance(heard.fitted, FittedMesh):
        told |= held(house, rows, heard.fitted.room.shape)
    return told


def band_energies(rows: FitSet) -> np.ndarray:
    """Return energy from 500 Hz to 4 kHz in bins, shape (rows, bins)."""
    spectra = np.fft.rfft(rows.responses)
    hertz = np.fft.rfftfreq(rows.n_samples, 1 / RATE)
    spectra[:, (hertz < LATE_HZ[0]) | (hertz > LATE_HZ[1])] = 0
    sound = np.fft.irfft(spectra, rows.n_samples)
    length = round(BIN_S * RATE)
    count = rows.n_samples // length
    power = (sound[:, : count * length] ** 2).reshape(len(sound), count, length)
    return power.sum(axis=2)[:, LATE_BINS[0] : LATE_BINS[1]]


def late_case(seed: int) -> dict[str, dict[str, float]]:
    """Learn late energy of rough rooms; bins hold .5 dB of their own chance."""
    house, rng = House(scattering=0.3), np.random.default_rng(seed)
    scene = house.scene((0.08, 0.35))
    how: dict[str, Any] = {"effects": ROUGH, "duration": LATE_S, "listeners": 30}
    how["noise_db"] = QUIET_DB
    train = rows_of(house, scene, rng, **how)
    test = rows_of(house, scene, rng, emitters=(2, 2), **how)
    times = (np.arange(*LATE_BINS) + 0.5) * BIN_S
    bias = chi_square_bias(LATE_HZ[1] - LATE_HZ[0], BIN_S)
    log, truth = np.log(band_energies(train)) - bias, band_energies(test)
    across = np.not_equal(*sides(house, test))
    ends = [(one.emitters.positions, one.listeners.positions) for one in (train, test)]
    told = {}
    blind = read_sight(train, read_direct(train)).regions(train)
    kinds = {"exact": BoxRegions.of(house.rooms), "blind": blind}
    for kind, regions in kinds.items():
        features = PlaceFeatures.of(np.vstack(ends[0]), regions)
        numbers = [regions.numbers(one) for one in ends[0]]
        curves = region_curves(np.exp(log), *numbers)
        rates = common_rates(curves, times, most=min(len(np.unique(numbers[0])), 2))
        known = features(ends[0][0]), features(ends[0][1])
        maps = fit_maps(log, times, *known, rates, flags=regions.count)
        asked = features(ends[1][0]), features(ends[1][1])
        answer = maps.log_energies(*asked, times)
        gap = 10 / np.log(10) * (answer - np.log(truth) + bias)
        level = 10 * np.log10(np.exp(answer).sum(axis=1) / truth.sum(axis=1))
        told[f"late {seed}, {kind} regions"] = {
            "regions": float(regions.count),
            "slopes": float(len(rates)),
            "bins_db": float(np.sqrt((gap**2).mean())),
            "level_db": float(np.sqrt((level**2).mean())),
            "cross_db": float(np.sqrt((gap[across] ** 2).mean())),
        }
    return told


def houses(count: int, seed: int) -> list[House]:
    """Draw houses whose wall, opening and loudspeaker differ."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(count):
        low = rng.uniform(0.6, 2.2)
        hole = (low, low + rng.uniform(0.8, 1.1), rng.uniform(1.95, 2.2))
        thick = (0.02, 0.12, 0.25)[k % 3]
        made.append(House(rng.uniform(4.2, 5.2), thick, hole, cardioid=k % 2 == 1))
    return made


def shown(name: str, case: dict[str, Any]) -> None:
    """Print one case."""
    values = {key: value for key, value in case.items() if key != "alarms"}
    print(
        f"{name:22}", "  ".join(f"{key} {value:.3g}" for key, value in values.items())
    )
    for alarm in case.get("alarms", []):
        print(f"    {alarm}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0."""
    parser = make_parser(__doc__, "path_doors", "one house")
    parser.add_argument("--draws", type=int, default=6)
    parser.add_argument("--seed", type=int, default=500)
    parser.add_argument("--fits", type=int, default=2, help="houses fitted whole")
    parser.add_argument("--late", type=int, default=2, help="rough houses")
    options = parser.parse_args(argv)
    results: dict[str, dict[str, Any]] = {}
    print("SIMULATED")
    for k, house in enumerate(
        houses(1 if options.quick else options.draws, options.seed)
    ):
        rng = np.random.default_rng(options.seed + k)
        scene = house.scene()
        rows = rows_of(house, scene, rng)
        kind = "cardioid" if house.cardioid else "omni"
        name = f"{k}, {100 * house.thick:.0f} cm, {kind}"
        results[f"sight {name}"] = sight_case(house, rows)
        results[f"shape {name}"] = joined_case(house, rows)
        if not options.quick and k < options.fits:
            clean: dict[str, Any] = {"jitter": 0.0, "noise_db": -200.0}
            test = rows_of(house, scene, rng, emitters=(1, 1), listeners=15, **clean)
            results[f"fit {name}"] = fit_case(house, rows, test)
        for case in [one for one in results if one.endswith(name)]:
            shown(case, results[case])
    for k in range(0 if options.quick else options.late):
        for name, case in late_case(options.seed + k).items():
            results[name] = case
            shown(name, case)
    write_results(options.out, {"simulated": True, "rows": results})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
