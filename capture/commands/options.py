"""What every command on a session is told about it: one typed object."""

import inspect
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum, StrEnum
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

if TYPE_CHECKING:
    from capture.config import SessionConfig

__all__ = ["Misuse", "SessionOptions", "given", "option", "with_options"]


class Misuse(typer.BadParameter):
    """Options that cannot be given together, or not to this command."""

    def format_message(self) -> str:
        """Return the message as it is."""
        return self.message


class Pattern(StrEnum):
    """Directivity of the simulated loudspeaker."""

    omni = "omni"
    cardioid = "cardioid"


def option(name: str, text: str, **more: Any) -> Any:
    """Return an option whose help says the default in its own words."""
    return typer.Option(name, help=text, show_default=False, **more)


@dataclass(frozen=True)
class SessionOptions:
    """The options that describe a session.

    The text after an option is the key of ``session.yaml`` that it sets.
    """

    room: Annotated[
        str | None,
        option("--room", "kitchen, conference, office, or the path of a room file."),
    ] = None
    pairs: Annotated[
        str | None,
        option("--pairs", "How many pairs to draw (20), or a YAML file of pairs."),
    ] = None
    takes: Annotated[
        int | None, option("--takes", "Good takes per direction (1).", min=1), "takes"
    ] = None
    seed: Annotated[
        int | None, option("--seed", "Seed of everything drawn at random (0).")
    ] = None
    clearance: Annotated[
        float | None,
        option("--clearance", "Kept between places and walls or furniture [m] (0.5)."),
    ] = None
    apart: Annotated[
        float | None,
        option("--apart", "Least distance between the places of a pair [m] (1)."),
    ] = None
    sweep_seconds: Annotated[
        float | None,
        option("--sweep-seconds", "Length of the sweep [s] (8 reverberation times)."),
        "sweep.seconds",
    ] = None
    sample_rate: Annotated[
        int | None, option("--sample-rate", "Sample rate [Hz] (48000)."), "sample_rate"
    ] = None
    config: Annotated[
        Path | None,
        option("--config", "YAML with any part of a session.yaml; options override."),
    ] = None
    rig: Annotated[
        str | None,
        option("--rig", "simulated, manual (a person), or a rig file."),
        "rig",
    ] = None
    device: Annotated[
        str | None,
        option("--device", "Audio device: measure for real."),
        "device.name",
    ] = None
    host_api: Annotated[
        str | None,
        option("--host-api", "Its host API, where several have a device of this name."),
        "device.host_api",
    ] = None
    inputs: Annotated[
        str | None, option("--inputs", "Microphone inputs, from 1: 1 or 1,3 (1).")
    ] = None
    loopback: Annotated[
        int | None, option("--loopback", "Loopback input, 0 for none (2).", min=0)
    ] = None
    outputs: Annotated[
        str | None, option("--outputs", "Loudspeaker outputs, from 1: 1 or 1,2 (1).")
    ] = None
    loopback_output: Annotated[
        int | None,
        option("--loopback-output", "Output that feeds the loopback alone.", min=1),
    ] = None
    overlap: Annotated[
        bool,
        option("--overlap", "Let the sweeps of all loudspeakers share a take."),
        "overlap",
    ] = False
    thermometer: Annotated[
        str | None,
        option("--thermometer", "File whose last line is the temperature, or ask."),
        "thermometer",
    ] = None
    closure: Annotated[
        bool,
        option("--closure", "Repeat the first direction at the end."),
        "closure",
    ] = False
    noise_db: Annotated[
        float | None,
        option(
            "--noise-db",
            "Simulated room noise [dB re the sweep's direct sound at 1 m].",
        ),
        "simulation.noise_db",
    ] = None
    loudspeaker: Annotated[
        Pattern | None,
        option("--loudspeaker", "Directivity of the simulated loudspeaker (omni)."),
        "simulation.loudspeaker",
    ] = None
    placement_mm: Annotated[
        float | None,
        option("--placement-mm", "Simulated placing error per axis [mm rms]."),
        "simulation.placement_mm",
    ] = None
    measured: Annotated[
        Path | None,
        option("--measured", "Simulate with the responses of this data set."),
        "simulation.measured",
    ] = None

    def settings(self) -> dict[str, Any]:
        """Return the parts of ``session.yaml`` that the options set."""
        from capture.session.start import channel_settings, merge

        channels = channel_settings(
            self.inputs, self.loopback, self.outputs, self.loopback_output
        )
        settings: dict[str, Any] = {"channels": channels}
        if self.device is not None:
            settings |= {"interface": "portaudio", "rig": "manual"}
        for key, value in self.keys_set():
            nested: Any = value
            for part in reversed(key.split(".")):
                nested = {part: nested}
            settings = merge(settings, nested)
        return settings

    def keys_set(self) -> Iterator[tuple[str, Any]]:
        """Yield the keys of ``session.yaml`` that the options set, with the values."""
        hints = get_type_hints(type(self), include_extras=True)
        for field in fields(self):
            value, key = getattr(self, field.name), get_args(hints[field.name])[-1]
            if value != field.default and isinstance(key, str):
                value = str(value) if isinstance(value, Path) else value
                yield key, value.value if isinstance(value, Enum) else value

    def plan(self) -> "SessionConfig":
        """Return the configuration of a new session.

        Raises
        ------
        Misuse
            If no room is given, or options contradict each other.
        """
        from capture.session.start import SessionRequest, plan_session

        if self.room is None:
            raise Misuse("give --room kitchen, conference, office or a file")
        for one, other in self._contradictions():
            raise Misuse(f"{one} contradicts {other}: leave one of them out")
        drawing = {
            name: getattr(self, name)
            for name in ("pairs", "clearance", "apart", "seed")
            if getattr(self, name) is not None
        }
        settings = self.settings()
        config = plan_session(
            SessionRequest(self.room, config=self.config, settings=settings, **drawing)
        )
        simulating = [f for f in given(self) if f in SIMULATING]
        if simulating and config.interface != "simulated":
            raise Misuse(
                f"{simulating[0]} simulates, but {self.config} measures with the "
                f"interface {config.interface}: leave one of them out"
            )
        return config

    def _contradictions(self) -> Iterator[tuple[str, str]]:
        flags = given(self)
        if self.device is not None:
            yield from ((flag, "--device") for flag in flags if flag in SIMULATING)
        elif self.host_api is not None and self.config is None:
            yield "--host-api", "the simulated interface (no --device)"
        if self.pairs is not None and not self.pairs.isdigit():
            drawn = [flag for flag in flags if flag in ("--clearance", "--apart")]
            yield from ((flag, f"--pairs {self.pairs}") for flag in drawn)
        if self.loopback == 0 and self.loopback_output is not None:
            yield "--loopback-output", "--loopback 0"
        if self.measured is not None and self.loudspeaker is not None:
            yield "--loudspeaker", "--measured"
        if self.overlap and self.outputs is not None and "," not in self.outputs:
            yield "--overlap", f"the single output of --outputs {self.outputs}"


