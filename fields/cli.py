"""The command train-field."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from rir.command import make_app, run

__all__ = ["main"]

app = make_app()

EPILOG = """\b
Further commands, each with its own --help:
  train-field list             the models
  train-field compare CONFIG   tables of models x forms x seeds
  train-field cost DATASET     accuracy against seconds of training
  train-field map RUN          maps of a trained field
"""


@app.command(epilog=EPILOG)
def train(
    dataset: Annotated[
        list[str], typer.Argument(help="Session folders or .h5 files, read as one.")
    ],
    model: Annotated[str, typer.Option(help="Model; see train-field list.")] = "inras",
    exchange: Annotated[
        bool, typer.Option("--exchange", help="Learn each response both ways (ELE).")
    ] = False,
    self_supervised: Annotated[
        bool,
        typer.Option("--self-supervised", help="Add the reciprocity loss (SSL)."),
    ] = False,
    budget: Annotated[
        str, typer.Option(help="CPU time to train at most, such as 60s or 2h.")
    ] = "60s",
    steps: Annotated[
        int | None, typer.Option(help="Stop after so many steps at the latest.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of split, weights, batches.")
    ] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Run folder; runs/<name> by default.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue the run in the folder.")
    ] = False,
    split: Annotated[
        Path | None, typer.Option(help="Use this split file instead of drawing one.")
    ] = None,
    test_fraction: Annotated[
        float, typer.Option(help="Part of the emitters held out for the test.")
    ] = 0.25,
    sample_rate: Annotated[
        float, typer.Option(help="Train at this rate [Hz]; 0 keeps the data's.")
    ] = 16000.0,
    duration: Annotated[
        float, typer.Option(help="Train on the first seconds [s]; 0 keeps all.")
    ] = 0.1,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="Model setting, such as width=128; repeatable."),
    ] = None,
    preset: Annotated[
        str, typer.Option(help="Sizes: cpu, or the paper's: paper.")
    ] = "cpu",
    precision: Annotated[
        str, typer.Option(help="float32, or bfloat16 inside the network.")
    ] = "float32",
    tensorboard: Annotated[
        bool,
        typer.Option("--tensorboard", help="Write event files for TensorBoard."),
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress.")] = False,
) -> None:
    """Train a field on a data set and score it on emitters it has not heard."""
    from fields.commands.train import Request, train_and_report

    request = Request(
        dataset=dataset,
        model=model,
        exchange=exchange,
        self_supervised=self_supervised,
        budget=budget,
        steps=steps,
        seed=seed,
        out=out,
        resume=resume,
        split=split,
        test_fraction=test_fraction,
        sample_rate=sample_rate or None,
        duration=duration or None,
        device=device,
        settings=settings or [],
        preset=preset,
        quiet=quiet,
        precision=precision,
        tensorboard=tensorboard,
    )
    train_and_report(request)


def main(argv: Sequence[str] | None = None) -> int:
    """Run train-field and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and arguments[0] in ("compare", "cost", "map", "list"):
        from fields.commands.subcommands import more

        return run(more, arguments, "train-field")
    return run(app, arguments, "train-field")


if __name__ == "__main__":
    sys.exit(main())
