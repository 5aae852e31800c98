"""Measure how well late energy behind a door follows from few emitters.

The truth is a Monte Carlo of particles in two rooms joined by a door: 16 emitters,
36 listener columns of 1 m, 20 ms bins. Models learn noisy bins of some emitters and
are asked for the others. SIMULATED.

Bar: 1 dB rms; the sign of the fast slope right in 85 % of the pairs across the door.
"""

import sys
import time
from collections.abc import Sequence

import numpy as np

from harness import make_parser, write_results
from inverse.late.features import PlaceFeatures
from inverse.late.late_maps import LateMaps, chi_square_bias, fit_maps
from inverse.late.slopes import common_rates, region_curves
from inverse.rows.regions import Regions, find_regions
from path_rooms import BoxRegions

ROOMS = np.array([[[0.0, 0, 0], [5, 4, 2.6]], [[5.0, 0, 0], [9, 4, 2.6]]])
DOOR = (1.55, 2.45, 2.05)
ABSORPTION = (0.08, 0.35)
SCATTERING = 0.3
BIN_S, FIRST_BIN, LAST_BIN = 0.02, 3, 40
BANDWIDTH = 707.0
COLUMNS = 9, 4
NOISE_DB = 1.7
WRONG_SIGHT = 0.03


def trace(emitters: np.ndarray, rays: int, seed: int) -> np.ndarray:
    """Return energy densities, shape (emitters, 36, bins)."""
    from numba import njit

    @njit(cache=False)
    def run(origin, rays, seed, absorption, scattering, bins, bin_s):
        np.random.seed(seed)  # noqa: NPY002
        out = np.zeros((36, bins))
        c, step = 343.0, 0.3
        for _ in range(rays):
            x, y, z = origin
            room = 0 if x < 5.0 else 1
            w = 2.0 * np.random.random() - 1.0  # noqa: NPY002
            turn = 2 * np.pi * np.random.random()  # noqa: NPY002
            s = np.sqrt(1 - w * w)
            u, v = s * np.cos(turn), s * np.sin(turn)
            energy, length = 1.0, step * np.random.random()  # noqa: NPY002
            path = 0.0
            while path < c * bins * bin_s:
                low, high = (0.0, 5.0) if room == 0 else (5.0, 9.0)
                tx = ((high if u > 0 else low) - x) / u if u != 0 else 1e9
                ty = ((4.0 if v > 0 else 0.0) - y) / v if v != 0 else 1e9
                tz = ((2.6 if w > 0 else 0.0) - z) / w if w != 0 else 1e9
                t = min(tx, ty, tz)
                while length <= t:
                    k = int((path + length) / (c * bin_s))
                    if k >= bins:
                        break
                    i = min(max(int(x + u * length), 0), 8)
                    j = min(max(int(y + v * length), 0), 3)
                    out[i * 4 + j, k] += energy
                    length += step
                length -= t
                path += t
                x, y, z = x + u * t, y + v * t, z + w * t
                if tx <= ty and tx <= tz:
                    wall = 0
                elif ty <= tz:
                    wall = 1
                else:
                    wall = 2
                if wall == 0 and abs(x - 5.0) < 1e-6 and 1.55 < y < 2.45 and z < 2.05:
                    room = 1 - room
                    continue
                energy *= 1 - absorption[room]
                if np.random.random() < scattering:  # noqa: NPY002
                    up = np.sqrt(np.random.random())  # noqa: NPY002
                    turn = 2 * np.pi * np.random.random()  # noqa: NPY002
                    s = np.sqrt(1 - up * up)
                    a, b = s * np.cos(turn), s * np.sin(turn)
                    if wall == 0:
                        u, v, w = (-up if u > 0 else up), a, b
                    elif wall == 1:
                        u, v, w = a, (-up if v > 0 else up), b
                    else:
                        u, v, w = a, b, (-up if w > 0 else up)
                elif wall == 0:
                    u = -u
                elif wall == 1:
                    v = -v
                else:
                    w = -w
        return out / rays

    absorption = np.array(ABSORPTION)
    settings = absorption, SCATTERING, LAST_BIN + 1, BIN_S
    traced = [
        run(place, rays, seed + k, *settings)  # pyright: ignore[reportCallIssue]
        for k, place in enumerate(emitters)
    ]
    return np.stack(traced)


