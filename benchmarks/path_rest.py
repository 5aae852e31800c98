"""Ask what the path field is worth where no paths explain the room.

A room of scattering spheres without a plane (SIMULATED here) and, where the data is
at hand, an office heard by a line array from nine places (MEASURED): errors of the path
field beside the INRAS-style network with exchange, linear and nearest, at emitter
places left out, and the largest of its ratios to the best of them.

Bar: below nearest, linear and the network in every metric.
"""

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fields.data import FieldData, prepare
from fields.evaluate import METRIC_UNITS, score
from fields.plan import TrainingPlan
from fields.run import train_on
from harness import make_parser, write_results
from plane_waves import PlaneWaves
from rir import Dataset

RATE, SPEED, SAMPLES = 16000, 343.2, 1600
SPHERES = 45
OFFICE = Path("polimi_ula/derived_polimi_16k_0.4s.npz")
SPLITS = ((1, 4, 7), (0, 3, 6), (2, 5, 8))
HEIGHT_M = 1.5


def spheres(emitters: int, listeners: int, held_out: int) -> tuple[FieldData, ...]:
    """Return training and test rows of a room whose walls are spheres."""
    rng = np.random.default_rng(4)
    around = rng.standard_normal((SPHERES, 3))
    around *= (3.2 / np.linalg.norm(around, axis=1))[:, None]
    sizes = 0.35 * rng.uniform(0.6, 1.4, SPHERES)
    places = rng.uniform(-1.6, 1.6, (emitters + held_out, 3))
    ears = rng.uniform(-1.6, 1.6, (listeners, 3))
    responses = np.empty((len(places), listeners, SAMPLES))
    late = _late_modes(rng)
    for k, place in enumerate(places):
        for m, ear in enumerate(ears):
            responses[k, m] = _scattered(place, ear, around, sizes) + late(place, ear)
    data = prepare(Dataset.from_arrays(responses, places, ears, sample_rate=RATE))
    split = emitters * listeners
    count = len(places) * listeners
    return data.rows(np.arange(split)), data.rows(np.arange(split, count))


def _scattered(
    place: np.ndarray, ear: np.ndarray, around: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    """Return the direct sound and echoes of one and of two spheres."""
    there = np.linalg.norm(around - place, axis=1)
    back = np.linalg.norm(around - ear, axis=1)
    between = np.linalg.norm(around[:, None] - around, axis=2)
    twice = there[:, None] + between + back
    apart = between > 0
    pair = sizes[:, None] * sizes / np.maximum(there[:, None] * between * back, 1e-9)
    direct = float(np.linalg.norm(place - ear))
    lengths = np.concatenate([[direct], there + back, twice[apart]])
    levels = np.concatenate([[1 / direct], sizes / (there * back), pair[apart]])
    out = np.zeros(SAMPLES + 2)
    at = lengths / SPEED * RATE
    low = np.floor(at).astype(int)
    kept = low < SAMPLES
    part = at - low
    np.add.at(out, low[kept], (levels * (1 - part))[kept])
    np.add.at(out, low[kept] + 1, (levels * part)[kept])
    return out[:SAMPLES]


def _late_modes(rng: np.random.Generator):
    """Return late sound that obeys reciprocity: plane waves with twins."""
    tail = PlaneWaves(int(rng.integers(1000)), np.zeros(3), RATE / SPEED, SAMPLES)
    times = np.arange(SAMPLES) / RATE
    shape = 0.05 * np.exp(-40 * times) * np.minimum(times / 0.02, 1)

    def late(place: np.ndarray, ear: np.ndarray) -> np.ndarray:
        return shape * tail(place[None], ear[None])[0]

    return late


def office(test: Sequence[int]) -> tuple[FieldData, ...] | None:
    """Return training and test rows of the measured office, None without data."""
    path = Path(os.environ.get("RESOUNDING_DATA", "../shared/data")) / OFFICE
    if not path.exists():
        return None
    with np.load(path) as stored:
        responses = stored["rir"] * float(stored["scale"])
        ends = [
            np.column_stack([stored[name], np.full(len(stored[name]), HEIGHT_M)])
            for name in ("src_xy_m", "mic_xy_m")
        ]
        rate = int(stored["fs"])
    held = Dataset.from_arrays(responses, *ends, sample_rate=rate, simulated=False)
    owner = np.arange(len(held)) // responses.shape[1]
    unheard = np.isin(owner, test)
    train = np.flatnonzero(~unheard)
    data = prepare(held, train_rows=train, duration=0.1)
    return data.rows(train), data.rows(np.flatnonzero(unheard))


def compared(train: FieldData, test: FieldData, budget_s: float) -> dict:
    """Return scores and CPU seconds of each field."""
    network = TrainingPlan(
        steps=10**7, budget_s=budget_s, exchange="double", batch_size=32
    )
    found: dict = {}
    for name, plan in (
        ("nearest", TrainingPlan()),
        ("linear", TrainingPlan()),
        ("inras", network),
        ("path", TrainingPlan()),
    ):
        started = time.process_time()
        config = {"network_steps": 20} if name == "path" and budget_s < 5 else {}
        field = train_on(train, name, config, plan)
        seconds = time.process_time() - started
        found[name] = {**score(field, test), "CPU s": seconds}
        if name == "path":
            found["words"] = list(getattr(field, "alarms", []))
    peers = ("nearest", "linear", "inras")
    found["path over the best of them"] = {
        metric: found["path"][metric] / min(found[one][metric] for one in peers)
        for metric in METRIC_UNITS
    }
    ratios = {
        metric: found["path"][metric] / found["inras"][metric]
        for metric in METRIC_UNITS
    }
    found["path over inras"] = ratios
    return found


def main(argv: Sequence[str]) -> int:
    """Print the tables and write them."""
    parser = make_parser(__doc__, "path_rest")
    parser.add_argument("--budget", type=float, default=15.0)
    options = parser.parse_args(argv)
    budget = 1.0 if options.quick else options.budget
    sizes = (4, 12, 2) if options.quick else (6, 80, 4)
    sets = {"spheres, SIMULATED": spheres(*sizes)}
    for test in () if options.quick else SPLITS:
        heard = office(test)
        if heard is not None:
            sets[f"office without {test}, MEASURED"] = heard
    tables = {}
    for name, (train, test) in sets.items():
        tables[name] = table = compared(train, test, budget)
        print(name)
        for row, values in table.items():
            if row == "words":
                print(f"  {'; '.join(values)}")
                continue
            told = "  ".join(f"{key} {value:8.3f}" for key, value in values.items())
            print(f"  {row:28} {told}")
    write_results(options.out, tables)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
