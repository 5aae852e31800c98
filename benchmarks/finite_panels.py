"""Measure what plates mirror against boundary elements, and whether energy is kept.

Bar: reflections from thin plates of 1 x 1 to 4 x 2 m met at 0 to 75 degrees within 1 dB
of boundary elements in every octave from 63 Hz; energy of a lossless hall of reflectors
kept within 0.05 dB; exchange of the ends below -120 dB.

The truth is the boundary integral of a thin rigid plate: it knows neither rays nor
edges. `panels` solves the same integral, with other elements, while a plate spans up to
four wavelengths; octaves above are of another class of model and are told apart.
Octaves in which the truth would take minutes are left out. Beside `panels` stand
Fresnel's integrals alone, and mirror and bent ways together (`specular` and
`diffraction` without `panels`). The listed places, many at 75 degrees, served to choose
between forms of the model; the drawn ones did not.
"""

import time
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from harness import make_parser, write_results
from rir import Pose, Poses
from rooms import Scene
from rooms.effects import EFFECTS
from rooms.mesh import MeshGeometry
from rooms.panels import finite_panels, mirror_strength
from rooms.panels.strength import Faces
from rooms.rays import trace_energy
from rooms.sound import Budget, Sound

SPEED = 343.2  # m/s
OCTAVES = np.array([63.0 * 2**k for k in range(7)])
FREQUENCIES = 6  # of each octave: the truth's own mean moves by 0.1 dB with more
ELEMENTS = 10  # a wavelength: 20 move levels by 0.05 dB
FEWEST = 16  # elements along a side
DENSE = 1500  # elements up to which the matrix is solved at once
PLATES = {(1, 1): 2016, (2, 1): 2016, (2, 2): 1008, (4, 2): 1008}  # m: Hz, in minutes
DRAWN = [(1.7, 1.3), (4, 1.2), (2.8, 2), (1, 1)]  # m, at drawn places
ASIDE = np.array([1e-3, 2e-3, 0])  # m: no way runs along a diagonal of the mesh
# angle and turn of incidence [deg], ways before and after [m], shares of the half sides
PLACES = [
    (0, 0, 5.0, 5.0, 0.0),
    (30, 0, 5.0, 5.0, 0.0),
    (45, 0, 5.0, 5.0, 0.0),
    (60, 0, 5.0, 5.0, 0.0),
    (75, 0, 5.0, 5.0, 0.0),
    (75, 90, 5.0, 5.0, 0.0),
    (60, 45, 5.0, 5.0, 0.0),
    (0, 0, 2.0, 8.0, 0.4),
    (45, 0, 2.0, 8.0, 0.4),
    (60, 90, 2.0, 8.0, 0.4),
    (75, 0, 2.0, 8.0, 0.4),
]


