"""Multi-layer perceptrons."""

from collections.abc import Sequence
from itertools import pairwise

from torch import Tensor, nn

__all__ = ["ResidualPerceptron", "perceptron", "quiet_head"]


def perceptron(widths: Sequence[int], *, last: bool = True) -> nn.Sequential:
    """Stack linear layers with ReLU between them.

    Parameters
    ----------
    widths : sequence of int
        Widths from input to output.
    last : bool
        Leave the last layer linear.
    """
    layers: list[nn.Module] = []
    for before, after in pairwise(widths):
        layers += [nn.Linear(before, after), nn.ReLU()]
    return nn.Sequential(*(layers[:-1] if last else layers))


def quiet_head(width: int, outputs: int) -> nn.Sequential:
    """Return two layers to ``outputs`` values that start close to zero.

    A decoder of waveforms that starts loud spends its first steps becoming
    quiet.
    """
    last = nn.Linear(width, outputs)
    nn.init.normal_(last.weight, std=1e-3)
    nn.init.zeros_(last.bias)
    return nn.Sequential(nn.Linear(width, width), nn.ReLU(), last)


class ResidualPerceptron(nn.Module):
    """Layers of one width, each adding to what came before.

    Parameters
    ----------
    inputs, width, depth : int
        Input width, hidden width and number of residual layers.
    """

    def __init__(self, inputs: int, width: int, depth: int) -> None:
        super().__init__()
        self.entry = nn.Linear(inputs, width)
        self.layers = nn.ModuleList(nn.Linear(width, width) for _ in range(depth))
        self.activation = nn.GELU()

    def forward(self, values: Tensor) -> Tensor:
        """Map shape (..., inputs) to (..., width)."""
        hidden = self.activation(self.entry(values))
        for layer in self.layers:
            hidden = hidden + self.activation(layer(hidden))
        return hidden
