"""Measure the path field on clean boxes, without a drawing, at unseen emitters.

A 6 x 4 x 3 m box with six absorptions and a cardioid emitter, rendered by this
project and by pyroomacoustics (another pulse, a latency of 40 samples, a 10 Hz
high-pass, absorption of energy); five emitters, and one. Then the hard cases, and
boxes of drawn sizes and walls excited from one or three emitters at drawn places: how
many have all six walls within 5 mm, and how many of the others say so. CPU seconds of
one thread, second run of two.

Bar: at unseen emitters -40 dB, C50 0.02 dB and the pattern to 0.01 in 2 CPU seconds.
"""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from inverse.acoustics import Acoustics
from inverse.find import room_in_rows
from inverse.paths.shoebox import FittedRoom
from inverse.rows.fitset import FitSet
from inverse.search import SearchSettings
from path_rooms import fit_rows, level_errors, simulated
from rir import GainPattern, Poses
from rooms import Scene

SIZE = np.array([6.0, 4.0, 3.0])
ABSORPTION = np.array([0.2, 0.3, 0.25, 0.35, 0.5, 0.3])
RATE, DURATION = 16000, 0.1


def drawn(emitters: int, listeners: int, seed: int) -> tuple[np.ndarray, ...]:
    """Return emitters (E, 3), their yaws and listeners (E, L, 3) drawn at random."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.5, SIZE - 0.5, (emitters, 3))
    yaws = rng.uniform(0, 2 * np.pi, emitters)
    return places, yaws, rng.uniform(0.4, SIZE - 0.4, (emitters, listeners, 3))


def our_responses(
    emitters: np.ndarray, yaws: np.ndarray, listeners: np.ndarray
) -> np.ndarray:
    """Return this project's responses."""
    absorption = np.tile(ABSORPTION[:, None], (1, 7))
    gain = GainPattern.cardioid()
    scene = Scene.shoebox(SIZE, absorption=absorption, emitter_gain=gain)
    return simulated(scene, emitters, yaws, listeners, rate=RATE, duration=DURATION)


def peer_responses(
    emitters: np.ndarray, yaws: np.ndarray, listeners: np.ndarray
) -> np.ndarray:
    """Return pyroomacoustics' responses."""
    import pyroomacoustics as pra
    from pyroomacoustics.directivities import CardioidFamily, DirectionVector

    names = ("west", "east", "south", "north", "floor", "ceiling")
    made: Any = np.zeros((*listeners.shape[:2], round(RATE * DURATION)))
    for place, yaw, mine, out in zip(emitters, yaws, listeners, made, strict=True):
        walls: Any = {
            name: pra.Material(value)
            for name, value in zip(names, ABSORPTION, strict=True)
        }
        room = pra.ShoeBox(SIZE.tolist(), fs=RATE, materials=walls, max_order=17)
        ahead = DirectionVector(azimuth=yaw, colatitude=np.pi / 2, degrees=False)
        pattern = CardioidFamily(orientation=ahead, p=0.5, gain=1.0)
        room.add_source(place, directivity=pattern)
        room.add_microphone(mine.T)
        room.compute_rir()
        for row, found in zip(out, room.rir or [], strict=True):
            kept = np.asarray(found[0])[: len(row)]
            row[: len(kept)] = kept
    return made.reshape(-1, made.shape[2])


def rows_of(maker: Any, emitters: int, listeners: int, seed: int) -> FitSet:
    """Return a set as the path field takes it."""
    places, yaws, ends = drawn(emitters, listeners, seed)
    first, yaw = places.repeat(listeners, axis=0), yaws.repeat(listeners)
    sound = maker(places, yaws, ends)
    return fit_rows(sound, first, ends.reshape(-1, 3), RATE, yaw=yaw)