@dataclass(frozen=True)
class PlateElements:
    """A thin rigid plate as equal elements with a jump of pressure each.

    A. Maue, Z. Phys. 126, 601 (1949). Elements end a quarter of their length inside the
    edges, as doublets on thin wings do: the added mass of a square plate comes out
    within 0.2 % of Meyerhoff's.
    """

    width: float
    depth: float
    step: float

    @cached_property
    def counts(self) -> tuple[int, int]:
        """Elements along both sides."""
        along, across = (
            max(FEWEST, int(np.ceil(side / self.step)))
            for side in (self.width, self.depth)
        )
        return along, across

    @cached_property
    def steps(self) -> tuple[float, float]:
        """Sides of an element [m]."""
        (one, other), (n, m) = (self.width, self.depth), self.counts
        return one / (n + 0.5), other / (m + 0.5)

    @cached_property
    def places(self) -> np.ndarray:
        """Middles of the elements, shape (n, m, 3)."""
        axes = [
            (np.arange(n) - (n - 1) / 2) * step
            for n, step in zip(self.counts, self.steps, strict=True)
        ]
        x, y = np.meshgrid(*axes, indexing="ij")
        return np.stack([x, y, 0 * x], axis=-1)

    def kernel(self, wave: float) -> np.ndarray:
        """Return the influence of an element on others, by their offsets (2n, 2m)."""
        x, y = np.meshgrid(
            *(
                np.fft.fftfreq(2 * n, 1 / (2 * n)) * step
                for n, step in zip(self.counts, self.steps, strict=True)
            ),
            indexing="ij",
        )
        ends = [(x + a, y + b, a * b) for a in self._half(0) for b in self._half(1)]
        scale = 4 / np.prod(self.steps)
        still = sum(-np.hypot(u, v) / (u * v) * s * scale for u, v, s in ends)
        near = sum(
            (u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v))) * s * scale
            for u, v, s in ends
        )
        r = np.hypot(x, y)
        r[0, 0] = 1.0
        rest = np.exp(1j * wave * r) * (1 - 1j * wave * r) - 1 - (wave * r) ** 2 / 2
        rest /= r**3
        rest[0, 0] = 1j * wave**3 / 3
        area = np.prod(self.steps)
        return (still + wave**2 / 2 * near + rest * area) / (4 * np.pi)

    def _half(self, side: int) -> tuple[float, float]:
        return -self.steps[side] / 2, self.steps[side] / 2

    def mirrored(self, wave: float, pairs: list) -> np.ndarray:
        """Return the pressures that plates send from emitters to listeners."""
        kernel = self.kernel(wave)
        drives = [-self._slope(np.array(one), wave) for one, _ in pairs]
        if np.prod(self.counts) <= DENSE:
            i, j = (np.arange(n) for n in self.counts)
            rows = (i[:, None] - i)[:, None, :, None], (j[:, None] - j)[None, :, None]
            size = len(i) * len(j)
            matrix = kernel[rows].reshape(size, size)
            flat = np.array(drives).reshape(len(drives), size)
            jumps = np.linalg.solve(matrix, flat.T).T
        else:
            jumps = [self._solved(kernel, drive) for drive in drives]
        area = np.prod(self.steps) / (4 * np.pi)
        return np.array(
            [
                np.sum(jump.reshape(self.counts) * self._slope(np.array(end), wave))
                * area
                for jump, (_, end) in zip(jumps, pairs, strict=True)
            ]
        )

    def _slope(self, end: np.ndarray, wave: float) -> np.ndarray:
        """Return the derivative across the plate of a wave from an end."""
        r = np.linalg.norm(self.places - end, axis=-1)
        return (1j * wave - 1 / r) * np.exp(1j * wave * r) / r * -end[2] / r

    def _solved(self, kernel: np.ndarray, drive: np.ndarray) -> np.ndarray:
        operator = Influence(kernel, self.counts)
        jump, failed = gmres(operator, drive.ravel(), rtol=1e-3, restart=200, maxiter=5)
        if failed:
            raise RuntimeError(f"the boundary integral did not settle: {failed}")
        return jump


class Influence(LinearOperator):
    """The influence of all elements on each other, by the fast Fourier transform."""

    def __init__(self, kernel: np.ndarray, counts: tuple[int, int]) -> None:
        super().__init__(dtype=complex, shape=(counts[0] * counts[1],) * 2)
        self.spectrum, self.counts = np.fft.fft2(kernel), counts

    def _matvec(self, x: np.ndarray) -> np.ndarray:
        n, m = self.counts
        padded = np.fft.fft2(x.reshape(n, m), self.spectrum.shape)
        return np.fft.ifft2(self.spectrum * padded)[:n, :m].ravel()