SIMULATING = ("--noise-db", "--loudspeaker", "--placement-mm", "--measured")
"""Flags that say how a simulated interface sounds."""


def given(options: Any) -> list[str]:
    """Return the flags that were given, of a dataclass of options.

    Examples
    --------
    >>> given(SessionOptions(room="kitchen", overlap=True))
    ['--room', '--overlap']
    """
    return [
        "--new" if value is False else flag_of(field.name)
        for field in fields(options)
        if (value := getattr(options, field.name)) != field.default
    ]


def with_options(
    function: Callable[..., None], *, without: Collection[str] = ()
) -> Callable[..., None]:
    """Let a command take the fields of its dataclass parameters as options.

    Parameters
    ----------
    function : callable
        The command; parameters annotated with a dataclass are spread out.
    without : collection of str
        Flags that make no sense for this command: it does not offer them.
    """
    signature = inspect.signature(function)
    keyword = inspect.Parameter.KEYWORD_ONLY
    groups: dict[str, Any] = {}
    flat: list[inspect.Parameter] = []
    for name, parameter in signature.parameters.items():
        kind = parameter.annotation
        if not is_dataclass(kind):
            flat.append(parameter.replace(kind=keyword))
            continue
        groups[name] = kind
        hints = get_type_hints(kind, include_extras=True)
        flat += [
            inspect.Parameter(
                field.name, keyword, default=field.default, annotation=hints[field.name]
            )
            for field in fields(kind)
            if flag_of(field.name) not in without
        ]

    @wraps(function)
    def command(**values: Any) -> None:
        built = {
            name: group(
                **{
                    f.name: values.pop(f.name)
                    for f in fields(group)
                    if f.name in values
                }
            )
            for name, group in groups.items()
        }
        function(**built, **values)

    command.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    command.__annotations__ = {}
    return command


def flag_of(name: str) -> str:
    """Return the flag of a field.

    Examples
    --------
    >>> flag_of("host_api")
    '--host-api'
    """
    return f"--{name.replace('_', '-')}"
