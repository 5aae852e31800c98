"""Measure direct and reflected sound over a wall against the exact field over a plane.

Bar: every octave from 250 Hz to 4 kHz within 0.5 dB of the exact image integral, 1 m
from a locally reacting wall at 0 to 80 degrees; exchange of the ends below -120 dB.

The truth for locally reacting walls is the integral over images at complex heights, for
layers of extended reaction Sommerfeld's integral over plane waves, both by quadrature,
with admittances computed here from Miki's law. A box whose other walls reflect nothing
is simulated and looked at over frequency.
"""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0

from harness import make_parser, write_results
from rir.walls import WallModel, read_wall
from rooms import Scene, simulate

SPEED = 343.2  # m/s
RATE = 16000  # Hz
SIZE = (30.0, 30.0, 15.0)  # m: room for 80 degrees
OCTAVES = (250.0, 500.0, 1000.0, 2000.0, 4000.0)
LINES = 48  # frequencies an octave; 24 move levels by 0.02 dB
DEGREES = (0, 15, 30, 45, 60, 70, 75, 80)
HEIGHTS = ((1.0, 1.0), (2.0, 1.0), (1.4, 1.0))  # m: emitter, listener
ON = ["direct", "specular", "walls"]

Truth = Callable[[float, NDArray, NDArray], NDArray]


def porous(depth: float, resistivity: float, gap: float = 0.0) -> Truth:
    """Return the admittance of a porous layer at frequency, cosine and sine."""

    def admittance(f: float, cosine: NDArray, sine: NDArray) -> NDArray:
        del cosine
        x, k = f / resistivity, 2 * np.pi * f / SPEED
        impedance = 1 + 0.070 * x**-0.632 - 0.107j * x**-0.632
        wave = 1 + 0.109 * x**-0.618 - 0.160j * x**-0.618
        behind = np.zeros_like(sine, complex)
        if gap:
            straight = np.sqrt(1 - sine**2 + 0j)
            behind = 1j * straight * np.tan(k * straight * gap)
        across = np.sqrt(wave**2 - sine**2)
        own = across / (wave * impedance)
        turn = 1j * np.tan(k * across * depth)
        return own * (behind + own * turn) / (own + behind * turn)

    return admittance


def constant(beta: complex) -> Truth:
    """Return an admittance that is the same everywhere."""
    return lambda _, __, sine: np.full(np.shape(sine), beta)


def nodes(end: float, panels: int) -> tuple[NDArray, NDArray]:
    """Return nodes and weights of a rule over 0 to `end`."""
    x, w = np.polynomial.legendre.leggauss(24)
    step = end / panels
    places = (np.arange(panels)[:, None] + (x + 1) / 2) * step
    return places.ravel(), np.tile(w * step / 2, panels)


def complex_images(beta: complex, f: float, across: float, height: float) -> complex:
    """Return what a locally reacting plane sends back.

    X. Di, K. Gilbert, JASA 93, 714 (1993); there time goes as e^(-iωt).
    """
    k, beta = 2 * np.pi * f / SPEED, np.conj(beta)
    far = np.hypot(across, height)
    q, w = nodes(40 / (k * (beta.real + height / far)), 60)
    way = np.sqrt(across**2 + (height + 1j * q) ** 2)
    image = np.exp(1j * k * far) / far
    line = np.sum(w * np.exp(-k * beta * q + 1j * k * way) / way)
    return complex(np.conj(image - 2 * k * beta * line))


def plane_waves(truth: Truth, f: float, across: float, height: float) -> complex:
    """Return what a plane of any reaction sends back (A. Sommerfeld, 1909)."""
    k = 2 * np.pi * f / SPEED

    def part(w: NDArray, cosine: NDArray, sine: NDArray) -> complex:
        beta = truth(f, cosine, sine)
        kept = (cosine - beta) / (cosine + beta)
        waves = sine * j0(k * across * sine) * np.exp(-1j * k * height * cosine)
        return complex(np.sum(w * k * waves * kept))

    panels = 8 + int(k * (across + height) / 12)
    t, w = nodes(np.pi / 2, panels)
    near = -1j * part(w, np.cos(t), np.sin(t))
    end = float(np.arcsinh(40 / (k * height)))
    u, w = nodes(end, 8 + int(k * across * np.cosh(end) / 12))
    return near + part(w, -1j * np.sinh(u), np.cosh(u))


def walls() -> dict[str, tuple[WallModel, Truth, bool]]:
    """Return walls with the admittance they should have, and whether they are local."""

    def layers(depth: float, resistivity: float, gap: float, local: bool) -> WallModel:
        wool = {"thickness_m": depth, "flow_resistivity_pa_s_m2": resistivity}
        air = [{"air_gap": {"thickness_m": gap}}] if gap else []
        settings = {"layers": [{"porous": wool}, *air], "locally_reacting": local}
        return read_wall("layers", settings)

    def straight(truth: Truth) -> Truth:
        return lambda f, cosine, sine: truth(f, cosine + 0 * sine, 0 * sine)

    found: dict[str, tuple[WallModel, Truth, bool]] = {}
    for beta in (0.02, 0.1, 0.3, 0.638, 1.0):
        found[f"admittance {beta:g}"] = (
            read_wall("admittance", {"conductance": beta}),
            constant(beta),
            True,
        )
    for r, x in ((2.0, -3.0), (4.0, -8.0), (1.0, 1.5)):
        wall = read_wall("impedance", {"resistance": r, "reactance": x})
        found[f"impedance {r:g}{x:+g}j"] = (wall, constant(1 / (r + 1j * x)), True)
    for depth, resistivity, gap in (
        (0.05, 1e4, 0.0),
        (0.1, 2e4, 0.0),
        (0.025, 4e4, 0.05),
    ):
        truth = porous(depth, resistivity, gap)
        name = f"porous {1000 * depth:g} mm, gap {1000 * gap:g} mm"
        local = layers(depth, resistivity, gap, True)
        found[f"{name}, local"] = (local, straight(truth), True)
        found[f"{name}, extended"] = (
            layers(depth, resistivity, gap, False),
            truth,
            False,
        )
    return found


