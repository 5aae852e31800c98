"""The command ``rig``."""

from collections.abc import Sequence
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rir.command import make_app, make_console, run

if TYPE_CHECKING:
    from rich.console import Console

    from rigs.carriers import Carriers
    from rigs.rig import Rig
    from rir.pose import Pose

__all__ = ["app", "main"]

app = make_app("Look after the rigs that carry loudspeaker and microphone.")
File = Annotated[Path, typer.Argument(help="Rig file (YAML), or the name of a preset.")]
Yes = Annotated[bool, typer.Option("--yes", help="Consent to homing beforehand.")]


class Carrier(StrEnum):
    """Which of the two."""

    emitter = "emitter"
    listener = "listener"


Which = Annotated[Carrier, typer.Option("--carrier", help="Which carrier.")]


def _open(file: Path, *, yes: bool = False) -> "Carriers":
    """Load a rig file, say loudly whether it is simulated, connect."""
    from rigs.rigfile import find_rig_file, load_rig

    console = make_console()

    def ask(question: str) -> bool:
        return yes or typer.confirm(question)

    carriers = load_rig(find_rig_file(file), ask=ask, tell=console.out)
    if carriers.simulated:
        console.out("SIMULATED", style="bold yellow", end=" ")
        console.out("rig: nothing real moves")
    return carriers


def _home(carriers: "Carriers", *, yes: bool) -> None:
    lost = [rig.name for rig in carriers.rigs if rig.trouble()]
    if lost and (
        yes or typer.confirm(f"Home {' and '.join(lost)}? The machine will move.")
    ):
        carriers.home()


def _rig(carriers: "Carriers", carrier: Carrier) -> "Rig":
    return carriers.emitter if carrier is Carrier.emitter else carriers.listener


def _show(console: "Console", carriers: "Carriers") -> None:
    for name, rig in zip(("emitter", "listener"), carriers.rigs, strict=True):
        pose = rig.where()
        where = f"at {pose}" if pose is not None else f"unknown: {rig.trouble()}"
        console.out(f"{name} ({rig.name}): {where}")


def _pose(text: str) -> "Pose":
    from rir.pose import Pose

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4):
        raise typer.BadParameter(f"{text!r} is not x,y,z or x,y,z,yaw in m and degrees")
    return Pose.at(*numbers)


@app.command()
def ports() -> None:
    """List the serial ports there are."""
    from rigs.lines.serial import list_ports

    console = make_console()
    found = list_ports()
    for port, description in found:
        console.out(f"{port}  {description}")
    if not found:
        console.out("no serial port is known; sockets work as socket://host:port")


@app.command()
def kinds() -> None:
    """List the kinds of rig a rig file may name, and the presets."""
    from rigs.kinds import RIGS
    from rigs.rigfile import preset_names

    console = make_console()
    for name, kind in RIGS.items():
        console.out(f"{name:<10} {kind.about}")
    console.out("presets: " + ", ".join(preset_names()))


@app.command()
def connect(file: File) -> None:
    """Connect, read the controllers, and say what they are; move nothing."""
    console = make_console()
    with closing(_open(file)) as carriers:
        for rig in carriers.rigs:
            rig.connect()
        _show(console, carriers)
        console.print_json(data=carriers.describe())


@app.command()
def home(file: File, yes: Yes = False) -> None:
    """Find the references."""
    with closing(_open(file, yes=yes)) as carriers:
        _home(carriers, yes=yes)
        _show(make_console(), carriers)


@app.command()
def confirm(file: File, yes: Yes = False) -> None:
    """Visit the reference switches and find out whether steps were lost."""
    console = make_console()
    with closing(_open(file, yes=yes)) as carriers:
        _home(carriers, yes=yes)
        for rig, drift in zip(carriers.rigs, carriers.confirm(), strict=True):
            known = f"{1e6 * drift:.0f} µm" if drift == drift else "cannot be told"
            console.out(f"{rig.name}: drift {known}")


@app.command()
def where(file: File) -> None:
    """Say where the carriers are, and draw it."""
    from rigs.operation.planview import coloured, plan_of

    console = make_console()
    with closing(_open(file)) as carriers:
        for rig in carriers.rigs:
            rig.connect()
        _show(console, carriers)
        console.print(coloured(plan_of(carriers)))


