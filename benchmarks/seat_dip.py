"""Measure the seat dip against rows of backs on a grid of the wave equation.

A pulse passes over rigid thin seat backs on a rigid floor, in two dimensions; air
between them is slowed down as by upholstery, free air may pass below. Levels are those
of the first 50 ms over free sound, in octaves, at several distances and heights; the
model has the same drag. Excess over free sound is the same for lines and points. Then a
hall whose floor alone reflects is simulated, audience and all, against the published
range.

Bar: over nine rows or more, 1 to 12 degrees above them, octaves from 125 to 500 Hz
within 3 dB of the grid on the mean and 6 dB at most, the dip within a third of an
octave; higher up within 3 dB; a simulated hall loses 10 to 20 dB at 125 Hz, at most
4 dB above 15 degrees.
"""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness import make_parser, write_results
from rir.arrays import FloatArray
from rir.physics import decibels
from rir.seats import SeatRows
from rooms import Scene, simulate
from rooms.seating import Troughs, acting_depth, over_rows

C = 343.0
OCTAVES = (125.0, 250.0, 500.0)
THIRDS = 1000 * 2.0 ** (np.arange(-12, -3) / 3)
STEP = 0.05  # m: fourteen cells to the wavelength at 500 Hz
COURANT = 0.7  # just below 1 / sqrt(2), the limit of the scheme
PULSE = 0.00045  # s: a band from 50 to 700 Hz
SOURCE = 1.5  # m above the tops
MARGIN = 10.0  # m: no echo of the edge of the grid within 50 ms


Powers = tuple[Any, FloatArray, FloatArray]


@dataclass(frozen=True)
class Rows:
    """Seats on the grid."""

    back_m: float
    under_m: float
    drag: float
    row_m: float = 0.9


CASES = (
    Rows(0.8, 0.3, 200.0),
    Rows(0.8, 0.0, 400.0),
    Rows(1.0, 0.3, 200.0),
    Rows(0.6, 0.15, 800.0),
)


def march(rows: Rows | None, places: FloatArray, top: float, until: float) -> Any:
    """Return the pressure at places over time, and the step; free air if no rows.

    Places are distances and heights over the tops [m]; the source stands at 0.
    """
    low = top if rows else 20.0 + top
    wide = int((2 * MARGIN + places[:, 0].max()) / STEP)
    high = int((low + 20.0) / STEP)
    p = np.zeros((wide, high), dtype=np.float32)
    along, up = np.zeros((wide + 1, high), p.dtype), np.zeros((wide, high + 1), p.dtype)
    dt = COURANT * STEP / C

    def cell(x: float, z: float) -> tuple[int, int]:
        return round((x + MARGIN) / STEP), round((z + low) / STEP - 0.5)

    backs = []
    if rows:
        count = int((places[:, 0].max() + MARGIN - 2) / rows.row_m)
        backs = [cell(1.0 + n * rows.row_m, 0.0)[0] for n in range(count)]
    bottom = round((rows.under_m if rows else 0) / STEP)
    seat = slice(bottom, round(top / STEP) if rows else bottom)
    kept = np.float32(np.exp(-(rows.drag if rows else 0.0) * dt))
    at, ears = cell(0.0, SOURCE), [cell(*place) for place in places]
    t = np.arange(int(until / dt)) * dt / PULSE - 4
    heard = np.zeros((len(ears), len(t)))
    for n, drive in enumerate(-t * np.exp(-(t**2) / 2)):
        along[1:-1] -= np.float32(COURANT) * (p[1:] - p[:-1])
        up[:, 1:-1] -= np.float32(COURANT) * (p[:, 1:] - p[:, :-1])
        along[:, seat] *= kept
        up[:, seat] *= kept
        along[backs, seat] = 0
        p -= np.float32(COURANT) * (along[1:] - along[:-1] + up[:, 1:] - up[:, :-1])
        p[at] += drive
        heard[:, n] = [p[ear] for ear in ears]
    return heard, dt


def grid_power(rows: Rows, places: FloatArray) -> Powers:
    """Return frequencies, and power over rows and in free air, per place."""
    way = np.hypot(places[:, 0], places[:, 1] - SOURCE) / C
    powers = []
    for some, gate in ((rows, 0.05), (None, 0.02)):
        heard, dt = march(some, places, rows.back_m, way.max() + 0.06)
        since = np.arange(heard.shape[1]) * dt - way[:, None] - 4 * PULSE
        fade = np.sin(np.pi / 2 * np.clip((gate - since) / 0.01, 0, 1)) ** 2
        powers.append(np.abs(np.fft.rfft(heard * fade, 8192)) ** 2)
    return np.fft.rfftfreq(8192, COURANT * STEP / C), powers[0], powers[1]