def ends(degrees: float, heights: tuple[float, float]) -> tuple[list, list, float]:
    """Return emitter, listener, and how far apart they are along the wall [m]."""
    across = sum(heights) * np.tan(np.radians(degrees))
    # places that coincide have no direct sound to compare with
    across = max(float(across), 0.3) if heights[0] == heights[1] else float(across)
    middle = SIZE[0] / 2
    one = [middle - across / 2, middle, heights[0]]
    return one, [middle + across / 2, middle, heights[1]], across


def compare(
    wall: WallModel, truth: Truth, local: bool, places: list[tuple]
) -> tuple[NDArray, NDArray]:
    """Return errors of levels [dB], (places, octaves) and (places, thirds)."""
    scene = Scene.shoebox(SIZE, absorption=1.0, walls={"floor": wall})
    f = np.concatenate(
        [c * np.sqrt(0.5) * (1 + (np.arange(LINES) + 0.5) / LINES) for c in OCTAVES]
    )
    third = np.floor(3 * np.log2(f / (OCTAVES[0] / np.sqrt(2)))).astype(int)
    rows, fine = [], []
    for degrees, heights in places:
        one, other, across = ends(degrees, heights)
        made = simulate(
            scene, one, other, sample_rate=RATE, duration=0.15, effects=ON
        ).responses[0, 0]
        heard = np.exp(-2j * np.pi * np.outer(f, np.arange(len(made))) / RATE) @ made
        straight = np.hypot(across, heights[0] - heights[1])
        exact = np.exp(-2j * np.pi * f * straight / SPEED) / straight
        height = sum(heights)
        for k, line in enumerate(f):
            if local:
                beta = complex(truth(line, np.ones(1), np.zeros(1))[0])
                exact[k] += complex_images(beta, line, across, height)
            else:
                exact[k] += plane_waves(truth, line, across, height)
        power = np.abs(heard) ** 2, np.abs(exact) ** 2
        sums = [part.reshape(len(OCTAVES), -1).sum(axis=1) for part in power]
        rows.append(10 * np.log10(sums[0] / sums[1]))
        sums = [np.bincount(third, part) for part in power]
        fine.append(10 * np.log10(sums[0] / sums[1]))
    return np.array(rows), np.array(fine)


def swapped(wall: WallModel) -> float:
    """Return how far responses of exchanged ends differ [dB]."""
    scene = Scene.shoebox((5, 4, 3), walls={"all": wall})
    there, back = (
        simulate(scene, *places, sample_rate=RATE, duration=0.2, effects=ON).responses
        for places in (([1, 1, 1.2], [4, 2, 1.7]), ([4, 2, 1.7], [1, 1, 1.2]))
    )
    off = np.linalg.norm(there - back) / np.linalg.norm(there)
    return float(20 * np.log10(max(off, 1e-16)))


def cost(wall: WallModel) -> tuple[float, float]:
    """Return CPU seconds of 0.5 s in a box with such walls, and with plain ones."""
    angled = Scene.shoebox((6, 5, 3), walls={"all": wall})
    spent = []
    for on in (ON, ON[:2]):
        best = np.inf
        for _ in range(3):
            start = time.process_time()
            simulate(
                angled, [1.7, 3.1, 1.4], [4, 1, 2], sample_rate=RATE, duration=0.5,
                effects=on,
            )  # fmt: skip
            best = min(best, time.process_time() - start)
        spent.append(best)
    return spent[0], spent[1]


def main() -> None:
    """Compare, and write what was found."""
    args = make_parser(__doc__, "locally_reacting_wall").parse_args()
    tried = walls()
    places = [(d, h) for h in HEIGHTS for d in DEGREES]
    if args.quick:
        kept = ("admittance 0.1", "impedance 2-3j", "porous 50 mm, gap 0 mm, local")
        tried = {name: tried[name] for name in kept}
        places = [(d, HEIGHTS[2]) for d in (0, 60, 80)]
    results: dict = {}
    for name, wall in tried.items():
        octaves, thirds = compare(*wall, places)
        results[name] = {
            "octaves_most_db": round(float(np.abs(octaves).max()), 3),
            "thirds_most_db": round(float(np.abs(thirds).max()), 3),
            "rms_db": round(float(np.sqrt(np.mean(octaves**2))), 3),
        }
        print(f"{name:40} {results[name]}", flush=True)
    last = next(reversed(tried.values()))[0]
    results["swap_db"] = round(swapped(last), 1)
    angled, plain = cost(last)
    results["cpu_ms"] = {
        "by angle": round(1e3 * angled, 1),
        "plain": round(1e3 * plain, 1),
    }
    for name in ("swap_db", "cpu_ms"):
        print(name, results[name])
    write_results(args.out, results)


if __name__ == "__main__":
    main()
