"""Permutation-invariant NAF: only symmetric functions of the two ends."""

from dataclasses import asdict, replace
from pathlib import Path

from fields.data import FieldData
from fields.models import naf
from fields.plan import TrainingPlan
from fields.settings import settings
from fields.training.loop import fit_network
from fields.training.network import NetworkField, load_network

__all__ = ["PRESETS", "Config", "InvariantNaf", "fit", "load"]


@settings
class Config(naf.Config):
    """Sizes of the permutation-invariant field."""

    symmetric: bool = True
    "always true here: sums and products of the two ends"


PRESETS = {
    name: Config(**{**asdict(preset), "symmetric": True})
    for name, preset in naf.PRESETS.items()
}


class InvariantNaf(naf.Naf):
    """Answer the same for a query and its swap, by construction.

    Right where emitter and listener have equal gain patterns, wrong where they
    have not: it cannot tell which end is which.
    """

    name = "naf-invariant"


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> NetworkField:
    """Train a permutation-invariant field."""
    symmetric = replace(config, symmetric=True)
    return fit_network(InvariantNaf, data, symmetric, plan)


def load(path: Path) -> NetworkField:
    """Open a stored permutation-invariant field."""
    return load_network(path, InvariantNaf, Config)
