"""How a field is trained: everything but the model's own sizes."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rir.errors import ConfigError

__all__ = ["Progress", "TrainingPlan", "form_of"]

POSITIVE = ("steps", "epochs", "budget_s", "batch_size", "learning_rate")
WHOLE = ("steps", "batch_size")
LARGEST_SEED = 2**32 - 1
"""The largest that both NumPy and torch take on every platform."""
CHOICES = {
    "exchange": ("none", "flip", "double"),
    "exchange_mode": ("pose", "position"),
    "self_supervised": ("none", "pattern", "teacher", "paper", "contrastive"),
    "precision": ("float32", "bfloat16"),
}


@dataclass(frozen=True)
class Progress:
    """Say how far a training is; scores only now and then."""

    step: int
    fraction: float
    loss: float
    seconds: float
    scores: dict[str, float] | None = None


@dataclass(frozen=True)
class TrainingPlan:
    """Hold the settings of one training.

    The defaults are those the paper states where it states any (AdamW, cosine
    from 1e-3 to 1e-4).
    """

    steps: int = 2000
    "most optimiser steps"
    epochs: float | None = None
    "times every response is seen; in place of the steps"
    budget_s: float | None = None
    "seconds to train at most: CPU seconds of the process, or wall seconds on CUDA"
    batch_size: int | None = None
    "responses a step; None takes the model's own"
    learning_rate: float = 1e-3
    "start of the cosine"
    final_learning_rate: float = 1e-4
    "end of the cosine"
    weight_decay: float = 1e-2
    "of AdamW"
    gradient_clip: float = 1.0
    "largest norm of a step's gradient"
    exchange: str = "none"
    "emitter-listener exchange: none, flip (coin per response) or double (both)"
    exchange_mode: str = "pose"
    "what is swapped: pose, or position only"
    self_supervised: str = "none"
    "reciprocity loss on predictions: none, pattern, teacher, paper or contrastive"
    precision: str = "float32"
    "float32, or bfloat16 inside the network"
    device: str = "cpu"
    "cpu or cuda"
    compile: bool = False
    "compile the network with torch.compile"
    seed: int = 0
    "seed of initial weights, batches and coins"
    checkpoint_s: float = 30.0
    "seconds between checkpoints"
    out: Path | None = field(default=None, compare=False)
    "folder for checkpoints; none are written without"
    resume: bool = False
    "continue from the checkpoint in the folder"
    watch: Callable[[Any], dict[str, float]] | None = field(default=None, compare=False)
    "scores the field now and then, for the curve only; its seconds are not counted"
    on_progress: Callable[[Progress], None] | None = field(default=None, compare=False)
    "called after every step"

    def __post_init__(self) -> None:
        for name, known in CHOICES.items():
            value = getattr(self, name)
            if value not in known:
                raise ConfigError(f"no {name} {value!r}; known: {', '.join(known)}")
        if not _whole(self.seed) or not 0 <= self.seed <= LARGEST_SEED:
            raise ConfigError(
                f"seed is {self.seed!r}; it must be a whole number, not negative "
                "and below 2**32"
            )
        for name in POSITIVE:
            _check_positive(name, getattr(self, name))
        if self.out is not None and not isinstance(self.out, Path):
            object.__setattr__(self, "out", _folder(self.out))


def form_of(switch: bool | str, on: str) -> str:
    """Return the form that a switch stands for: `on` for True, none for False."""
    if isinstance(switch, bool):
        return on if switch else "none"
    return switch


def _whole(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _check_positive(name: str, value: Any) -> None:
    if value is None:
        return
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not number or (name in WHOLE and not _whole(value)):
        kind = "whole number" if name in WHOLE else "number"
        raise ConfigError(f"{name} is {value!r}; it must be a positive {kind}")
    # A comparison with NaN is false, so that NaN is refused as well.
    if not value > 0:
        raise ConfigError(f"{name} is {value:g}; it must be positive")


def _folder(value: Any) -> Path:
    try:
        return Path(value)
    except TypeError as error:
        raise ConfigError(
            f"out is {value!r}; it must be the path of a folder"
        ) from error