@app.command()
def move(
    file: File,
    emitter: Annotated[str, typer.Option(help="x,y,z[,yaw] in m and degrees.")],
    listener: Annotated[str, typer.Option(help="x,y,z[,yaw] in m and degrees.")],
    yes: Yes = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only check the poses.")
    ] = False,
) -> None:
    """Bring both carriers to their poses, around furniture and each other."""
    from rigs.operation.planview import coloured, plan_of

    goal = _pose(emitter), _pose(listener)
    console = make_console()
    with closing(_open(file, yes=yes)) as carriers:
        carriers.check(*goal)
        if dry_run:
            console.print(coloured(plan_of(carriers, [goal])))
            return
        _home(carriers, yes=yes)
        carriers.place(*goal)
        _show(console, carriers)
        console.print(coloured(plan_of(carriers)))


@app.command()
def order(
    file: File,
    pairs: Annotated[Path, typer.Argument(help="YAML: pairs: [{a: [..], b: [..]}, …]")],
) -> None:
    """Show the shortest order of pairs, its length and its plan view."""
    from rigs.operation.planview import coloured, plan_of
    from rigs.rigfile import load_pairs

    console = make_console()
    with closing(_open(file)) as carriers:
        listed = load_pairs(pairs)
        visits = carriers.order(listed)
        for k, swapped in zip(visits.order, visits.swapped, strict=True):
            a, b = listed[k][::-1] if swapped else listed[k]
            console.out(f"pair {k + 1}: emitter first at {a}, listener at {b}")
        console.out(f"travel of both carriers: {visits.travel:.2f} m")
        console.print(coloured(plan_of(carriers, listed)))


@app.command()
def jog(
    file: File,
    carrier: Which = Carrier.emitter,
    step: Annotated[float, typer.Option(help="Step in mm.", min=0.01)] = 10.0,
    yes: Yes = False,
) -> None:
    """Move one carrier by the arrow keys; page up and down for z, q to leave."""
    from rigs.operation.jogging import jog_by_keys

    with closing(_open(file, yes=yes)) as carriers:
        _home(carriers, yes=yes)
        jog_by_keys(_rig(carriers, carrier), step / 1000.0, make_console().out)


@app.command()
def survey(
    points: Annotated[
        Path, typer.Argument(help="YAML: points: [{machine_mm: [..], room_m: [..]}, …]")
    ],
) -> None:
    """Fit the frame of a rig from touched points and print it for the rig file."""
    from rigs.calibration.frame import fit_frame
    from rigs.rigfile import load_points

    console = make_console()
    touched, surveyed = load_points(points)
    fit = fit_frame(touched, surveyed)
    for k, gap in enumerate(fit.residuals):
        console.out(f"point {k + 1}: {1000 * gap:.2f} mm off")
    console.out(f"residual: {1000 * fit.rms:.2f} mm rms; for the rig file:")
    origin = [round(float(value), 5) for value in fit.frame.origin]
    turn = [round(float(value), 7) for value in fit.frame.orientation]
    console.out(f"  frame: {{origin_m: {origin}, orientation: {turn}}}")


@app.command("self-test")
def self_test(
    file: File,
    count: Annotated[int, typer.Option(help="Random poses to visit.", min=1)] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Of the poses.")] = 0,
    yes: Yes = False,
) -> None:
    """Home, visit random poses, come back, and check that nothing was lost."""
    from rigs.operation.selftest import visit_random_poses

    console = make_console()
    with closing(_open(file, yes=yes)) as carriers:
        _home(carriers, yes=yes)
        worst = visit_random_poses(carriers, count, seed, console.out)
        console.out(f"passed: {count} poses, largest error {1e6 * worst:.0f} µm")


@app.command()
def simulate(
    rate: Annotated[float, typer.Option(help="Times real time.", min=0.1)] = 1.0,
) -> None:
    """Serve a simulated Grbl board on a pseudo-terminal until Ctrl-C."""
    from rigs.clock import FastClock
    from rigs.firmware.grbl.firmware import GrblFirmware
    from rigs.kinds.grbl import USUAL_SETTINGS
    from rigs.lines.terminal import PseudoTerminal

    firmware = GrblFirmware(USUAL_SETTINGS)
    with closing(PseudoTerminal(firmware, FastClock(rate))) as terminal:
        make_console().out(f"SIMULATED Grbl 1.1h at {terminal.port}; Ctrl-C ends it")
        terminal.wait()


def main(argv: Sequence[str] | None = None) -> Any:
    """Run the command and return its exit code."""
    return run(app, argv, "rig")
