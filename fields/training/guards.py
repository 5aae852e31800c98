"""Gradient guards: mend what can be mended, count it, and tell."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn

__all__ = ["Guards"]


@dataclass
class Guards:
    """Count the steps that had to be mended."""

    skipped_steps: int = 0
    """Steps left out because the loss was not finite."""
    mended_steps: int = 0
    """Steps in which gradient entries were not finite and were set to zero."""
    clipped_steps: int = 0
    """Steps whose gradient was shortened to the largest norm."""

    def accept_loss(self, loss: Tensor) -> bool:
        """Say whether a loss may be derived; count it when not."""
        if bool(torch.isfinite(loss)):
            return True
        self.skipped_steps += 1
        return False

    def mend(self, parameters: Iterable[nn.Parameter], largest_norm: float) -> None:
        """Zero entries that are not finite and shorten the gradient."""
        held = [parameter for parameter in parameters if parameter.grad is not None]
        norm = torch.nn.utils.get_total_norm([_gradient(one) for one in held])
        if not bool(torch.isfinite(norm)):
            self.mended_steps += 1
            for one in held:
                _gradient(one).nan_to_num_(nan=0.0, posinf=0.0, neginf=0.0)
            norm = torch.nn.utils.get_total_norm([_gradient(one) for one in held])
        if float(norm) > largest_norm:
            self.clipped_steps += 1
            torch.nn.utils.clip_grads_with_norm_(held, largest_norm, norm)

    def as_dict(self) -> dict[str, int]:
        """Return the counts."""
        return asdict(self)


def _gradient(parameter: nn.Parameter) -> Tensor:
    if parameter.grad is None:
        return torch.zeros_like(parameter)
    return parameter.grad
