"""What every command on a session is told about it: one typed object."""

import inspect
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum, StrEnum
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

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


def option(
    text: str, *, flag: str = "", sets: str = "", default: Any = None, **more: Any
) -> Any:
    """Return a field of a dataclass that is an option of a command.

    Parameters
    ----------
    text : str
        Its help, with the default in its own words.
    flag : str
        The flag, if it is not the field's name.
    sets : str
        The key of ``session.yaml`` that it sets.
    default : object
        What stands for "not given".
    **more
        Further settings of `typer.Option`.
    """
    metadata = {"text": text, "flag": flag, "sets": sets, "more": more}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class SessionOptions:
    """The options that describe a session."""

    room: str | None = option("kitchen, conference, office, or a room file.")
    pairs: str | None = option("How many pairs to draw (20), or a YAML file of pairs.")
    takes: int | None = option("Good takes per direction (1).", sets="takes", min=1)
    seed: int | None = option("Seed of everything drawn at random (0).", min=0)
    clearance: float | None = option("Kept to walls and furniture [m] (0.5).")
    apart: float | None = option("Least distance within a pair [m] (1).")
    sweep_seconds: float | None = option(
        "Length of the sweep [s] (8 reverberation times).", sets="sweep.seconds"
    )
    sample_rate: int | None = option("Sample rate [Hz] (48000).", sets="sample_rate")
    config: Path | None = option("YAML with any part of a session.yaml to start from.")
    rig: str | None = option("simulated, manual (a person), or a rig file.", sets="rig")
    device: str | None = option("Audio device: measure for real.", sets="device.name")
    host_api: str | None = option(
        "Its host API, where several know the name.", sets="device.host_api"
    )
    inputs: str | None = option("Microphone inputs, from 1: 1 or 1,3 (1).")
    loopback: int | None = option("Loopback input, 0 for none (2).", min=0)
    outputs: str | None = option("Loudspeaker outputs, from 1: 1 or 1,2 (1).")
    loopback_output: int | None = option("Output that feeds the loopback.", min=1)
    overlap: bool = option(
        "Let all loudspeakers' sweeps share a take.", sets="overlap", default=False
    )
    thermometer: str | None = option(
        "File whose last line is the temperature, or ask.", sets="thermometer"
    )
    closure: bool = option(
        "Repeat the first direction at the end.", sets="closure", default=False
    )
    noise_db: float | None = option(
        "Simulated room noise [dB re the sweep's direct sound at 1 m].",
        sets="simulation.noise_db",
    )
    loudspeaker: Pattern | None = option(
        "Directivity of the simulated loudspeaker (omni).",
        sets="simulation.loudspeaker",
    )
    placement_mm: float | None = option(
        "Simulated placing error per axis [mm rms].", sets="simulation.placement_mm"
    )
    measured: Path | None = option(
        "Simulate with the responses of this data set.", sets="simulation.measured"
    )

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
        for each in fields(self):
            value, key = getattr(self, each.name), each.metadata["sets"]
            if key and value != each.default:
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
        "--new" if value is False else flag_of(each.name)
        for each in fields(options)
        if (value := getattr(options, each.name)) != each.default
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
    groups: dict[str, Any] = {}
    flat: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(function).parameters.items():
        if is_dataclass(parameter.annotation):
            groups[name] = parameter.annotation
            flat += _parameters(parameter.annotation, without)
        else:
            flat.append(parameter.replace(kind=parameter.KEYWORD_ONLY))

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


def _parameters(group: Any, without: Collection[str]) -> Iterator[inspect.Parameter]:
    hints = get_type_hints(group)
    for each in fields(group):
        flag, about = flag_of(each.name), each.metadata
        if flag not in without:
            shown = typer.Option(
                about["flag"] or flag,
                help=about["text"] or None,
                hidden=not about["text"],
                show_default=False,
                **about["more"],
            )
            yield inspect.Parameter(
                each.name,
                inspect.Parameter.KEYWORD_ONLY,
                default=each.default,
                annotation=Annotated[hints[each.name], shown],
            )


def flag_of(name: str) -> str:
    """Return the flag of a field.

    Examples
    --------
    >>> flag_of("host_api")
    '--host-api'
    """
    return f"--{name.replace('_', '-')}"
