"""What a simulation is asked for, checked before any work begins."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rir.errors import SceneError, SignalError
from rir.numbers import read_count, read_number, shown
from rir.response import check_sample_rate
from rooms.sound import Budget

__all__ = ["check_effort", "check_kind", "check_names", "make_budget", "make_seed"]

# Far beyond any use, and safe from overflow: more is a slip of the pen.
_LONGEST_S = 3600.0
_MOST_SAMPLES = 2_000_000_000
_HIGHEST_ORDER = 10**6
_MOST_RAYS = 2_000_000_000


def check_kind(value: Any, kind: type | tuple[type, ...], what: str, hint: str) -> None:
    """Raise `SceneError` unless a value is of a kind."""
    if not isinstance(value, kind):
        raise SceneError(
            f"{what} cannot be {type(value).__name__} {shown(value)}; {hint}"
        )


def check_names(names: Any, what: str) -> None:
    """Raise `SignalError` unless these are a sequence of names, or None."""
    listed = isinstance(names, Sequence) and not isinstance(names, str | bytes)
    if names is None or (listed and all(isinstance(name, str) for name in names)):
        return
    raise SignalError(
        f"{what} are a list of names of effects, not {shown(names)}; write"
        " ['direct', 'specular']"
    )


def make_budget(
    sample_rate: Any, duration: Any, max_order: Any, rays: Any, seed: Any = 0
) -> Budget:
    """Return a checked budget.

    Raises
    ------
    SignalError
        If a part is no number, or out of its range.
    """
    rate = check_sample_rate(sample_rate)
    length = read_number(duration, "a duration [s]", above=0, most=_LONGEST_S)
    count = round(length * rate)
    if not 1 <= count <= _MOST_SAMPLES:
        raise SignalError(
            f"a duration of {length:g} s at {rate} Hz holds {count} samples; between"
            f" 1 and {_MOST_SAMPLES:.0e} can be simulated"
        )
    if max_order is not None:
        max_order = read_count(max_order, "the order", most=_HIGHEST_ORDER)
    if rays is not None:
        rays = read_count(rays, "the number of rays", least=1, most=_MOST_RAYS)
    return Budget(rate, count, max_order, rays, make_seed(seed))


def make_seed(seed: Any, rng: Any = None) -> int:
    """Return the key of everything random, drawn from a generator if there is one."""
    if rng is not None:
        check_kind(
            rng, np.random.Generator, "rng", "give np.random.default_rng(seed), or seed"
        )
        return int(rng.integers(2**63))
    return read_count(seed, "a seed", least=-(2**1024), most=2**1024) % 2**63


def check_effort(accuracy: Any, seconds: Any, threads: Any, dtype: Any) -> None:
    """Raise `SignalError` unless these say how hard to work, and in what numbers."""
    if accuracy is not None and not isinstance(accuracy, str | Mapping):
        raise SignalError(
            f"an accuracy is text or a mapping, not {shown(accuracy)}; write"
            " 'C50 0.1 dB' or {'C50': 0.1}"
        )
    if seconds is not None:
        read_number(seconds, "the processor time to spend [s]", above=0)
    read_count(threads, "the number of threads", least=1, most=1024)
    named = isinstance(dtype, type | str | np.dtype)
    if not named or dtype not in (float, np.float64, np.float32, "float64", "float32"):
        raise SignalError(f"dtype is np.float64 or np.float32, not {shown(dtype)}")
