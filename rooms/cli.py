"""The command `simulate-room`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rir.command import make_app, make_console, run
from rooms.options import Duration, Order, Rays, SampleRate, Seed

if TYPE_CHECKING:
    from rich.table import Table

    from rooms.comparison import Measured
    from rooms.scene import Scene
    from rooms.simulation import Simulation

__all__ = ["app", "main"]

app = make_app()
Places = Annotated[
    list[str] | None, typer.Option(help="x,y,z[,yaw] in m and °; repeatable.")
]
Gain = Annotated[
    str, typer.Option(help="omni, cardioid, or a file (.sofa, balloon .csv).")
]


@app.command()
def simulate_room(
    scene: Annotated[
        str,
        typer.Argument(
            help="kitchen, conference, office, l-shaped, coupled, coupled-dry,"
            " corridor; a room .yaml; a mesh (.obj .ply .glb .stl) or a folder"
            " with one."
        ),
    ],
    explain: Annotated[
        bool, typer.Option("--explain", help="Show which effects are on, and why.")
    ] = False,
    cost: Annotated[
        bool, typer.Option("--cost", help="Measure error against seconds per knob.")
    ] = False,
    emitter: Places = None,
    listener: Places = None,
    sample_rate: SampleRate = 48000,
    duration: Duration = 0.5,
    accuracy: Annotated[
        str | None, typer.Option(help='For instance "C50 0.1 dB, T60 1 %".')
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Processor time to spend on rays [s].")
    ] = None,
    order: Order = None,
    rays: Rays = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Switch every effect on.")
    ] = False,
    only: Annotated[
        str | None, typer.Option(help="Exactly these effects, separated by commas.")
    ] = None,
    without: Annotated[
        str, typer.Option(help="Leave these effects off, separated by commas.")
    ] = "",
    material: Annotated[
        str | None, typer.Option(help="Material of all surfaces of a mesh.")
    ] = None,
    emitter_gain: Gain = "omni",
    listener_gain: Gain = "omni",
    tolerance: Annotated[
        str | None, typer.Option(help='What effects off may cost, as "C50 0.5 dB".')
    ] = None,
    temperature: Annotated[
        float | None, typer.Option(help="Of the air [°C]; sets the speed of sound.")
    ] = None,
    humidity: Annotated[
        float | None, typer.Option(help="Of the air [%]; sets its absorption.")
    ] = None,
    parameters: Annotated[
        bool,
        typer.Option("--parameters", help="Show T30, EDT, C50, C80, D50, TS, G."),
    ] = False,
    compare: Annotated[
        Path | None,
        typer.Option(help="Compare with measured parameters (.csv) of the places."),
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Write a data set (.h5), arrays (.npz) or audio (.wav)."),
    ] = None,
) -> None:
    """Simulate a room with the effects it calls for. Everything is SIMULATED."""
    from dataclasses import replace

    from rooms.builtin import load_place_names, load_places, load_scene
    from rooms.comparison import read_measured
    from rooms.gains import load_gain

    for flag, given in (("--all", everything), ("--without", bool(without))):
        if only is not None and given:
            told = f"it contradicts {flag}: leave one of them out"
            raise typer.BadParameter(told, param_hint="--only")
    measured = read_measured(compare) if compare is not None else None
    if out is not None:
        from rooms.writing import check_target

        check_target(out, ()) if cost else check_target(out)
    bare = load_scene(scene, material)
    loaded = replace(
        bare,
        air=_air(bare.air, temperature, humidity),
        emitter_gain=load_gain(emitter_gain),
        listener_gain=load_gain(listener_gain),
    )
    options = {
        "sample_rate": sample_rate,
        "duration": duration,
        "max_order": order,
        "rays": rays,
    }
    overrides = {
        "only": _names(only) if only is not None else None,
        "without": _names(without),
        "everything": everything,
        "tolerance": _tolerance(tolerance or accuracy, tolerance is None),
    }
    effort = {"accuracy": accuracy, "seconds": seconds, "seed": seed}
    stated = _stated((emitter, listener), load_places(scene))
    wanted = explain, cost, parameters
    given = emitter, listener
    names = [
        [] if some else known
        for some, known in zip(given, load_place_names(scene), strict=True)
    ]
    against = None if measured is None else (measured, names)
    _carry_out(loaded, stated, options, overrides, effort, wanted, out, against)


def _air(air: Any, temperature: float | None, humidity: float | None) -> Any:
    """Return the air with what was stated for it."""
    from rir.config import validate
    from rir.room import Air

    stated = {"temperature_c": temperature, "humidity_percent": humidity}
    known = {key: value for key, value in stated.items() if value is not None}
    return validate(air.model_dump() | known, Air, origin="the air")


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _tolerance(text: str | None, alone: bool) -> Any:
    """Return the tolerance stated; `alone` says that all else may be anything."""
    from rooms.effects import Tolerance
    from rooms.effort import parse_accuracy

    limits = parse_accuracy(text)
    return Tolerance.of(limits) if alone and limits else Tolerance(**limits)


def _carry_out(
    scene: "Scene",
    stated: tuple[Any, Any],
    options: dict[str, Any],
    overrides: dict[str, Any],
    effort: dict[str, Any],
    wanted: tuple[bool, bool, bool],
    out: Path | None,
    against: tuple["Measured", list[list[str]]] | None,
) -> None:
    """Explain, measure the cost, or simulate, show and write."""
    from rooms.display import (
        coincident_line,
        describe_scene,
        error_lines,
        parameter_table,
        plan_table,
        progress_shown,
    )
    from rooms.plan import plan_effects
    from rooms.simulation import simulate

    explain, cost, parameters = wanted
    console = make_console()
    console.print(describe_scene(scene), soft_wrap=True)
    plan = plan_effects(scene, **options, **overrides)
    if explain:
        console.print(plan_table(plan))
        if out is None and against is None and not (cost or parameters):
            return
    places = _completed(scene, stated, effort["seed"])
    if cost:
        asked = plan.tolerance.clarity_db
        _show_cost(console, scene, places, options, asked, out)
        return
    if against is not None:
        from rooms.comparison import check_comparable

        check_comparable(against[0], _called(against[1], places), scene.bands)
    with progress_shown(console) as tell:
        result = simulate(scene, *places, **options, **effort, plan=plan, tell=tell)
    console.out(f"effects: {', '.join(plan.on)}")
    for line in filter(None, [coincident_line(*places), *error_lines(result)]):
        console.out(line)
    shape = "emitters x listeners x samples"
    console.out(f"{result.responses.shape} responses ({shape}), SIMULATED")
    if parameters:
        console.print(parameter_table(result, scene, *places))
    if against is not None:
        console.print(_comparison(result, scene, places, *against))
    if out is not None:
        from rooms.writing import write_simulation

        console.out(f"wrote {write_simulation(result, scene, *places, out)}")


def _comparison(
    result: "Simulation",
    scene: "Scene",
    places: tuple[Any, Any],
    measured: "Measured",
    names: list[list[str]],
) -> "Table":
    """Return the table of errors against what was measured."""
    from rooms.comparison import compare_parameters, deviation_table
    from rooms.display import parameters_of

    sources, receivers = _called(names, places)
    found = parameters_of(result, scene, *places)
    rows = compare_parameters(measured, found, (sources, receivers), scene.bands)
    table = deviation_table(rows, measured.bands)
    known = {name.lower() for name in (*sources, *receivers)}
    pairs = {(source, receiver) for source, receiver, _ in measured.values}
    strange = [f"{one} to {other}" for one, other in pairs if not {one, other} <= known]
    if strange:
        first = min(strange)
        table.caption = f"{len(strange)} measured pairs not simulated, as {first}"
    elif not rows:
        table.caption = "nothing to compare: the response is too short or too coarse"
    return table


def _called(names: list[list[str]], places: tuple[Any, Any]) -> tuple[Any, Any]:
    """Return the names of sources and receivers: S1, R1 and so on where none are."""
    sources, receivers = (
        known or [f"{letter}{k + 1}" for k in range(len(some))]
        for known, letter, some in zip(names, "SR", places, strict=True)
    )
    return sources, receivers


def _stated(
    texts: tuple[list[str] | None, list[str] | None], known: tuple[Any, Any]
) -> tuple[Any, Any]:
    """Return the poses asked for, else the room file's, else None."""
    from rir import Poses

    emitters, listeners = (
        Poses.of([_pose(text) for text in some]) if some else places
        for some, places in zip(texts, known, strict=True)
    )
    return emitters, listeners


