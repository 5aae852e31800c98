"""One damped Gauss-Newton step of the late maps, with the exact Jacobian.

The derivative of a log energy by a weight is a function of time times a function
of the two ends. Sums over time are therefore taken first, and a step costs the
same however many bins there are.
"""

from dataclasses import dataclass

import numpy as np

__all__ = ["DerivativeSums", "descend"]


@dataclass(frozen=True, eq=False)
class DerivativeSums:
    """Hold sums over time of the residuals' derivatives."""

    second: np.ndarray
    """Products of the derivatives, shape (slopes, slopes, pairs)."""
    first: np.ndarray
    """Derivatives times residuals, shape (slopes, pairs)."""
    pull: np.ndarray
    """Gradient of the level's penalty, shape (features,)."""
    hold: np.ndarray
    """Gradient of the shares' penalty, shape (slopes - 1, features)."""

    @classmethod
    def of(
        cls,
        parts: list[np.ndarray],
        gap: np.ndarray,
        pull: np.ndarray,
        hold: np.ndarray,
    ) -> "DerivativeSums":
        """Sum the derivatives, each (pairs, bins), and residuals over time."""
        stack = np.stack(parts)
        second = np.einsum("knt,lnt->kln", stack, stack)
        return cls(second, np.einsum("knt,nt->kn", stack, gap), pull, hold)


def descend(
    moments: DerivativeSums,
    ends: tuple[np.ndarray, np.ndarray],
    shares: np.ndarray,
    penalties: tuple[np.ndarray, np.ndarray],
    damping: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the change of the level, (features,), and of the shares."""
    first, second = ends
    rows = [first + second]
    rows += [
        first * (second @ one)[:, None] + second * (first @ one)[:, None]
        for one in shares
    ]
    width, kinds = first.shape[1], len(rows)
    normal = np.empty((kinds * width, kinds * width))
    right = np.empty(kinds * width)
    pulls = [moments.pull, *moments.hold]
    for k, row in enumerate(rows):
        here = slice(k * width, (k + 1) * width)
        right[here] = row.T @ moments.first[k] - pulls[k]
        for other in range(k, kinds):
            there = slice(other * width, (other + 1) * width)
            block = (row * moments.second[k, other][:, None]).T @ rows[other]
            normal[here, there] = block
            normal[there, here] = block.T
    normal[np.diag_indices_from(normal)] += np.concatenate(
        [penalties[0], *[penalties[1]] * (kinds - 1)]
    )
    diagonal = np.diag_indices_from(normal)
    normal[diagonal] *= 1 + damping
    step = np.linalg.solve(normal, right).reshape(kinds, width)
    return step[0], step[1:]
