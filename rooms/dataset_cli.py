"""The command `make-dataset`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rir.command import make_app, make_console, run
from rooms.options import Duration, Order, Rays, SampleRate, Seed

if TYPE_CHECKING:
    from rooms.factory import Recipe

__all__ = ["app", "main"]

app = make_app()


@app.command()
def make_dataset(
    scene: Annotated[str, typer.Argument(help="As for simulate-room.")],
    out: Annotated[
        Path | None, typer.Option(help="File to make [SCENE-GAINS.h5].")
    ] = None,
    sample_rate: SampleRate = 16000,
    duration: Duration = 0.1,
    emitters: Annotated[int, typer.Option(help="Emitters for training.")] = 5,
    unseen: Annotated[int, typer.Option(help="Further emitters for tests.")] = 10,
    listeners: Annotated[int, typer.Option(help="Listeners on the grid.")] = 5000,
    gains: Annotated[str, typer.Option(help="same or diff patterns.")] = "same",
    fewer: Annotated[int, typer.Option(help="Keep every n-th listener.")] = 1,
    order: Order = None,
    rays: Rays = None,
    seed: Seed = 0,
    workers: Annotated[int, typer.Option(help="Processes on this machine.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler to work on.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what would be made.")
    ] = False,
) -> None:
    """Make a simulated data set in the layout of the paper. It is SIMULATED.

    Run again after an interruption: finished blocks are kept.
    """
    from rooms.factory import Recipe
    from rooms.writing import check_target

    recipe = Recipe(
        scene=scene,
        sample_rate=sample_rate,
        duration=duration,
        emitters=emitters,
        unseen=unseen,
        listeners=listeners,
        gains=gains,
        fewer=fewer,
        max_order=order,
        rays=rays,
        seed=seed,
    )
    target = out or Path(f"{Path(scene).stem}-{gains}.h5")
    check_target(target, (".h5",))
    _carry_out(recipe, target, workers, scheduler, dry_run)


def _carry_out(
    recipe: "Recipe", target: Path, workers: int, scheduler: str | None, dry_run: bool
) -> None:
    from rooms.display import describe_scene, plan_table, progress_shown
    from rooms.factory import make_dataset

    console = make_console()
    bench = recipe.open()
    console.print(describe_scene(bench.scene), soft_wrap=True)
    layout = bench.layout
    samples = round(recipe.duration * recipe.sample_rate)
    size = 4 * samples * len(layout) / 1e6
    console.out(
        f"{len(layout.emitters)} emitters ({layout.training} for training) x"
        f" {len(layout.listeners)} listeners = {len(layout)} responses of {samples}"
        f" samples, {size:.0f} MB, gains {recipe.gains}, SIMULATED"
    )
    if dry_run:
        console.print(plan_table(bench.plan))
        return
    with progress_shown(console) as tell:
        options = {"workers": workers, "scheduler": scheduler}
        made = make_dataset(recipe, target, tell=tell, **options)
    console.out(f"wrote {made}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run `make-dataset` and return its exit code."""
    return run(app, argv, "make-dataset")
