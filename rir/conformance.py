"""Promises that every thing of a table keeps: what the conformance tests share.

Each package has a module ``conformance`` with one function a kind, such as
:func:`fields.conformance.check_field`. A function returns nothing where all promises
are kept, and raises AssertionError with the first that is not: call it from any test.
"""

from collections.abc import Callable
from typing import Any

__all__ = ["promise", "refusal"]


def promise(kept: Any, words: str) -> None:
    """Raise AssertionError with `words` unless a promise is kept.

    Examples
    --------
    >>> promise(1 < 2, "one is below two")
    >>> promise(1 > 2, "one is above two")
    Traceback (most recent call last):
    AssertionError: promised: one is above two
    """
    if not kept:
        raise AssertionError(f"promised: {words}")


def refusal(
    error: type[Exception] | tuple[type[Exception], ...], call: Callable[[], object]
) -> str:
    """Return the message with which a call is refused.

    Raises
    ------
    AssertionError
        If the call succeeds.
    """
    try:
        call()
    except error as refused:
        return str(refused)
    raise AssertionError("promised: bad input is refused, and it was taken")