def ends_of(size: tuple, place: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Return emitter and listener of a reflection."""
    angle, turn, before, after, aside = place
    tilt, turn = np.radians(angle), np.radians(turn)
    point = np.array([*(np.array(size) / 2 * aside * [1, 0.5]), 0.0])
    flat = np.sin(tilt) * np.array([np.cos(turn), np.sin(turn), 0.0])
    up = np.array([0.0, 0.0, np.cos(tilt)])
    return point + before * (up - flat), point + after * (up + flat)


def truths(size: tuple, highest: float, places: list) -> np.ndarray:
    """Return the mirrored energy of each place and octave; 1 for an endless plate."""
    pairs = [ends_of(size, place) for place in places]
    whole = np.array([place[2] + place[3] for place in places])
    rows = []
    for octave in OCTAVES[np.less_equal(OCTAVES, highest)]:
        share = (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
        energy = []
        for f in octave * np.sqrt(0.5) * (1 + share):
            plate = PlateElements(size[0], size[1], SPEED / f / ELEMENTS)
            pressure = plate.mirrored(2 * np.pi * f / SPEED, pairs)
            energy.append(np.abs(pressure * whole) ** 2)
        rows.append(np.mean(energy, axis=0))
    return np.array(rows).T


def faces_of(size: tuple, places: list) -> Faces:
    """Return all places as reflections on a plate."""
    points, ways = [], []
    for place in places:
        one, other = ends_of(size, place)
        share = one[2] / (one[2] + other[2])
        points.append((one + share * (other * [1, 1, -1] - one))[:2])
        ways.append((other * [1, 1, -1] - one) / (place[2] + place[3]))
    half, points = np.array(size) / 2, np.array(points)
    before, after = (np.array([place[k] for place in places]) for k in (2, 3))
    ends = np.ones((len(places), 2, 2))
    return Faces(
        np.array(ways),
        before,
        after,
        -half - points,
        half - points,
        2 * ends,
        ends,
        np.inf * ends,
    )


def plate_mesh(size: tuple) -> MeshGeometry:
    """Return a plate around the origin."""
    x, y = np.array(size) / 2
    corners = [[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]]
    return MeshGeometry.from_arrays(corners, [[0, 1, 2], [0, 2, 3]])


def mirrored_and_bent(size: tuple, octaves: np.ndarray, places: list) -> np.ndarray:
    """Return the energy of mirror and bent ways together, summed with their phases."""
    scene = Scene.of_geometry(plate_mesh(size), 0.0)
    scene = replace(scene, bands=np.array([125.0 * 2**k for k in range(7)]))
    rows = []
    for place in places:
        one, other = (end + ASIDE for end in ends_of(size, place))
        ends = Pose.at(*one), Poses.of([Pose.at(*other)])
        sound = Sound(scene, *ends, Budget(16000, 1600, 1))
        for name in ("specular", "diffraction"):
            EFFECTS[name].apply(scene, sound)
        row = []
        for octave in octaves:
            band = int(np.argmin(np.abs(scene.bands - octave)))
            share = (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
            f = octave * np.sqrt(0.5) * (1 + share)
            total = sum(
                np.exp(-2j * np.pi * f[:, None] * part.delay) @ part.gain[:, band]
                for part in sound.arrivals
            )
            row.append(np.mean(np.abs(total * (place[2] + place[3])) ** 2))
        rows.append(row)
    return np.array(rows)


def energy_kept(rays: int) -> float:
    """Return what panels change of the late energy of a lossless hall [dB]."""
    box = MeshGeometry.box((12, 10, 6))
    corners, triangles = [box.vertices + box.origin], [*box.faces.tolist()]
    for x in (3, 6, 9):
        for y in (3, 7):
            plate = plate_mesh((1.2, 1.0))
            count = sum(map(len, corners))
            corners.append(plate.vertices + np.array([x, y, 4.5]))
            triangles += (plate.faces + count).tolist()
    hall = MeshGeometry.from_arrays(np.concatenate(corners), triangles)
    change = finite_panels(hall, OCTAVES[1:], SPEED)
    if change is None:
        raise RuntimeError("reflectors in a hall have rims")
    lost = 1 - change.mean(4.0)
    none = np.zeros_like(lost)
    places = [[2.0, 5.0, 1.5]], [[9.0, 4.0, 1.2], [4.0, 8.0, 2.0], [6.0, 2.0, 3.0]]
    levels = []
    for scattering in (none + 0.1, 0.1 + 0.9 * lost):
        traced = trace_energy(
            hall,
            none,
            scattering,
            *places,
            rays=rays,
            duration=1.0,
            time_step=0.01,
            speed_of_sound=SPEED,
        )
        levels.append(10 * np.log10(traced.energy[..., 50:].sum(axis=3)))
    return float(np.mean(levels[1] - levels[0]))


def compare(size: tuple, highest: float, places: list) -> dict[str, np.ndarray]:
    """Return levels of a plate [dB], (places, octaves), by each model, and its width.

    The width is that of the longer side, times the wavenumber.
    """
    octaves = OCTAVES[np.less_equal(OCTAVES, highest)]
    faces = faces_of(size, places)
    smooth = replace(faces, passage=0 * faces.passage)
    energies = {
        "truth": truths(size, highest, places),
        "panels": mirror_strength(faces, octaves, SPEED),
        "fresnel": mirror_strength(smooth, octaves, SPEED),
        "mirrored and bent": mirrored_and_bent(size, octaves, places),
    }
    levels = {name: 10 * np.log10(values) for name, values in energies.items()}
    width = 2 * np.pi / SPEED * octaves * max(size)
    return levels | {"width": np.broadcast_to(width, energies["truth"].shape)}


def drawn(seed: int) -> list:
    """Return ten places drawn at random, none of which the model was made with."""
    rng = np.random.default_rng(seed)
    return [
        (
            rng.uniform(0, 75),
            rng.choice([0.0, 90.0, rng.uniform(0, 90)]),
            *rng.uniform(2, 10, 2),
            rng.uniform(0, 0.6),
        )
        for _ in range(10)
    ]


def agreement(values: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Return how far levels lie from the truth."""
    off = np.abs(values - truth)
    return {
        "count": len(off),
        "rms_db": round(float(np.sqrt(np.mean(off**2))), 2),
        "most_db": round(float(off.max()), 2),
        "within_1_db": round(float(np.mean(off <= 1)), 3),
    }


def main() -> None:
    """Compare, and write what was found."""
    args = make_parser(__doc__, "finite_panels").parse_args()
    plates = {(1, 1): 504, (2, 1): 252} if args.quick else PLATES
    listed = [compare(size, highest, PLACES) for size, highest in plates.items()]
    highest = 252 if args.quick else 1008
    fresh = [
        compare(size, highest, drawn(seed))
        for seed, size in enumerate(DRAWN[:2] if args.quick else DRAWN, 300)
    ]
    results: dict = {}
    for places, levels in (("listed", listed), ("drawn", fresh)):
        joined = {
            name: np.concatenate([one[name].ravel() for one in levels])
            for name in levels[0]
        }
        truth, width = joined.pop("truth"), joined.pop("width")
        ranges = {
            "all": width > 0,
            "up to 24 wide": width <= 24,
            "beyond": width > 24,
            "above -5 dB": truth > -5,
            "-5 to -20 dB": (truth > -20) & (truth <= -5),
            "below": truth <= -20,
        }
        for name, values in joined.items():
            for title, some in ranges.items():
                if not some.any():
                    continue
                figures = agreement(values[some], truth[some])
                results[f"{name}, {places}, {title}"] = figures
                print(f"{places:7} {name:18} {title:14} {figures}")
    faces = faces_of((2, 1), PLACES)
    back = replace(
        faces, way=faces.way * [-1, -1, 1], before=faces.after, after=faces.before
    )
    there, back = (mirror_strength(part, OCTAVES, SPEED) for part in (faces, back))
    swap = np.linalg.norm(there - back) / np.linalg.norm(there)
    results["swap_db"] = round(float(20 * np.log10(max(swap, 1e-16))), 1)
    start = time.process_time()
    for _ in range(20):
        mirror_strength(faces, OCTAVES, SPEED)
    spent = (time.process_time() - start) / (20 * len(faces))
    results["reflection_us"] = round(1e6 * spent, 1)
    results["energy_db"] = round(energy_kept(400 if args.quick else 20000), 3)
    for name in ("swap_db", "reflection_us", "energy_db"):
        print(name, results[name])
    write_results(args.out, results)


if __name__ == "__main__":
    main()