def measured(train: FitSet, test: FitSet) -> dict[str, Any]:
    """Fit twice, time the second, and score unseen emitters."""
    room_in_rows(train)
    start = time.process_time()
    heard = room_in_rows(train)
    seconds = time.process_time() - start
    told = heard.predict(test.emitters, test.listeners, test.n_samples)
    errors = level_errors(test.responses, told)
    return {
        "cpu_s": seconds,
        "nmse_db": float(np.median(errors)),
        "worst_nmse_db": float(errors.max()),
        "c50_db": float(np.abs(_clarity(told) - _clarity(test.responses)).mean()),
        "pattern": _pattern_error(heard),
        "wall_mm": _wall_error(heard),
        "alarms": heard.alarms,
    }


def _clarity(responses: np.ndarray) -> np.ndarray:
    early = round(0.05 * RATE)
    power = responses**2
    return 10 * np.log10(power[:, :early].sum(1) / power[:, early:].sum(1))


def _pattern_error(heard: Acoustics) -> float:
    angles = np.linspace(0, np.pi, 37)
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    found = heard.emitter_gain().gain(ring)[:, 0] / 2
    return float(np.abs(found - 0.5 - 0.5 * np.cos(angles)).max())


def _wall_error(heard: Acoustics) -> float:
    if not isinstance(heard.fitted, FittedRoom):
        return float("nan")
    planes = heard.fitted.room.box.planes
    true = np.array([0, -SIZE[0], 0, -SIZE[1], 0, -SIZE[2]])
    return float(1000 * np.abs(planes[:, 3] - true).max())


def drawn_box(
    emitters: int, listeners: int, cardioid: bool, seed: int
) -> tuple[FitSet, np.ndarray]:
    """Return rows of a box of drawn size and walls, and its size."""
    rng = np.random.default_rng(seed)
    size = rng.uniform([3.0, 2.8, 2.3], [9.0, 6.0, 4.0])
    absorption = rng.uniform(0.1, 0.5, 6)
    places = rng.uniform(0.5, size - 0.5, (emitters, 3))
    yaws = 2 * rng.uniform(0, np.pi, emitters)
    ends = rng.uniform(0.4, size - 0.4, (emitters, listeners, 3))
    gain = GainPattern.cardioid() if cardioid else GainPattern.omni()
    scene = Scene.shoebox(
        size, absorption=np.tile(absorption[:, None], (1, 7)), emitter_gain=gain
    )
    sound = simulated(scene, places, yaws, ends, rate=RATE, duration=DURATION)
    first, yaw = places.repeat(listeners, axis=0), yaws.repeat(listeners)
    rows = fit_rows(sound, first, ends.reshape(-1, 3), RATE, yaw=yaw)
    return _changed(rows, places=np.arange(emitters).repeat(listeners)), size


def few_emitters(draws: int, first_seed: int) -> dict[str, dict[str, Any]]:
    """Return how many drawn boxes are found from few emitters, and in what time."""
    told = {}
    cases = [(1, n, aimed) for n in (8, 30, 60, 120) for aimed in (True, False)]
    for emitters, listeners, cardioid in [*cases, (3, 30, True)]:
        right = honest = 0
        seconds = []
        for seed in range(first_seed, first_seed + draws):
            rows, size = drawn_box(emitters, listeners, cardioid, seed)
            start = time.process_time()
            heard = room_in_rows(rows, SearchSettings(late=False))
            seconds.append(time.process_time() - start)
            found = _walls_within(heard, size, 0.005)
            right += found
            honest += found or bool(heard.alarms)
        name = f"{emitters} {'cardioid' if cardioid else 'omni'} x {listeners}"
        told[name] = {
            "draws": draws,
            "right": right,
            "right_or_alarm": honest,
            "cpu_s": float(np.median(seconds)),
            "worst_cpu_s": float(np.max(seconds)),
        }
    return told


