"""The command ``capture-pairs``: measure, and the commands round a session."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from capture.commands.check import CheckOptions, check_devices
from capture.commands.cost import REAL, CostOptions, show_cost
from capture.commands.devices import list_devices
from capture.commands.measure import RunOptions, measure
from capture.commands.options import Misuse, SessionOptions, given, option, with_options
from capture.commands.plan import show_plan
from capture.commands.rebuild import rebuild
from rir.command import make_app, run
from rir.deprecation import warn_deprecated

__all__ = ["app", "main"]

app = make_app(
    "Measure impulse responses of a room both ways between pairs of places. Rig and "
    "audio interface are SIMULATED unless --device and --rig say otherwise."
)
app.command("plan")(with_options(show_plan))
app.command("check")(with_options(check_devices))
app.command("devices", no_args_is_help=False)(list_devices)
app.command("rebuild", no_args_is_help=True)(rebuild)
app.command("cost")(with_options(show_cost, without=REAL))


class SessionCommands(TyperGroup):
    """Commands with names, beside measuring, which needs none."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command of a word; say what there is if the word is none."""
        word, known = args[0], ", ".join(self.commands)
        if word not in self.commands and not word.startswith("-"):
            near = get_close_matches(word, self.commands)
            hint = f"did you mean {near[0]}?" if near else f"there are {known}"
            raise Misuse(f"no command {word!r}: {hint} (a room is given with --room)")
        return super().resolve_command(ctx, args)


@dataclass(frozen=True)
class Aliases:
    """The commands as they were called before they had names of their own."""

    dry_run: bool = option("", default=False)
    check: bool = option("", default=False)
    calibrator_db: float | None = option("")
    list_devices: bool = option("", default=False)
    rebuild: Path | None = option("")
    cost: bool = option("", default=False)


@app.callback(
    cls=SessionCommands,
    invoke_without_command=True,
    no_args_is_help=False,
    subcommand_metavar="[COMMAND]",
)
@with_options
def capture_pairs(
    context: typer.Context,
    session: SessionOptions,
    running: RunOptions,
    aliases: Aliases,
) -> None:
    """Measure, or do what an alias of a command says."""
    name = context.invoked_subcommand
    for flag in (*given(session), *given(running), *given(aliases)) if name else ():
        raise Misuse(f"{flag} stands before {name}: options follow the command")
    if name:
        return
    chosen = _chosen(session, running, aliases)
    if chosen:
        warn_deprecated(f"capture-pairs {chosen}")
    match chosen:
        case "--dry-run":
            show_plan(session)
        case "--check":
            check_devices(session, CheckOptions(aliases.calibrator_db))
        case "--list-devices":
            list_devices()
        case "--rebuild":
            rebuild(Path(str(aliases.rebuild)))
        case "--cost":
            show_cost(session, CostOptions(running.out))
        case _:
            measure(session, running)


def _chosen(session: SessionOptions, running: RunOptions, aliases: Aliases) -> str:
    """Return the alias of the command that is wanted, empty for measuring.

    Raises
    ------
    Misuse
        If flags do not go together; both are named.
    """
    calibrator = [flag for flag in given(aliases) if flag == "--calibrator-db"]
    named = [flag for flag in given(aliases) if flag not in calibrator]
    if len(named) > 1:
        raise Misuse(f"{named[0]} and {named[1]} are two commands: give one of them")
    if not named:
        if calibrator:
            raise Misuse("--calibrator-db goes with check: capture-pairs check")
        return ""
    resuming = [flag for flag in given(running) if flag in ("--resume", "--new")]
    everything = [*given(session), *given(running), *calibrator]
    foreign = {
        "--dry-run": [*resuming, *calibrator],
        "--check": resuming,
        "--list-devices": [flag for flag in everything if flag != "--plain"],
        "--rebuild": [flag for flag in everything if flag != "--plain"],
        "--cost": [f for f in everything if f in (*REAL, *resuming, *calibrator)],
    }[named[0]]
    if foreign:
        raise Misuse(f"{foreign[0]} contradicts {named[0]}: leave one of them out")
    return named[0]


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``capture-pairs`` and return its exit code."""
    return run(app, argv, "capture-pairs")
