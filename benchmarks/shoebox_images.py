"""Measure speed and error of shoebox images against pyroomacoustics.

One emitter and 100 listeners in a 6 x 5 x 3 m box with absorption 0.2 at 16 kHz;
CPU milliseconds per pair, best of several interleaved runs in one process.

Bar: 8 times pyroomacoustics at order 17, 14 times at order 30, 10 times with seven
bands and air; 3 ms a pair; an error below -90 dB in the band.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir import Poses
from rir.physics import speed_of_sound
from rooms import Scene, simulate

SIZE, RATE, DURATION = (6.0, 5.0, 3.0), 16000, 0.5
EMITTER = np.array([1.7, 3.1, 1.4])
BANDED = [0.10, 0.12, 0.15, 0.20, 0.22, 0.25, 0.30]


def our_run(listeners: np.ndarray, order: int | None, banded: bool, threads: int = 1):
    scene = Scene.shoebox(SIZE, absorption=BANDED if banded else 0.2)
    effects = ["direct", "specular", *(["air"] if banded else [])]
    return simulate(
        scene,
        EMITTER,
        Poses(listeners),
        sample_rate=RATE,
        duration=DURATION,
        max_order=order,
        effects=effects,
        threads=threads,
    ).responses[0]


def peer_run(listeners: np.ndarray, order: int, banded: bool) -> list[np.ndarray]:
    import pyroomacoustics as pra

    pra.constants.set("num_threads", 1)
    pra.constants.set("rir_hpf_enable", False)
    bands = [125, 250, 500, 1000, 2000, 4000, 8000]
    material: Any = (
        pra.Material({"coeffs": BANDED, "center_freqs": bands})
        if banded
        else pra.Material(0.2)
    )
    room = pra.ShoeBox(
        list(SIZE), fs=RATE, materials=material, max_order=order, air_absorption=banded
    )
    room.set_sound_speed(speed_of_sound(20.0))
    room.add_source(EMITTER.tolist())
    room.add_microphone_array(listeners.T)
    room.compute_rir()
    return [np.asarray(response[0]) for response in room.rir or []]


def cpu_ms(run: Callable[[], Any]) -> float:
    start = time.process_time()
    run()
    return 1000 * (time.process_time() - start)


def in_band_error(order: int) -> tuple[float, float]:
    """Return our and the peer's error against the exact sum, 50 Hz to 6.4 kHz [dB]."""
    listener = np.array([[4.1, 1.3, 1.9]])
    ours = our_run(listener, order, banded=False)[0]
    theirs = peer_run(listener, order, banded=False)[0]
    f = np.arange(50, 6400, 13.0)
    exact = exact_spectrum(listener[0], order, f)
    n = np.arange(len(ours))
    mine = np.exp(-2j * np.pi * f[:, None] * n / RATE) @ ours
    n = np.arange(len(theirs)) - 40
    other = np.exp(-2j * np.pi * f[:, None] * n / RATE) @ theirs
    size = np.linalg.norm(exact)
    ours_db = 20 * np.log10(np.linalg.norm(mine - exact) / size)
    peer_db = 20 * np.log10(np.linalg.norm(other - exact) / size)
    return float(ours_db), float(peer_db)


def exact_spectrum(listener: np.ndarray, order: int, f: np.ndarray) -> np.ndarray:
    """Sum the images one by one in the frequency domain."""
    index = np.arange(-order, order + 1)
    axes = [
        np.where(index % 2 == 0, index * L + s, (index + 1) * L - s) - m
        for L, s, m in zip(SIZE, EMITTER, listener, strict=True)
    ]
    i, j, k = np.meshgrid(index, index, index, indexing="ij")
    count = abs(i) + abs(j) + abs(k)
    inside = count <= order
    d = np.sqrt(
        axes[0][:, None, None] ** 2
        + axes[1][None, :, None] ** 2
        + axes[2][None, None, :] ** 2
    )[inside]
    gain = np.sqrt(0.8) ** count[inside] / d
    delay = d / speed_of_sound(20.0)
    # images beyond the response cannot be in it
    gain, delay = gain[delay < DURATION], delay[delay < DURATION]
    return np.array([gain @ np.exp(-2j * np.pi * frequency * delay) for frequency in f])


def compare(
    listeners: np.ndarray, order: int, banded: bool, rounds: int
) -> dict[str, Any]:
    our_run(listeners[:1], order, banded)
    peer_run(listeners[:1], order, banded)
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(cpu_ms(lambda: our_run(listeners, order, banded)))
        theirs.append(cpu_ms(lambda: peer_run(listeners, order, banded)))
    return {
        "case": f"order {order}" + (", 7 bands and air" if banded else ""),
        "ours_ms": min(ours) / len(listeners),
        "peer_ms": min(theirs) / len(listeners),
        "ratio": min(theirs) / min(ours),
    }


def shown(row: dict[str, Any]) -> str:
    ours = f"{row['case']:28s} ours {row['ours_ms']:8.3f} ms"
    if "ratio" not in row:
        return ours
    return f"{ours}  peer {row['peer_ms']:8.3f} ms  x{row['ratio']:.1f}"


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "shoebox_images", "fewer pairs and runs")
    options = parser.parse_args(argv)
    count, rounds = (10, 1) if options.quick else (100, 5)
    rng = np.random.default_rng(0)
    listeners = rng.uniform(0.3, np.array(SIZE) - 0.3, (count, 3))
    cases = (
        [(17, False), (17, True)]
        if options.quick
        else [
            (3, False),
            (10, False),
            (17, False),
            (30, False),
            (17, True),
            (30, True),
        ]
    )
    rows = [compare(listeners, order, banded, rounds) for order, banded in cases]
    our_run(listeners[:1], None, banded=False)
    complete = [
        cpu_ms(lambda: our_run(listeners, None, banded=False)) / count
        for _ in range(rounds)
    ]
    rows.append({"case": "complete 0.5 s", "ours_ms": min(complete)})
    error = in_band_error(5 if options.quick else 17)
    for row in rows:
        print(shown(row))
    print(f"in-band error: ours {error[0]:.1f} dB, peer {error[1]:.1f} dB")
    report = {"rows": rows, "error_db": {"ours": error[0], "peer": error[1]}}
    write_results(options.out, report)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
