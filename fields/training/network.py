"""What a network offers the harness, and the field made of a trained one."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.field import paired_queries
from fields.frame import SceneFrame
from fields.layers.query import Query
from fields.stored import FIELD
from rir import Pose, Poses

__all__ = ["Levelled", "Network", "NetworkField", "load_network"]

PREDICT_ROWS = 64
"""Queries rendered in one go: bounds memory, not the answers."""


class Network(Protocol):
    """What the harness asks of a network; nothing inherits it."""

    name: str
    batch_size: int

    def observe(self, data: FieldData) -> None:
        """Learn constants, such as means, from the data before training."""
        ...

    def training_loss(
        self, query: Query, target: Tensor, random: torch.Generator
    ) -> Tensor:
        """Return the scalar loss of a batch."""
        ...

    def render(self, query: Query) -> Tensor:
        """Return responses, shape (batch, n_samples), the same each time."""
        ...


@runtime_checkable
class Levelled(Protocol):
    """A network whose level over time is fitted once more after training."""

    def fit_level(self, data: FieldData) -> None:
        """Give back what the loss cost in level."""
        ...


class NetworkField:
    """Answer responses from a trained network.

    Parameters
    ----------
    network : Network
        A torch module.
    config : Any
        The model's configuration dataclass.
    frame : SceneFrame
        Box, time axis and scale of its training.
    report : dict
        Steps, seconds and guard counts of the training.
    """

    def __init__(
        self, network: Any, config: Any, frame: SceneFrame, report: dict[str, Any]
    ) -> None:
        self.network = network
        self.config = config
        self.frame = frame
        self.report = report
        self.name = network.name

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32."""
        return self.rendered(emitters, listeners)

    def rendered(
        self,
        emitters: Poses | Pose | np.ndarray,
        listeners: Poses | Pose | np.ndarray,
        *how: Any,
    ) -> np.ndarray:
        """Return the same, with what else the network's ``render`` takes."""
        first, second = paired_queries(emitters, listeners)
        answers = np.empty((len(first), self.frame.n_samples), dtype=np.float32)
        self.network.eval()
        with torch.no_grad():
            for start in range(0, len(first), PREDICT_ROWS):
                rows = slice(start, start + PREDICT_ROWS)
                query = Query.of(first[rows], second[rows], self.device)
                answers[rows] = self.network.render(query, *how).float().cpu().numpy()
        return np.float32(self.frame.scale) * answers

    @property
    def device(self) -> torch.device:
        """Where the network's weights are."""
        return next(self.network.parameters()).device

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .pt."""
        path = Path(path).with_suffix(".pt")
        torch.save(self.stored(), path)
        return path

    def stored(self) -> dict[str, Any]:
        """Return what the field's file holds, in plain values and tensors."""
        return {
            **FIELD.stamp,
            "model": self.name,
            "config": asdict(self.config),
            "frame": self.frame.as_dict(),
            "report": self.report,
            "state": self.network.state_dict(),
        }


def load_network(
    path: Path, network_type: type[nn.Module], config_type: type
) -> NetworkField:
    """Rebuild a field from its file.

    Raises
    ------
    TrainingError
        If the file was written by a newer program.
    """
    stored = FIELD.open(torch.load(path, map_location="cpu", weights_only=True), path)
    frame = SceneFrame.from_dict(stored["frame"])
    config = config_type(**stored["config"])
    network = network_type(frame, config)
    network.load_state_dict(stored["state"])
    return NetworkField(network, config, frame, stored["report"])
