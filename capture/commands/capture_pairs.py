"""The command ``capture-pairs``."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rir.command import make_app, make_console, run

if TYPE_CHECKING:
    from rich.console import Console

    from capture.config import SessionConfig
    from capture.session.folder import SessionFolder

__all__ = ["app", "main"]

app = make_app()


class Pattern(StrEnum):
    """Directivity of the simulated loudspeaker."""

    omni = "omni"
    cardioid = "cardioid"


def _option(*names: str, text: str, **more: Any) -> Any:
    return typer.Option(*names, help=text, show_default=False, **more)


@app.command()
def capture_pairs(
    room: Annotated[
        str | None,
        _option("--room", text="kitchen, conference, office, or a room file."),
    ] = None,
    out: Annotated[
        Path | None,
        _option("--out", text="Session folder; sessions/<room>-<date> if left out."),
    ] = None,
    pairs: Annotated[
        str, _option("--pairs", text="How many pairs (20), or a YAML file of pairs.")
    ] = "20",
    takes: Annotated[
        int | None, _option("--takes", text="Good takes per direction (1).", min=1)
    ] = None,
    seed: Annotated[int, _option("--seed", text="Seed of everything drawn (0).")] = 0,
    clearance: Annotated[
        float, _option("--clearance", text="Metres kept to walls, furniture (0.5).")
    ] = 0.5,
    apart: Annotated[
        float, _option("--apart", text="Least metres between a pair's places (1).")
    ] = 1.0,
    sweep_seconds: Annotated[
        float | None, _option("--sweep-seconds", text="Length of the sweep.")
    ] = None,
    sample_rate: Annotated[
        int | None, _option("--sample-rate", text="Samples per second (48000).")
    ] = None,
    config: Annotated[
        Path | None,
        _option("--config", text="YAML with any part of session.yaml to start from."),
    ] = None,
    rig: Annotated[
        str | None,
        _option("--rig", text="simulated, manual (a person), or a rig file."),
    ] = None,
    device: Annotated[
        str | None, _option("--device", text="Audio device: measure for real.")
    ] = None,
    host_api: Annotated[
        str | None, _option("--host-api", text="Its host API, if names repeat.")
    ] = None,
    inputs: Annotated[
        str | None, _option("--inputs", text="Microphone inputs, from 1: 1 or 1,3 (1).")
    ] = None,
    loopback: Annotated[
        int | None, _option("--loopback", text="Loopback input, 0 for none (2).")
    ] = None,
    outputs: Annotated[
        str | None, _option("--outputs", text="Loudspeaker outputs, from 1 (1).")
    ] = None,
    loopback_output: Annotated[
        int | None, _option("--loopback-output", text="Output that feeds the loopback.")
    ] = None,
    overlap: Annotated[
        bool,
        typer.Option("--overlap", help="Let all loudspeakers' sweeps share a take."),
    ] = False,
    thermometer: Annotated[
        str | None,
        _option(
            "--thermometer", text="File whose last line is the temperature, or ask."
        ),
    ] = None,
    closure: Annotated[
        bool, typer.Option("--closure", help="Repeat the first direction at the end.")
    ] = False,
    noise_db: Annotated[
        float | None,
        _option(
            "--noise-db",
            text="Simulated room noise, dB re the sweep's direct sound at 1 m.",
        ),
    ] = None,
    loudspeaker: Annotated[
        Pattern | None, _option("--loudspeaker", text="Simulated: omni or cardioid.")
    ] = None,
    placement_mm: Annotated[
        float | None,
        _option("--placement-mm", text="Simulated placing error per axis, mm rms."),
    ] = None,
    measured: Annotated[
        Path | None,
        _option("--measured", text="Simulate from the responses of this data set."),
    ] = None,
    resume: Annotated[
        bool | None,
        typer.Option(
            "--resume/--new",
            help="Resume an unfinished session, or start anew; asks if left out.",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print and check the plan; do nothing.")
    ] = False,
    calibrator_db: Annotated[
        float | None,
        _option(
            "--calibrator-db", text="With --check: a 1 kHz calibrator of this level."
        ),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Answer yes where a rig asks to be homed.")
    ] = False,
    list_devices: Annotated[
        bool, typer.Option("--list-devices", help="List the audio devices there are.")
    ] = False,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Find loopback, level, noise, distortion; then stop."
        ),
    ] = False,
    cost: Annotated[
        bool,
        typer.Option(
            "--cost", help="Simulate what sweep length, takes, band, width gain."
        ),
    ] = False,
    rebuild: Annotated[
        Path | None,
        _option("--rebuild", text="Only derive dataset.h5 of this session anew."),
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="Plain lines, no progress bar.")
    ] = False,
) -> None:
    """Measure impulse responses of a room both ways between pairs of places.

    Rig and audio interface are SIMULATED unless --device and --rig say otherwise.
    """
    console = make_console()
    if list_devices:
        _list_devices(console)
        return
    if rebuild is not None:
        _rebuild(rebuild, console)
        return
    if room is None:
        raise typer.BadParameter("give --room kitchen, conference, office or a file")
    from capture.session.start import Request, channel_settings

    request = Request(
        room,
        pairs,
        clearance,
        apart,
        seed,
        config,
        {
            "takes": takes,
            "sample_rate": sample_rate,
            "rig": rig or ("manual" if device else None),
            "interface": "portaudio" if device else None,
            "closure": closure or None,
            "overlap": overlap or None,
            "thermometer": thermometer,
            "device": {"name": device, "host_api": host_api},
            "channels": channel_settings(inputs, loopback, outputs, loopback_output),
            "sweep": {"seconds": sweep_seconds},
            "simulation": {
                "noise_db": noise_db,
                "loudspeaker": loudspeaker.value if loudspeaker else None,
                "placement_mm": placement_mm,
                "measured": str(measured) if measured else None,
            },
        },
    )
    if dry_run:
        _dry_run(request, console)
    elif cost:
        _cost(request, out, console)
    elif check:
        _check(request, console, calibrator_db)
    else:
        _capture(request, out, resume, console, (plain, yes))


def _capture(
    request: Any,
    out: Path | None,
    resume: bool | None,
    console: "Console",
    manner: tuple[bool, bool],
) -> None:
    from datetime import date

    from capture.operator import make_display
    from capture.session.run import run_session
    from capture.session.start import choose_folder, is_complete, is_sound, plan_session

    folder = choose_folder(
        out, request.room, today=date.today(), resume=resume, ask=_asker(console)
    )
    if folder.exists and is_complete(folder) and is_sound(folder):
        _say_complete(folder, console)
        return
    config = None if folder.exists else plan_session(request)
    shown = config or folder.load_config()
    console.out(f"session folder {folder.path}")
    plain, yes = manner
    with make_display(console, simulated=shown.simulated, plain=plain) as display:
        path = run_session(folder, config, display, yes=yes)
    _say_written(path, shown.simulated, console)


def _say_complete(folder: "SessionFolder", console: "Console") -> None:
    from capture.session.dataset import build_dataset

    if not folder.dataset_path.exists():
        build_dataset(folder)
    console.out(
        f"{folder.path} is complete already: {folder.dataset_path}\n"
        "(give another --out for a new session)"
    )


def _say_written(path: Path, simulated: bool, console: "Console") -> None:
    mark = "SIMULATED" if simulated else "MEASURED"
    console.out(f"{mark} data set written: {path}")


def _rebuild(path: Path, console: "Console") -> None:
    from capture.session.dataset import build_dataset
    from capture.session.folder import SessionFolder

    folder = SessionFolder(path)
    simulated = folder.load_config().simulated
    _say_written(build_dataset(folder), simulated, console)


def _dry_run(request: Any, console: "Console") -> None:
    from capture.devices.stage import build_mover
    from capture.operator import make_display
    from capture.operator.display import time_text
    from capture.session.run import check_plan
    from capture.session.start import plan_session

    config = plan_session(request)
    display = make_display(console, simulated=config.simulated, plain=True)
    plan = check_plan(config, build_mover(config, operator=display))
    lines = [f"{number:4d}  {step}" for number, step in enumerate(plan, start=1)]
    takes = sum(step.takes for step in plan.measures)
    mark = "SIMULATED" if config.simulated else "MEASURED"
    lines.append(
        f"{mark} session in {config.room.name}: {len(config.pairs)} pairs, "
        f"{takes} takes of {plan.take_s:.1f} s, {len(plan.moves)} moves; "
        f"about {time_text(plan.seconds())} with a rig; every pose is in reach"
    )
    if len(config.channels.loudspeakers) > 1:
        lines.append(_overlap_line(config))
    for line in lines:
        console.out(line)


def _overlap_line(config: "SessionConfig") -> str:
    """Return what overlapping the loudspeakers' sweeps saves, and what it costs."""
    from capture.operator.display import time_text
    from capture.plan import build_plan
    from capture.session.take import session_sweep

    both = [config.model_copy(update={"overlap": on}) for on in (False, True)]
    one, other = (build_plan(each).seconds() for each in both)
    price = both[1].interleaving.price(session_sweep(config).rate, config.sample_rate)
    used = "on" if config.overlap else "off"
    return f"--overlap ({used}) saves {time_text(one - other)}; price: {price}"