def in_bands(power: Powers, bands: Any, width: float) -> FloatArray:
    """Return levels over free sound per place and band [dB]."""
    f, on, off = power
    some = [(f > b / width) & (f < b * width) for b in bands]
    return decibels(np.array([on[:, k].sum(1) / off[:, k].sum(1) for k in some])).T


def model_levels(
    rows: Rows, places: FloatArray, bands: Any, width: float
) -> FloatArray:
    f = np.array([np.linspace(b / width, b * width, 24) for b in bands])
    depth = acting_depth(rows.back_m, rows.under_m)
    troughs = Troughs(depth, (1.0,), (rows.drag,), C)
    ends = np.full(len(places), SOURCE), places[:, 1]
    image = over_rows(troughs, f.ravel(), ends, places[:, 0])
    return decibels(np.mean(np.abs(1 + image).reshape(-1, *f.shape) ** 2, axis=2))


def compare(rows: Rows, runs: Sequence[float]) -> dict[str, Any]:
    """Return grid and model in octaves, and where their dips lie."""
    places = np.array([(run, height) for run in runs for height in (0.4, 4.0)])
    octave, third = 2**0.5, 2 ** (1 / 6)
    power = grid_power(rows, places)
    truth = in_bands(power, OCTAVES, octave)
    ours = model_levels(rows, places, OCTAVES, octave)
    low = places[:, 1] < 1
    thirds = in_bands(power, THIRDS, third), model_levels(rows, places, THIRDS, third)
    # at the farthest place, where it is deepest
    dips = [float(THIRDS[np.argmin(levels[low][-1])]) for levels in thirds]
    return {
        "rows": asdict(rows),
        "places": places.tolist(),
        "grid_db": truth.tolist(),
        "model_db": ours.tolist(),
        "grazing_db": np.abs(ours - truth)[low].tolist(),
        "above_db": np.abs(ours - truth)[~low].tolist(),
        "dips_hz": dips,
    }


def hall() -> dict[str, Any]:
    """Return what a simulated floor of audience does to sound, octaves from 125 Hz."""
    share = [0.39, 0.57, 0.80, 0.94, 0.92, 0.87, 0.85]
    scene = Scene.shoebox(
        (40, 30, 20),
        absorption={"all": 1.0, "floor": share},
        scattering={"all": 0.0, "floor": 0.6},
        seats=(None,) * 4 + (SeatRows(), None),
    )
    listeners = [[d, 15, 1.2] for d in (12, 16, 20, 25)] + [
        [11, 15, 6.0],
        [14, 15, 9.0],
    ]
    f = np.fft.rfftfreq(8192, 1 / 8000)
    power = []
    for effects in (("scattering", "seats", "direct", "specular"), ("direct",)):
        made = simulate(
            scene, [3, 15, 2.3], listeners,
            sample_rate=8000, duration=0.2, effects=effects,
        )  # fmt: skip
        power.append(np.abs(np.fft.rfft(made.responses[0], 8192)) ** 2)
    octaves = [(f > b / 2**0.5) & (f < b * 2**0.5) for b in (*OCTAVES, 1000.0)]
    on, off = (np.array([p[:, k].sum(axis=1) for k in octaves]).T for p in power)
    return {"listeners": listeners, "excess_db": decibels(on / off).tolist()}


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "seat_dip", "one case, one distance")
    options = parser.parse_args(argv)
    start = time.process_time()
    cases = CASES[:1] if options.quick else CASES
    rows = [compare(case, (9.0,) if options.quick else (9.0, 16.0)) for case in cases]
    for row in rows:
        low, high = np.array(row["grazing_db"]), np.array(row["above_db"])
        print(
            f"{row['rows']}: grazing {low.mean():.1f} dB on the mean,"
            f" {low.max():.1f} at most; above {high.max():.1f} dB;"
            f" dips at {row['dips_hz'][0]:.0f} (grid) and {row['dips_hz'][1]:.0f} Hz"
        )
    made = hall()
    for place, excess in zip(made["listeners"], made["excess_db"], strict=True):
        print(f"hall, {place}:", " ".join(f"{level:6.1f}" for level in excess), "dB")
    print(f"{time.process_time() - start:.1f} CPU s")
    write_results(options.out, {"grid": rows, "hall": made})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
