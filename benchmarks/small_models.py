"""Train thousands of tiny random fields on hard data and count what is not finite.

Each draw takes a model of random size and form, and data of a random hard kind: ends
at one place, listeners on a wall, silence, a response of all zeros among others,
amplitudes of 1e-12 and 1e6, NaN in the file, one sample, one emitter, duplicate poses,
20 ms and 1 s, float16. A draw passes when two training steps have finite losses and
gradients (none skipped, none mended) and the predictions are finite, or, for NaN, when
the answer is one clear error. ``--first K --draws 1`` repeats draw K.

Bar: none of 10,000 draws fails.
"""

import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fields import FIELDS
from fields.data import prepare
from fields.plan import CHOICES, TrainingPlan
from fields.run import train_on
from harness import make_parser, write_results
from rir import Dataset, DatasetWriter, Poses
from rir.errors import DatasetError, SignalError

RATE = 8000
SIZES: dict[str, dict[str, list[Any]]] = {
    "nearest": {},
    "linear": {"neighbours": [1, 3, 8]},
    "naf": {
        "octaves": [0, 2, 8],
        "relative": [True, False],
        "grid": [True, False],
        "grid_features": [1, 3],
        "grid_spacing": [3.0, 9.0],
        "width": [1, 4, 8],
        "depth": [2, 3],
        "pixels": [0, 5],
        "oriented": [True, False],
        "jitter_m": [0.0, 0.1],
        "griffin_lim_steps": [0, 1],
    },
    "av-nerf": {
        "octaves": [1, 4],
        "relative": [True, False],
        "view_rows": [1, 2],
        "view_columns": [1, 3],
        "both_views": [True, False],
        "width": [1, 8],
        "depth": [1, 2],
    },
    "avr": {
        "rays": [1, 2, 5],
        "shells": [1, 2, 4],
        "far": [0.0, 0.01, 3.0],
        "proposals": [0, 1, 2],
        "density": ["grid", "network"],
        "head": ["bank", "shell"],
        "width": [1, 8],
        "feature_width": [1, 4],
        "channels": [1, 3],
        "octaves": [0, 2, 8],
        "hash_levels": [0, 2],
        "emission": ["local", "absolute"],
        "direct": [True, False],
    },
    "diffrir": {
        "order": [0, 1],
        "axial_order": [0, 1],
        "directions": [1, 8],
        "source_taps": [1, 7, 1023],
    },
    "inras": {
        "bounce_points": [1, 3],
        "distance_octaves": [0, 2],
        "octaves": [1, 8],
        "width": [1, 8],
        "depth": [1, 2],
        "relative": [True, False],
        "tied": [True, False],
        "aligned": [True, False],
        "oriented": [True, False],
    },
}
SIZES["naf-invariant"] = SIZES["naf"]
DIRECTIONAL = ("avr", "diffrir")
LENGTHS = {1: 1, 2: 1, 17: 1, 80: 2, 160: 6, 320: 3, 8000: 1}


@dataclass
class Rows:
    """Responses and both ends, as hard kinds change them."""

    responses: np.ndarray
    emitters: np.ndarray
    listeners: np.ndarray


Kind = Callable[[Rows, np.random.Generator], None]
KINDS: dict[str, Kind] = {}


def hard(name: str) -> Callable[[Kind], Kind]:
    """List a kind of hard data under its name."""

    def add(kind: Kind) -> Kind:
        KINDS[name] = kind
        return kind

    return add


@hard("plain")
def _plain(rows: Rows, _rng: np.random.Generator) -> None:
    """Leave the rows as they are."""


@hard("ends at one place")
def _coincident(rows: Rows, rng: np.random.Generator) -> None:
    some = rng.random(len(rows.emitters)) < 0.7
    rows.listeners[some] = rows.emitters[some]


@hard("on a wall")
def _on_wall(rows: Rows, rng: np.random.Generator) -> None:
    rows.listeners[:, rng.integers(3)] = 0.0
    if rng.random() < 0.3:
        rows.emitters[:, 2] = 0.0


