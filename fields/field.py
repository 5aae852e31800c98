"""What every field can do, and how a stored one is opened."""

from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from fields.frame import SceneFrame
from fields.table import FIELDS
from rir import GainPattern, Pose, Poses
from rir.errors import MissingPartError, ResoundingError, TrainingError


@runtime_checkable
class Field(Protocol):
    """Answer the impulse response between any two poses."""

    name: str
    frame: SceneFrame

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32."""
        ...

    def save(self, path: str | Path) -> Path:
        """Write the field to a file that :func:`load_field` opens."""
        ...


@runtime_checkable
class Directional(Protocol):
    """A field whose listener pattern can be exchanged and emitter read out."""

    def predict(
        self,
        emitters: Poses,
        listeners: Poses,
        *,
        listener_gain: GainPattern | None = None,
    ) -> np.ndarray:
        """Return responses heard through ``listener_gain``."""
        ...

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern as the field has learned it."""
        ...


@runtime_checkable
class Reported(Protocol):
    """A field that keeps what its fit or training was like."""

    report: dict[str, Any]


@runtime_checkable
class Alarmed(Protocol):
    """A field that judges itself."""

    alarms: list[str]
    "what of the room it cannot explain, in words"


@runtime_checkable
class Drawn(Protocol):
    """A field that can draw more than maps, such as the walls it found."""

    def draw(self, folder: Path) -> list[Path]:
        """Write pictures into a folder and return their paths."""
        ...


def report_of(field: Field) -> dict[str, Any]:
    """Return the report of a field, empty where it keeps none."""
    return field.report if isinstance(field, Reported) else {}


FIELD_FILES = ("field.pt", "field.npz")
FARTHEST_M = 1e5
"""Farthest place answered: float32 still resolves a centimetre there."""


def load_field(path: str | Path) -> Field:
    """Open a stored field.

    Parameters
    ----------
    path : str or Path
        A file written by ``field.save`` or a run folder of ``train-field``.

    Raises
    ------
    TrainingError
        If there is no field at ``path``, or the file holds something else.
    MissingPartError
        If the field is neural and torch is not installed.
    """
    if not isinstance(path, str | Path):
        raise TrainingError(
            f"a field is opened from the path of a file or run folder, not from "
            f"{type(path).__name__}"
        )
    file = _field_file(Path(path))
    try:
        name = _model_name(file)
    except (MissingPartError, MemoryError):
        raise
    # Unpicklers answer a wrong file with errors of every kind.
    except Exception as error:
        # Torch follows its reason by advice, of which some would run foreign code.
        reason = str(error).partition(". ")[0].partition("\n")[0]
        raise TrainingError(
            f"{file} is no stored field ({type(error).__name__}: {reason})"
        ) from error
    module = FIELDS[name].load_module()
    try:
        return module.load(file)
    except (ResoundingError, MemoryError):
        raise
    # Spoiled files end in errors of every kind, and so do models of other packages.
    except Exception as error:
        raise TrainingError(
            f"{file} cannot be opened as a field {name!r} "
            f"({type(error).__name__}: {error})"
        ) from error


def _field_file(path: Path) -> Path:
    if path.is_file():
        return path
    for name in FIELD_FILES:
        if (path / name).is_file():
            return path / name
    raise TrainingError(
        f"no field at {path}: expected a file or a run folder holding "
        f"{' or '.join(FIELD_FILES)}; train one with train-field"
    )


def _model_name(file: Path) -> str:
    if file.suffix == ".npz":
        with np.load(file, allow_pickle=False) as stored:
            return str(stored["model"])
    from rir.optional import require

    torch = require("torch", why=f"{file.name}")
    return torch.load(file, map_location="cpu", weights_only=True)["model"]


def paired_queries(
    emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
) -> tuple[Poses, Poses]:
    """Bring both ends of a query to the same length.

    One pose on a side is repeated for every pose of the other.

    Raises
    ------
    TrainingError
        If both sides hold several poses and their numbers differ, or a place is
        farther off than any room reaches.
    SignalError
        If a side holds no poses, but text, NaN or another shape.
    """
    ends = Poses.of(emitters), Poses.of(listeners)
    for name, end in zip(("emitter", "listener"), ends, strict=True):
        _check_near(name, end)
    sizes = len(ends[0]), len(ends[1])
    if sizes[0] != sizes[1] and (1 not in sizes or 0 in sizes):
        raise TrainingError(
            f"{sizes[0]} emitters against {sizes[1]} listeners: give as many of "
            "one as of the other, or a single pose on one side"
        )
    first, second = (_repeated(end, max(sizes)) for end in ends)
    return first, second


def _check_near(name: str, poses: Poses) -> None:
    farthest = np.abs(poses.positions).max(initial=0.0)
    if farthest > FARTHEST_M:
        raise TrainingError(
            f"{name} at {farthest:g} m: fields answer within {FARTHEST_M:g} m of "
            "the origin"
        )


def _repeated(poses: Poses, count: int) -> Poses:
    return poses if len(poses) == count else poses[np.zeros(count, dtype=int)]
