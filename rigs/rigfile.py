"""Rig files: two carriers described in YAML."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Union

from pydantic import Field, create_model

from rigs.carriers import Carriers
from rigs.clock import Clock, SystemClock
from rigs.kinds import RIGS, Surroundings
from rigs.kinds.settings import Triple
from rigs.rig import Rig
from rir.config import StrictModel, load_yaml
from rir.errors import ConfigError
from rir.pose import Pose


class RigFile(StrictModel):
    """A whole rig file; the carriers' parts depend on their kinds."""

    name: str
    emitter: Any
    listener: Any
    separation_m: float = Field(default=0.0, ge=0.0)


def rig_file_model() -> type[RigFile]:
    """Return the model of a rig file with every kind of rig in the table."""
    parts: Any = Union[tuple(kind.config for kind in RIGS.values())]  # noqa: UP007
    part: Any = Annotated[parts, Field(discriminator="kind")]
    return create_model(
        "RigFile", __base__=RigFile, emitter=(part, ...), listener=(part, ...)
    )


def load_rig(
    path: Path | str,
    *,
    on_emitter: Callable[[Pose], None] | None = None,
    on_listener: Callable[[Pose], None] | None = None,
    clock: Clock | None = None,
    ask: Callable[[str], bool] | None = None,
    tell: Callable[[str], None] | None = None,
) -> Carriers:
    """Build the two carriers a rig file describes.

    Parameters
    ----------
    path
        The YAML file.
    on_emitter, on_listener
        Told the true pose of each carrier after each motion; a simulated world's
        ``place_emitter`` and ``place_listener``.
    clock
        Time for everything that waits; by default the system's, or simulated time
        if both carriers are simulated.
    ask
        Asks a person for consent; everything is refused by default.
    tell
        Shows a person what happens.

    Raises
    ------
    ConfigError
        With all mistakes of the file and their places.
    """
    file = load_yaml(path, rig_file_model())
    extras: dict[str, Any] = {"clock": clock or _clock_for(file)}
    extras |= {"ask": ask} if ask else {}
    extras |= {"tell": tell} if tell else {}
    around = Surroundings(**extras)
    emitter = build_rig(file.emitter, replace(around, on_pose=on_emitter))
    try:
        listener = build_rig(file.listener, replace(around, on_pose=on_listener))
    except BaseException:
        emitter.close()
        raise
    return Carriers(emitter, listener, file.separation_m)


def _clock_for(file: RigFile) -> Clock:
    if file.emitter.simulated and file.listener.simulated:
        from rigs.lines.stepped import SteppedClock

        return SteppedClock()
    return SystemClock()


def build_rig(config: Any, around: Surroundings) -> Rig:
    """Build one rig from its checked part of a rig file."""
    return RIGS[config.kind].build(config, around)


PRESETS = Path(__file__).parent / "presets"


def preset_names() -> list[str]:
    """Return the names of the rig files that come with the project."""
    return sorted(path.stem for path in PRESETS.glob("*.yaml"))


def find_rig_file(name: Path | str) -> Path:
    """Return the path of a rig file, given as a path or as the name of a preset.

    Raises
    ------
    ConfigError
        If there is neither.
    """
    path = Path(name)
    if path.is_file():
        return path
    preset = PRESETS / f"{name}.yaml"
    if preset.is_file():
        return preset
    raise ConfigError(
        f"there is no rig file {name}; presets are {', '.join(preset_names())}"
    )


class PointConfig(StrictModel):
    """One touched point."""

    machine_mm: Triple
    room_m: Triple


class PointsFile(StrictModel):
    """Points touched for the frame fit."""

    points: tuple[PointConfig, ...] = Field(min_length=3)


def load_points(path: Path | str) -> tuple[list[Triple], list[Triple]]:
    """Read touched points: machine mm and room m."""
    points = load_yaml(path, PointsFile).points
    return [p.machine_mm for p in points], [p.room_m for p in points]


class CarrierPair(StrictModel):
    """The places of both carriers, one way and exchanged."""

    a: Triple
    b: Triple


class CarrierPairsFile(StrictModel):
    """A YAML file of such pairs."""

    pairs: tuple[CarrierPair, ...] = Field(min_length=1)


def load_pairs(path: Path | str) -> list[tuple[Pose, Pose]]:
    """Read pairs of places as poses that face each other."""
    pairs = load_yaml(path, CarrierPairsFile).pairs
    return [(Pose.facing(p.a, p.b), Pose.facing(p.b, p.a)) for p in pairs]
