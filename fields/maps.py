"""Maps of a trained field: loudness and phase over a plane, and its reciprocity."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fields.evaluate import Scores, compare_rows
from fields.field import Drawn, Field
from rir import Pose, Poses

__all__ = ["FieldMap", "check_reciprocity", "draw_more", "make_map", "plot_map"]

MAP_ROWS = 256
"""Places asked for in one go: bounds memory, not the map."""


@dataclass(frozen=True, eq=False)
class FieldMap:
    """Hold what listeners on a horizontal grid would hear of one emitter.

    Parameters
    ----------
    x, y : numpy.ndarray
        Grid lines, shapes (columns,) and (rows,), metres.
    loudness_db : numpy.ndarray
        Energy of each response re the loudest place, shape (rows, columns), dB.
    phase : numpy.ndarray
        Phase at ``frequency``, shape (rows, columns), radians.
    frequency : float
        Hertz.
    emitter : Pose
        The emitter.
    height : float
        Height of the listeners, metres.
    mark : str
        SIMULATED or MEASURED: what the field was trained on.
    """

    x: np.ndarray
    y: np.ndarray
    loudness_db: np.ndarray
    phase: np.ndarray
    frequency: float
    emitter: Pose
    height: float
    mark: str

    def save(self, path: Path) -> None:
        """Write the arrays as one archive."""
        np.savez(
            path,
            x=self.x,
            y=self.y,
            loudness_db=self.loudness_db,
            phase=self.phase,
            frequency=self.frequency,
            emitter=self.emitter.position,
            height=self.height,
            mark=self.mark,
        )


def make_map(
    field: Field,
    emitter: Pose,
    *,
    spacing: float = 0.2,
    height: float | None = None,
    frequency: float = 500.0,
) -> FieldMap:
    """Ask a field for a whole plane of listeners.

    Parameters
    ----------
    field : Field
        Any trained field.
    emitter : Pose
        Where the sound comes from.
    spacing : float
        Distance of the listeners, metres.
    height : float, optional
        Their height; the middle of the trained listeners' box by default.
    frequency : float
        Of the phase map, hertz.
    """
    frame = field.frame
    level = float(frame.center[2]) if height is None else height
    x, y = (
        np.arange(frame.low[axis], frame.high[axis] + 0.5 * spacing, spacing)
        for axis in range(2)
    )
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    listeners = np.column_stack([places, np.full(len(places), level)])
    energy, tone = np.empty(len(places)), np.empty(len(places), dtype=complex)
    turns = np.arange(frame.n_samples) * frequency / frame.sample_rate
    wave = np.exp(-2j * np.pi * turns)
    for start in range(0, len(places), MAP_ROWS):
        part = slice(start, start + MAP_ROWS)
        heard = field.predict(emitter, listeners[part]).astype(np.float64)
        energy[part], tone[part] = (heard**2).sum(axis=1), heard @ wave
    shape = (len(y), len(x))
    loudest = max(float(energy.max()), np.finfo(float).tiny)
    loudness = 10 * np.log10(np.maximum(energy / loudest, 1e-12))
    return FieldMap(
        x,
        y,
        loudness.reshape(shape),
        np.angle(tone).reshape(shape),
        frequency,
        emitter,
        level,
        frame.mark,
    )


def plot_map(path: Path, shown: FieldMap, title: str) -> None:
    """Draw loudness and phase side by side as a PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.4), layout="constrained")
    figure.suptitle(f"{title} [{shown.mark}]")
    panels = (
        ("loudness, dB re loudest", shown.loudness_db, "magma"),
        (f"phase at {shown.frequency:g} Hz, rad", shown.phase, "twilight"),
    )
    for axes, (label, values, colours) in zip(
        figure.subplots(1, 2), panels, strict=True
    ):
        image = axes.pcolormesh(shown.x, shown.y, values, cmap=colours)
        figure.colorbar(image, ax=axes, label=label)
        axes.plot(*shown.emitter.position[:2], "wo", markeredgecolor="black")
        axes.set_aspect("equal")
        axes.set_xlabel("x, m")
        axes.set_ylabel("y, m")
    figure.savefig(path, dpi=110)


def draw_more(field: Field, folder: Path) -> list[Path]:
    """Let a field draw what only it knows, such as the walls it found."""
    return field.draw(folder) if isinstance(field, Drawn) else []


def check_reciprocity(
    field: Field, *, pairs: int = 64, rng: np.random.Generator
) -> Scores:
    """Compare a field's answers to random queries with those to their swaps.

    Parameters
    ----------
    field : Field
        Any trained field.
    pairs : int
        Queries, drawn evenly from the trained box.
    rng : numpy.random.Generator
        Source of randomness.

    Returns
    -------
    dict
        Mean difference by each metric of the paper's tables; all zero for a
        field that is reciprocal by construction.
    """
    frame = field.frame
    span = np.maximum(frame.high - frame.low, 1e-9)
    ends = frame.low + span * rng.random((2, pairs, 3))
    one, other = Poses.of(ends[0]), Poses.of(ends[1])
    scale = np.float32(frame.scale)
    there, back = field.predict(one, other) / scale, field.predict(other, one) / scale
    return compare_rows(there, back, frame.sample_rate)