def places(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return 9 emitters in the hard room and 7 in the soft one, and the columns."""
    low, high = ROOMS[:, 0] + 0.4, ROOMS[:, 1] - 0.4
    hard = rng.uniform(low[0], high[0], (9, 3))
    soft = rng.uniform(low[1], high[1], (7, 3))
    x, y = np.meshgrid(np.arange(9) + 0.5, np.arange(4) + 0.5, indexing="ij")
    columns = np.stack([x.ravel(), y.ravel(), np.full(36, 1.3)], axis=1)
    return np.vstack([hard, soft]), columns


def sees(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return whether each pair sees each other, through the door or in one room."""
    rooms = (first[:, 0] > 5).astype(int), (second[:, 0] > 5).astype(int)
    gap = second - first
    part = np.divide(5 - first[:, 0], gap[:, 0], where=gap[:, 0] != 0, out=gap[:, 0])
    y = first[:, 1] + part * gap[:, 1]
    z = first[:, 2] + part * gap[:, 2]
    door = (y > DOOR[0]) & (y < DOOR[1]) & (z < DOOR[2])
    return (rooms[0] == rooms[1]) | door


class Truth:
    """Hold the Monte Carlo and deal noisy bins of it."""

    def __init__(self, rays: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.emitters, self.columns = places(rng)
        whole = trace(self.emitters, rays, seed)
        # a fade-in is largest while it lasts: its sign is told from 20 ms on
        self.risen = whole[:, :, 1:]
        self.risen_times = (np.arange(1, LAST_BIN + 1) + 0.5) * BIN_S
        self.energy = whole[:, :, FIRST_BIN:]
        self.times = (np.arange(FIRST_BIN, LAST_BIN + 1) + 0.5) * BIN_S
        emitters, listeners, energies = self.rows(np.arange(len(self.emitters)))
        rooms = (emitters[:, 0] > 5).astype(int), (listeners[:, 0] > 5).astype(int)
        self.rates = common_rates(region_curves(energies, *rooms), self.times)

    def rows(self, which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return emitters, listeners and energies of all pairs of emitters."""
        emitters = np.repeat(self.emitters[which], len(self.columns), axis=0)
        listeners = np.tile(self.columns, (len(which), 1))
        return emitters, listeners, self.energy[which].reshape(len(emitters), -1)


def noisy(energies: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return energies as one response's bins would tell them."""
    half = 1 / (np.log(10) / 10 * NOISE_DB) ** 2
    return energies * rng.gamma(half, 1 / half, energies.shape)


def regions_of(kind: str, truth: Truth, chosen: np.ndarray, seed: int) -> Regions:
    """Return exact regions, blind ones, one, or 5 % wrong."""
    if kind == "exact":
        return BoxRegions.of(ROOMS)
    if kind == "none":
        return Regions.one()
    rng = np.random.default_rng(seed)
    emitters, listeners, _ = truth.rows(chosen)
    if kind == "wrong":
        known = np.vstack([truth.emitters, truth.columns])
        flags = (known[:, 0] > 5).astype(int)
        wrong = rng.permutation(len(known))[: max(1, round(0.05 * len(known)))]
        flags[wrong] = 1 - flags[wrong]
        return Regions(known, np.eye(2)[flags])
    bits = sees(emitters, listeners).astype(float)
    flip = rng.random(len(bits)) < WRONG_SIGHT
    return find_regions(emitters, listeners, np.where(flip, 1 - bits, bits))


def learn(
    truth: Truth, chosen: np.ndarray, regions: Regions, seed: int, slopes: int = 2
) -> tuple[LateMaps, PlaceFeatures, float]:
    """Return maps learned from noisy bins of some emitters, and CPU seconds."""
    rng = np.random.default_rng(1000 + seed)
    emitters, listeners, energies = truth.rows(chosen)
    data = noisy(energies, rng)
    started = time.process_time()
    features = PlaceFeatures.of(np.vstack([emitters, listeners]), regions)
    numbers = regions.numbers(emitters), regions.numbers(listeners)
    held = len(np.unique(numbers[0]))
    curves = region_curves(data, *numbers)
    rates = common_rates(curves, truth.times, most=min(slopes, held))
    half = 1 / (np.log(10) / 10 * NOISE_DB) ** 2
    bias = chi_square_bias(half / BIN_S, BIN_S)
    ends = features(emitters), features(listeners)
    maps = fit_maps(np.log(data) - bias, truth.times, *ends, rates, flags=regions.count)
    return maps, features, time.process_time() - started


def errors(
    predicted: np.ndarray, energies: np.ndarray, across: np.ndarray
) -> dict[str, float]:
    """Return bins, level and cross-room rms errors, dB."""
    bins = 10 / np.log(10) * (predicted - np.log(energies))
    level = 10 * np.log10(np.exp(predicted).sum(axis=1) / energies.sum(axis=1))
    return {
        "bins": float(np.sqrt((bins**2).mean())),
        "level": float(np.sqrt((level**2).mean())),
        "cross": float(np.sqrt((bins[across] ** 2).mean())),
    }


def fade_in_right(
    maps: LateMaps, ends: tuple, energies: np.ndarray, times: np.ndarray, rates
) -> tuple[float, float]:
    """Return the share of pairs whose fast amplitude has the sign of the truth's.

    The second is the same among the pairs whose sign the truth tells, that is to two
    standard deviations of its own chance.
    """
    if len(maps.rates) < 2:
        return float("nan"), float("nan")
    waves = np.exp(-np.outer(rates, times)).T
    scaled = waves[None] / energies[..., None]
    inverse = np.linalg.inv(np.einsum("ntk,ntl->nkl", scaled, scaled))
    both = (inverse @ scaled.sum(axis=1)[..., None])[..., 0]
    gap = 1 - np.einsum("ntk,nk->nt", scaled, both)
    chance = (gap**2).sum(axis=1) / (len(times) - 2) * inverse[:, 1, 1]
    true, sure = both[:, 1], np.abs(both[:, 1]) > 2 * np.sqrt(chance)
    told = ((ends[0] @ maps.shares.T) * (ends[1] @ maps.shares.T))[:, 0]
    right = np.sign(told) == np.sign(true)
    return float(right.mean()), float(right[sure].mean())


def asymmetric(truth: Truth, chosen: np.ndarray, test: np.ndarray) -> np.ndarray:
    """Return the perfect listener map of the nearest chosen emitter."""
    gap = truth.emitters[test][:, None] - truth.emitters[chosen]
    nearest = chosen[np.linalg.norm(gap, axis=-1).argmin(axis=1)]
    return np.log(truth.energy[nearest].reshape(len(test) * 36, -1))


CASES = {
    "5 emitters": np.array([0, 1, 2, 9, 10]),
    "2 emitters": np.array([0, 9]),
    "none in the soft room": np.array([0, 1]),
}


def run(rays: int, draws: int) -> dict[str, dict[str, float]]:
    """Return the errors of each case, mean over draws."""
    rows: dict[str, list[dict[str, float]]] = {}
    for draw in range(draws):
        truth = Truth(rays, 50 * draw)
        for case, chosen in CASES.items():
            test = np.setdiff1d(np.arange(16), chosen)
            emitters, listeners, energies = truth.rows(test)
            across = (emitters[:, 0] > 5) != (listeners[:, 0] > 5)
            plain = asymmetric(truth, chosen, test)
            found = errors(plain, energies, across)
            rows.setdefault(f"{case}, nearest perfect map", []).append(found)
            for kind in ("exact", "blind", "wrong", "none"):
                regions = regions_of(kind, truth, chosen, draw)
                maps, features, spent = learn(truth, chosen, regions, draw)
                ends = features(emitters), features(listeners)
                told = maps.log_energies(*ends, truth.times)
                found = errors(told, energies, across)
                found["fade"], found["sure"] = fade_in_right(
                    maps,
                    tuple(one[across] for one in ends),
                    truth.risen[test].reshape(len(across), -1)[across],
                    truth.risen_times,
                    truth.rates,
                )
                back = maps.log_energies(ends[1], ends[0], truth.times)
                found["swap"] = float(np.abs(back - told).max())
                found["seconds"] = spent
                found["slopes"] = float(len(maps.rates))
                rows.setdefault(f"{case}, {kind} regions", []).append(found)
    return {name: _mean(many) for name, many in rows.items()}


def _mean(many: list[dict[str, float]]) -> dict[str, float]:
    return {key: float(np.mean([one[key] for one in many])) for key in many[0]}


def main(argv: Sequence[str]) -> int:
    """Print the errors and write them."""
    parser = make_parser(__doc__, "path_late")
    options = parser.parse_args(argv)
    found = run(1500 if options.quick else 40_000, 1 if options.quick else 4)
    print("SIMULATED; errors at unseen emitters, dB rms")
    print(f"{'':44}  bins level cross  fade in right (sure)  swap    CPU s")
    for name, row in found.items():
        print(
            f"{name:44} {row['bins']:5.2f} {row['level']:5.2f} {row['cross']:5.2f}"
            f"  {row.get('fade', np.nan):6.2f} {row.get('sure', np.nan):6.2f}"
            f"  {row.get('swap', np.nan):.0e}"
            f" {row.get('seconds', np.nan):6.2f} {row.get('slopes', np.nan):.1f}"
        )
    write_results(options.out, {"simulated": True, "rows": found})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