def _list_devices(console: "Console") -> None:
    from rich.table import Table

    from capture.interfaces.portaudio import find_devices

    rows = find_devices()
    if not rows:
        console.out(
            "PortAudio sees no audio device: plug one in, or start the JACK server, "
            "and list again"
        )
        return
    table = Table("device", "host API", "in", "out", "rate [Hz]", box=None)
    for row in rows:
        table.add_row(
            row.name,
            row.host_api,
            str(row.inputs),
            str(row.outputs),
            f"{row.default_rate:g}",
        )
    console.print(table)


def _check(request: Any, console: "Console", calibrator_db: float | None) -> None:
    from capture.devices.stage import set_stage
    from capture.plan import build_plan
    from capture.session.folder import write_text
    from capture.session.preflight import Preflight, lock_settings
    from capture.session.start import plan_session
    from rir import InterfaceError
    from rir.config import dump_yaml

    config = plan_session(request)
    stage = set_stage(config)
    if config.simulated:
        stage.mover.place(build_plan(config).moves[0])
    interface = stage.open_interface()
    try:
        found = Preflight.of(interface, config, calibrator_db)
    finally:
        interface.close()
    for line in found.lines:
        console.out(line)
    if found.problems:
        raise InterfaceError("; ".join(found.problems))
    path = Path("checked.yaml")
    write_text(path, dump_yaml(lock_settings(config, found)))
    console.out(f"settings locked in {path}: measure with --config {path}")


def _cost(request: Any, out: Path | None, console: "Console") -> None:
    from analysis.cost import write_cost_page
    from capture.cost import measure_session
    from capture.cost.table import assumed_line, cost_table
    from capture.session.start import plan_session

    config = plan_session(request)
    folder = out or Path(f"cost-{config.room.name}")
    console.out(assumed_line(config))
    curves = []
    for knob, pair in measure_session(config).items():
        console.print(cost_table(pair))
        for curve in pair:
            console.out(curve.sentence)
            name = f"{knob}-{curve.quantity}".replace(" ", "-")
            curve.save(folder / f"{name}.json")
        curves += pair
    page = write_cost_page(curves, folder / "cost.html")
    console.out(f"SIMULATED curves: {page}")


def _asker(console: "Console") -> Any:
    """Return what asks a yes/no question; without a person the answer is yes."""

    def ask(question: str) -> bool:
        if not console.is_terminal:
            return True
        return typer.confirm(question, default=True)

    return ask


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``capture-pairs`` and return its exit code."""
    return run(app, argv, "capture-pairs")
