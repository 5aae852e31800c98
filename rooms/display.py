"""What `simulate-room` shows on screen."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from rir import Poses
from rir.arrays import FloatArray
from rir.cost import CostCurve
from rooms.plan import EffectPlan
from rooms.scene import Scene

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from rooms.simulation import Simulation

__all__ = [
    "coincident_line",
    "cost_table",
    "describe_scene",
    "error_lines",
    "parameter_table",
    "plan_table",
    "progress_shown",
]


def describe_scene(scene: Scene) -> "Text":
    """Return two lines about a scene, marked as simulated."""
    from rich.text import Text

    size = " x ".join(f"{length:.2f}" for length in np.asarray(scene.geometry.size))
    decay = scene.eyring_t60()
    low, high = (f"{value:.2f}" for value in (decay.min(), decay.max()))
    volume = f"{scene.geometry.volume:.1f} m³"
    if scene.geometry.estimates:
        volume = f"about {scene.geometry.volume:.0f} m³"
    lines = [f" {scene.name}: {size} m, {volume}, Eyring T60 {low}…{high} s"]
    lines += [f"  note: {remark}" for remark in scene.remarks]
    return Text.assemble(("SIMULATED", "bold red"), "\n".join(lines))


def plan_table(plan: EffectPlan) -> "Table":
    """Return the plan: effect, on or off, why, error if off, cost."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title="Effects (SIMULATED)")
    for heading in ("effect", "", "why", "predicted error if off", "cost / pair"):
        table.add_column(heading)
    for name, verdict in plan.verdicts.items():
        mark = Text("on", "green") if verdict.on else "off"
        cost = f"{1000 * verdict.cost_s:.1f} ms" if verdict.on else "0"
        table.add_row(name, mark, verdict.reason, verdict.shown_errors, cost)
    return table


_ERROR_WORDS = {
    "level_db": "level {:.2g} dB",
    "clarity_db": "C50 {:.2g} dB",
    "reverberation_percent": "T60 {:.2g} %",
    "early_decay_percent": "EDT {:.2g} %",
}


def error_lines(result: "Simulation") -> list[str]:
    """Return the standard errors of a result: together, then cause by cause.

    Before them stands how many pairs the sound has not reached when the response ends:
    no error is predicted for those.
    """
    silent = int(np.sum(~np.any(result.responses, axis=-1)))
    seconds = result.responses.shape[-1] / result.sample_rate
    pairs = f"{silent} of {result.responses[..., 0].size} pairs"
    unheard = [f"no sound arrives within {seconds:g} s at {pairs}"] if silent else []
    causes = [
        f"  {cause}: {_error_words(errors)}"
        for cause, errors in result.error_parts.items()
        if any(errors.values())
    ]
    head = "standard error of a pair (worst octave), all causes together"
    whole = f"{head}: {_error_words(result.errors)}"
    mean = f"that of the mean of all pairs: {_error_words(result.mean_errors)}"
    several = [mean] if result.responses[..., 0].size > 1 else []
    return [*unheard, whole, *causes, *several]


def coincident_line(emitters: Poses, listeners: Poses) -> str:
    """Return what to say of ends closer than a transducer is large, empty if none.

    Examples
    --------
    >>> coincident_line(Poses.of([1, 1, 1]), Poses.of([[1, 1, 1], [2, 1, 1]]))
    'emitter and listener coincide at 1 of 2 pairs: their direct sound is that of 10 mm'
    """
    from rooms.effects.direct import NEAREST

    way = emitters.positions[:, None] - listeners.positions[None]
    close = np.linalg.norm(way, axis=-1) < NEAREST
    if not np.any(close):
        return ""
    return (
        f"emitter and listener coincide at {close.sum()} of {close.size} pairs: their"
        f" direct sound is that of {1000 * NEAREST:g} mm"
    )


def _error_words(errors: dict[str, float]) -> str:
    parts = [
        words.format(errors[kind])
        for kind, words in _ERROR_WORDS.items()
        if errors.get(kind, 0.0) > 0
    ]
    return ", ".join(parts) or "none predicted"


def cost_table(curve: CostCurve) -> "Table":
    """Return one knob's settings with the recommended one marked."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title=f"{curve.knob} ({curve.mark})")
    quantity = f"error of {curve.quantity} [{curve.unit}]"
    for heading in ("setting", f"CPU ms / {curve.per}", quantity, ""):
        table.add_column(heading, justify="right")
    for k, p in enumerate(curve.points):
        mark = Text("recommended", "green") if k == curve.knee else ""
        table.add_row(p.setting, f"{1000 * p.seconds:.3g}", f"{p.error:.3g}", mark)
    return table


def parameters_of(
    result: "Simulation", scene: Scene, emitters: Poses, listeners: Poses
) -> dict[str, FloatArray]:
    """Return parameters per octave of all pairs, each (emitters, listeners, bands)."""
    from rooms.parameters import hall_parameters

    way = emitters.positions[:, None] - listeners.positions[None]
    arrival = np.linalg.norm(way, axis=-1) / scene.speed_of_sound
    return hall_parameters(result.responses, result.sample_rate, arrival, scene.bands)


def parameter_table(
    result: "Simulation", scene: Scene, emitters: Poses, listeners: Poses
) -> "Table":
    """Return room-acoustic parameters per octave: mean over pairs and their spread."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    found = parameters_of(result, scene, emitters, listeners)
    title = "mean±deviation over pairs (SIMULATED, ISO 3382-1)"
    table = Table(title=title, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("octave", justify="right")
    for name, (_, unit, _) in _SHOWN.items():
        table.add_column(f"{name} {unit}", justify="right")
    for k in np.nonzero(scene.bands < result.sample_rate / 2)[0]:
        row = [
            _spread(scale * found[name][..., k].ravel(), digits)
            for name, (scale, _, digits) in _SHOWN.items()
        ]
        table.add_row(f"{scene.bands[k]:.0f} Hz", *row)
    return table


_SHOWN = {
    "T30": (1, "s", 2),
    "EDT": (1, "s", 2),
    "C50": (1, "dB", 1),
    "C80": (1, "dB", 1),
    "D50": (100, "%", 0),
    "TS": (1000, "ms", 0),
    "G": (1, "dB", 1),
}
"""Scale, unit and digits of each parameter shown."""


def _spread(values: FloatArray, digits: int) -> str:
    known = values[np.isfinite(values)]
    if not len(known):
        return "-"
    return f"{known.mean():.{digits}f}±{known.std():.{digits}f}"


@contextmanager
def progress_shown(console: "Console") -> Iterator[Callable[[int, int], None]]:
    """Show on a terminal how far work is; yield what is told (done, in all)."""
    from rich.progress import Progress

    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("simulating", total=None)

        def tell(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        yield tell