@hard("silence")
def _silence(rows: Rows, _rng: np.random.Generator) -> None:
    rows.responses[:] = 0.0


@hard("one silent")
def _one_silent(rows: Rows, rng: np.random.Generator) -> None:
    rows.responses[rng.integers(len(rows.responses))] = 0.0


@hard("1e-12")
def _quiet(rows: Rows, _rng: np.random.Generator) -> None:
    rows.responses *= 1e-12


@hard("1e6")
def _loud(rows: Rows, _rng: np.random.Generator) -> None:
    rows.responses *= 1e6


@hard("amplitudes far apart")
def _apart(rows: Rows, rng: np.random.Generator) -> None:
    rows.responses *= 10.0 ** rng.uniform(-12, 6, (len(rows.responses), 1))


@hard("NaN in the file")
def _nan(rows: Rows, rng: np.random.Generator) -> None:
    row, sample = (rng.integers(size) for size in rows.responses.shape)
    rows.responses[row, sample] = rng.choice([np.nan, np.inf])


@hard("one emitter")
def _one_emitter(rows: Rows, _rng: np.random.Generator) -> None:
    rows.emitters[:] = rows.emitters[0]


@hard("duplicates")
def _duplicates(rows: Rows, _rng: np.random.Generator) -> None:
    rows.emitters[:] = rows.emitters[0]
    rows.listeners[:] = rows.listeners[0]


@hard("float16")
def _half(rows: Rows, _rng: np.random.Generator) -> None:
    rows.responses = rows.responses.astype(np.float16)


@hard("clicks")
def _clicks(rows: Rows, rng: np.random.Generator) -> None:
    rows.responses[:] = 0.0
    rows.responses[:, rng.integers(rows.responses.shape[1])] = 1.0


