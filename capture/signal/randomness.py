"""Random numbers that belong to a take, whenever and however often it is made."""

import hashlib

import numpy as np

__all__ = ["take_rng"]


def take_rng(seed: int, label: str) -> np.random.Generator:
    """Return the random numbers of a take, the same whenever it is repeated.

    Examples
    --------
    >>> a, b = (take_rng(7, "P01_AB_1").random() for _ in range(2))
    >>> a == b
    True
    """
    digest = hashlib.sha256(label.encode()).digest()
    key = tuple(int(word) for word in np.frombuffer(digest, dtype=np.uint32))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
