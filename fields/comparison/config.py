"""What train-field compare runs: configurations, the built-in ones and their sizes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import Field as Setting

from rir.config import StrictModel, load_yaml
from rir.errors import ConfigError

__all__ = [
    "FORMS",
    "CompareConfig",
    "ModelConfig",
    "SetConfig",
    "comparison_names",
    "load_comparisons",
]

FORMS = {
    "vanilla": {},
    "exchange": {"exchange": "double"},
    "flip": {"exchange": "flip"},
    "ssl": {"self_supervised": "pattern"},
    "ssl-paper": {"self_supervised": "paper"},
    "ssl-teacher": {"self_supervised": "teacher"},
    "contrastive": {"self_supervised": "contrastive"},
}
FOLDER = Path(__file__).parent
PAPER_LISTENERS = 5000
"""Listeners a room of the paper's simulated sets."""
PAPER_EPOCHS = 200.0
"""Epochs of the paper's trainings."""


class SetConfig(StrictModel):
    """One data set of a comparison."""

    name: str = ""
    scene: str = ""
    gains: str = "same"
    listeners: int = 150
    fewer: int = 1
    path: str = ""
    train_emitters: int | None = None
    spread_emitters: int | None = None
    test_rows: int = 600

    @property
    def title(self) -> str:
        """Name of the set, with what was taken away from it."""
        if self.name:
            return self.name
        stem = Path(self.path).stem if self.path else f"{self.scene}-{self.gains}"
        few = f"-{self.train_emitters}-emitters" if self.train_emitters else ""
        few += f"-{self.spread_emitters}-spread" if self.spread_emitters else ""
        return stem + few + (f"-listeners-over-{self.fewer}" if self.fewer > 1 else "")


class ModelConfig(StrictModel):
    """One model, with the settings that differ from its own."""

    model: str
    label: str = ""
    preset: str = "cpu"
    config: dict[str, Any] = Setting(default_factory=dict)
    forms: tuple[str, ...] = ("vanilla", "exchange")
    budget_s: float | None = None
    batch_size: int | None = None
    learning_rate: float | None = None


class CompareConfig(StrictModel):
    """A comparison: every model in every form with every seed on every set."""

    title: str = "comparison"
    sets: tuple[SetConfig, ...]
    models: tuple[ModelConfig, ...]
    seeds: tuple[int, ...] = (0, 1, 2)
    budget_s: float = 20.0
    epochs: float | None = None
    batch_size: int | None = None
    learning_rate: float = 1e-3
    weight_decay: float = 1e-2
    cache: str = "runs/sets"
    jitter_m: float = 0.003

    def with_budget(self, seconds: float) -> "CompareConfig":
        """Return the comparison with so many CPU seconds a training."""
        models = tuple(one.model_copy(update={"budget_s": None}) for one in self.models)
        return self.model_copy(update={"models": models, "budget_s": seconds})

    def paper_sized(self) -> "CompareConfig":
        """Return the comparison with the paper's sizes: for a GPU and days."""
        from fields.table import FIELDS

        def sized(one: ModelConfig) -> ModelConfig:
            if "paper" not in FIELDS[one.model].load_module().PRESETS:
                return one
            return one.model_copy(
                update={
                    "preset": "paper",
                    "config": {},
                    "batch_size": None,
                    "learning_rate": None,
                }
            )

        more = {"listeners": PAPER_LISTENERS}
        return self.model_copy(
            update={
                "sets": tuple(one.model_copy(update=more) for one in self.sets),
                "models": tuple(sized(one) for one in self.models),
                "epochs": PAPER_EPOCHS,
                "batch_size": None,
            }
        )


def comparison_names() -> list[str]:
    """Return the built-in tables, as same/methods."""
    found = FOLDER.glob("*/*.yaml")
    return sorted(str(one.relative_to(FOLDER).with_suffix("")) for one in found)


def load_comparisons(
    name: str, size: str = "cpu"
) -> Iterator[tuple[str, CompareConfig]]:
    """Yield the comparisons of a name, each with the folder it belongs in.

    Parameters
    ----------
    name : str
        A YAML file; a built-in table such as same/emitters; or same or diff for
        all tables of that data set.
    size : str
        "cpu", or "paper" for the paper's sizes and 200 epochs.

    Raises
    ------
    ConfigError
        If there is no such comparison or size, or the file has mistakes.
    """
    if size not in ("cpu", "paper"):
        raise ConfigError(f"no size {size!r}; known: cpu, paper")
    known = comparison_names()
    chosen = [one for one in known if name in (one, one.split("/")[0])]
    files = {one: FOLDER / f"{one}.yaml" for one in chosen}
    if not chosen:
        if not Path(name).is_file():
            raise ConfigError(
                f"no comparison {name!r}: neither a file nor built in; built in: "
                f"{', '.join(sorted({one.split('/')[0] for one in known}))} and "
                f"{', '.join(known)}"
            )
        files = {"": Path(name)}
    for folder, path in files.items():
        config = load_yaml(path, CompareConfig)
        yield folder, config.paper_sized() if size == "paper" else config