@hard("far out")
def _far(rows: Rows, rng: np.random.Generator) -> None:
    rows.emitters += rng.choice([100.0, 1e4])


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "small_models")
    parser.add_argument("--draws", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--model", default="", help="draw this model only")
    options = parser.parse_args(argv)
    draws = 64 if options.quick else options.draws
    _single_thread()
    seconds: Counter[str] = Counter()
    told: Counter[str] = Counter()
    failures = []
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in range(options.first, options.first + draws):
            started = time.process_time()
            draw = Draw.of(number, options.model)
            problem = draw.problem(Path(folder))
            seconds[draw.model] += time.process_time() - started  # type: ignore[assignment]
            told[draw.model] += 1
            if problem:
                failures.append({"draw": number, **draw.as_dict(), "problem": problem})
                print(f"draw {number}: {draw.describe()}: {problem}", flush=True)
    print(f"{'model':14s} {'draws':>6s} {'ms/draw':>8s} {'failed':>7s}")
    failed = Counter(one["model"] for one in failures)
    for model in sorted(told):
        spent = 1e3 * seconds[model] / told[model]
        print(f"{model:14s} {told[model]:6d} {spent:8.1f} {failed[model]:7d}")
    print(f"{draws} draws, {len(failures)} failed")
    content = {"draws": draws, "first": options.first, "failures": failures}
    write_results(options.out, content)
    return int(bool(failures))


@dataclass(frozen=True)
class Draw:
    """One random model and data set."""

    number: int
    model: str
    config: dict[str, Any]
    kinds: tuple[str, ...]
    count: int
    length: int
    plan: dict[str, Any]

    @classmethod
    def of(cls, number: int, model: str = "") -> "Draw":
        """Return the draw of a number."""
        rng = np.random.default_rng([7, number])
        model = model or str(rng.choice(list(FIELDS)))
        sizes = SIZES.get(model, {})
        config = {
            name: values[rng.integers(len(values))] for name, values in sizes.items()
        }
        kinds = rng.choice(list(KINDS), size=rng.integers(1, 4), replace=False)
        # As it is done last, float16 sees what the other kinds made.
        kinds = tuple(sorted(map(str, kinds), key=lambda kind: kind == "float16"))
        weights = np.array(list(LENGTHS.values()), dtype=float)
        length = int(rng.choice(list(LENGTHS), p=weights / weights.sum()))
        plan = {
            "steps": 2,
            "batch_size": int(rng.integers(1, 5)),
            "exchange": str(rng.choice(["none", "flip", "double"])),
            "exchange_mode": str(rng.choice(["pose", "position"])),
            "precision": str(rng.choice(["float32", "float32", "bfloat16"])),
            "seed": number,
        }
        if model in DIRECTIONAL:
            plan["self_supervised"] = str(rng.choice(CHOICES["self_supervised"]))
        return cls(number, model, config, kinds, int(rng.integers(1, 6)), length, plan)

    def describe(self) -> str:
        """Return the draw in a line."""
        given = f"{self.model} {self.config} {self.plan}"
        return f"{given}, {self.kinds}, {self.count} x {self.length}"

    def as_dict(self) -> dict[str, Any]:
        """Return the draw as plain values."""
        return dict(vars(self))

    def problem(self, folder: Path) -> str:
        """Train and ask; returns what went wrong, or nothing."""
        rng = np.random.default_rng([8, self.number])
        rows = self._rows(rng)
        bad = not np.isfinite(rows.responses).all()
        try:
            with np.errstate(all="ignore"):
                return self._answer(self._dataset(rows, rng, folder), rows, bad)
        except (SignalError, DatasetError) as error:
            clear = bad and "NaN" in str(error)
            return "" if clear else f"{type(error).__name__}: {error}"
        except Exception as error:  # every other one is what is counted here
            return f"{type(error).__name__}: {error}"

    def _rows(self, rng: np.random.Generator) -> Rows:
        decay = np.exp(-np.arange(self.length) / max(self.length / 5, 1))
        responses = rng.standard_normal((self.count, self.length)) * decay
        rows = Rows(responses, *rng.uniform(0.0, 6.0, (2, self.count, 3)))
        for kind in self.kinds:
            with np.errstate(over="ignore"):
                KINDS[kind](rows, rng)
        return rows

    def _dataset(self, rows: Rows, rng: np.random.Generator, folder: Path) -> Dataset:
        turns = rng.standard_normal((2, self.count, 4))
        turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
        ends = Poses(rows.emitters, turns[0]), Poses(rows.listeners, turns[1])
        if "NaN in the file" not in self.kinds or rng.random() < 0.5:
            return Dataset.from_arrays(rows.responses, *ends, sample_rate=RATE)
        path = folder / f"{self.number}.h5"
        with DatasetWriter(
            path, sample_rate=RATE, n_samples=self.length, simulated=True
        ) as out:
            out.append(rows.responses, *ends)
        return Dataset.open(path)

    def _answer(self, dataset: Dataset, rows: Rows, bad: bool) -> str:
        data = prepare(dataset, seed=self.number)
        field: Any = train_on(data, self.model, self.config, TrainingPlan(**self.plan))
        if bad:
            return "NaN in the data was not refused"
        heard = field.predict(dataset.emitters, dataset.listeners)
        if heard.shape != rows.responses.shape:
            return f"predictions have shape {heard.shape}"
        if not np.isfinite(heard).all():
            return "predictions are not finite"
        report = getattr(field, "report", {})
        harmed = {
            key: report[key]
            for key in ("skipped_steps", "mended_steps")
            if report.get(key)
        }
        if harmed:
            return f"not finite in training: {harmed}"
        losses = [point[2] for point in report.get("history", [])]
        return "" if np.isfinite(losses).all() else f"losses {losses}"


def _single_thread() -> None:
    try:
        import torch
    except ImportError:
        sys.exit("the neural fields need torch; nothing to draw")
    torch.set_num_threads(1)


if __name__ == "__main__":
    raise SystemExit(main())