def _completed(scene: "Scene", stated: tuple[Any, Any], seed: int) -> tuple[Any, Any]:
    """Return the poses stated, with a few random ones where there are none."""
    import numpy as np

    from rooms.places import random_places

    emitters, listeners = stated
    if emitters is None or listeners is None:
        drawn = random_places(scene, 4, np.random.default_rng(seed))
        emitters = drawn[:1] if emitters is None else emitters
        listeners = drawn[1:] if listeners is None else listeners
    return emitters, listeners


def _pose(text: str) -> Any:
    from rir import Pose
    from rir.errors import ConfigError

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4):
        raise ConfigError(f"cannot read the place {text!r}; write x,y,z or x,y,z,yaw")
    return Pose.at(*numbers)


def _show_cost(
    console: Any,
    scene: "Scene",
    places: tuple[Any, Any],
    options: dict[str, Any],
    tolerance_db: float,
    out: Path | None,
) -> None:
    from math import isfinite

    from rir import Poses
    from rooms.cost import measure_knobs
    from rooms.display import cost_table
    from rooms.effects import Tolerance

    fixed = {key: options[key] for key in ("sample_rate", "duration")}
    ends = (Poses.of(place) for place in places)
    with console.status("measuring") as status:
        curves = measure_knobs(
            scene,
            *ends,
            **fixed,
            tolerance_db=tolerance_db
            if isfinite(tolerance_db)
            else Tolerance.clarity_db,
            on_run=lambda text: status.update(f"measuring {text}"),
        )
    for curve in curves:
        console.print(cost_table(curve))
        console.out(curve.sentence)
        if out is not None:
            stem = f"{out.stem}-{curve.knob}.json"
            console.out(f"wrote {curve.save(out.with_name(stem))}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run `simulate-room` and return its exit code."""
    return run(app, argv, "simulate-room")
