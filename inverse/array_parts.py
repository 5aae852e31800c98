"""Arrays of a part under the part's name, as a file holds them."""

from typing import Any

import numpy as np

__all__ = ["part_of", "prefixed"]


def prefixed(prefix: str, arrays: dict[str, Any]) -> dict[str, Any]:
    """Put the part's name before each array's.

    Examples
    --------
    >>> prefixed("box", {"high": 3})
    {'box.high': 3}
    """
    return {f"{prefix}.{name}": value for name, value in arrays.items()}


def part_of(arrays: dict[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays of one part, by their own names; empty where it has none."""
    start = f"{prefix}."
    return {k[len(start) :]: v for k, v in arrays.items() if k.startswith(start)}