def _walls_within(heard: Acoustics, size: np.ndarray, limit: float) -> bool:
    if not isinstance(heard.fitted, FittedRoom) or heard.fitted.n_walls < 6:
        return False
    true = np.stack([np.zeros(3), -size], axis=1).ravel()
    return bool(np.abs(heard.fitted.room.box.planes[:, 3] - true).max() < limit)


def hard_cases(train: FitSet, test: FitSet) -> dict[str, dict[str, Any]]:
    """Return what is answered to spoiled data."""
    rng = np.random.default_rng(4)
    told = {}
    swapped = rng.permutation(len(train))[: max(2, len(train) // 100)]
    wrong = train.responses.copy()
    wrong[swapped] = np.roll(wrong[swapped], 1, axis=0)
    moved = Poses(
        train.listeners.positions + 0.03 * rng.standard_normal((len(train), 3)),
        train.listeners.orientations,
    )
    near = np.abs(train.listeners.positions[:, 2] - 1.5) < 0.25
    cases = {
        "1 % swapped labels": _changed(train, responses=wrong),
        "3 cm position errors": _changed(train, listeners=moved),
        "1 emitter, 8 listeners": train.rows(np.flatnonzero(train.places == 0)[:8]),
        "a thin layer of listeners": train.rows(np.flatnonzero(near)),
        "noise only": _changed(
            train, responses=rng.standard_normal(train.responses.shape)
        ),
    }
    for name, rows in cases.items():
        heard = room_in_rows(rows)
        answer = heard.predict(test.emitters, test.listeners, test.n_samples)
        walls = 0 if heard.fitted is None else heard.fitted.n_walls
        error = float(np.median(level_errors(test.responses, answer)))
        told[name] = {"walls": walls, "nmse_db": error, "alarms": heard.alarms}
    return told


def _changed(rows: FitSet, **values: Any) -> FitSet:
    from dataclasses import replace

    return replace(rows, **values)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns 0."""
    parser = make_parser(__doc__, "path_shoebox", "fewer listeners")
    parser.add_argument("--draws", type=int, default=12, help="boxes a case")
    parser.add_argument("--first-seed", type=int, default=1000)
    options = parser.parse_args(argv)
    listeners = 24 if options.quick else 60
    results: dict[str, Any] = {}
    makers: dict[str, Any] = {"rooms": our_responses}
    if not options.quick:
        makers["pyroomacoustics"] = peer_responses
    train = test = None
    for name, maker in makers.items():
        test = rows_of(maker, 3, 20, 1)
        for emitters, count in ((5, listeners), (1, 2 * listeners)):
            rows = rows_of(maker, emitters, count, 0)
            train = train or rows
            label = f"{name}, {emitters} emitter{'s' * (emitters > 1)}"
            results[label] = found = measured(rows, test)
            print(
                f"{label:28} {found['cpu_s']:5.2f} CPU-s  NMSE {found['nmse_db']:6.1f} "
                f"(worst {found['worst_nmse_db']:6.1f}) dB  "
                f"C50 {found['c50_db']:.4f} dB"
                f"  pattern {found['pattern']:.4f}  walls {found['wall_mm']:.3f} mm"
            )
            for alarm in found["alarms"]:
                print(f"    {alarm}")
    if not options.quick and train is not None:
        ours = rows_of(our_responses, 3, 20, 1)
        results["hard cases"] = told = hard_cases(train, ours)
        for name, case in told.items():
            print(f"{name:28} {case['walls']} walls  NMSE {case['nmse_db']:6.1f} dB")
            for alarm in case["alarms"]:
                print(f"    {alarm}")
    if not options.quick:
        results["few emitters"] = few = few_emitters(options.draws, options.first_seed)
        for name, case in few.items():
            print(
                f"{name:28} all six walls {case['right']} of {case['draws']}, or an "
                f"alarm {case['right_or_alarm']}; {case['cpu_s']:.1f} "
                f"(worst {case['worst_cpu_s']:.1f}) CPU-s"
            )
    write_results(options.out, results)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
