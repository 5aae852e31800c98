"""Options that `simulate-room` and `make-dataset` share."""

from typing import Annotated

import typer

__all__ = ["Duration", "Order", "Rays", "SampleRate", "Seed"]

SampleRate = Annotated[int, typer.Option(help="Samples per second [Hz].")]
Duration = Annotated[float, typer.Option(help="Length [s].")]
Order = Annotated[int | None, typer.Option(help="Highest reflection order.")]
Rays = Annotated[int | None, typer.Option(help="Rays per pair.")]
Seed = Annotated[int, typer.Option(min=0, help="Key of everything random.")]
