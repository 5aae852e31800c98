"""Directions and shells along which a listener gathers sound."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

__all__ = ["Shells", "even_directions", "random_rotation"]


@dataclass(frozen=True, eq=False)
class Shells:
    """Spheres round a listener whose delays are whole samples.

    Parameters
    ----------
    delays : Tensor
        Samples from the shell to the listener, shape (shells,), int64.
    radii, steps : Tensor
        Radius and thickness, shape (shells,), metres.
    """

    delays: Tensor
    radii: Tensor
    steps: Tensor

    @classmethod
    def spread(cls, count: int, far: float, samples_a_metre: float) -> "Shells":
        """Place shells evenly from the listener out to ``far``.

        Whole-sample delays make the shift to the listener an index, not a
        Fourier transform; radii that fall on the same sample become one shell.
        """
        last = max(round(far * samples_a_metre), 1)
        if count == 1:
            # The only shell lies where the listener does not.
            radius = torch.tensor([last / samples_a_metre])
            return cls(torch.tensor([last]), radius, radius)
        delays = torch.linspace(0, last, min(count, last + 1)).round().long()
        delays = torch.unique(delays)
        radii = delays.float() / samples_a_metre
        # The last step is finite: an infinite one makes its alpha a switch.
        steps = torch.diff(radii, append=radii[-1:] + radii[-1:] - radii[-2:-1])
        return cls(delays, radii, steps)

    def __len__(self) -> int:
        return len(self.delays)


def even_directions(count: int) -> Tensor:
    """Return directions spread evenly over the sphere (Fibonacci), (count, 3)."""
    height = 1 - (2 * torch.arange(count, dtype=torch.float64) + 1) / count
    angle = torch.arange(count, dtype=torch.float64) * math.pi * (3 - math.sqrt(5))
    flat = (1 - height.square()).sqrt()
    columns = [flat * angle.cos(), flat * angle.sin(), height]
    return torch.stack(columns, dim=-1).float()


def random_rotation(random: torch.Generator) -> Tensor:
    """Return a uniformly distributed rotation matrix, shape (3, 3)."""
    w, x, y, z = torch.nn.functional.normalize(
        torch.randn(4, generator=random, dtype=torch.float64), dim=0
    ).tolist()
    return torch.tensor(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
