"""Numbers from whatever a person passes in, or one clear error."""

import operator
import warnings
from typing import Any

import numpy as np

from rir.arrays import FloatArray
from rir.errors import ResoundingError, SignalError

__all__ = ["read_array", "read_count", "read_number", "shown"]

_LONGEST = 60  # characters: a message with the value stays one line


def shown(value: Any) -> str:
    """Return a value as it stands in a message: on one line, cut if long.

    Examples
    --------
    >>> shown("x" * 100)[-5:]
    'xxxx…'
    """
    try:
        text = " ".join(repr(value).split())
    # an integer of more digits than Python prints
    except ValueError:
        text = f"a {type(value).__name__} too long to show"
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"


def read_array(
    value: Any, what: str, hint: str = "", error: type[ResoundingError] = SignalError
) -> FloatArray:
    """Return real numbers as a new array of float64; they need not be finite.

    Parameters
    ----------
    value : array_like
        Numbers of any shape.
    what : str
        What they are, for the message.
    hint : str
        What to give instead; ends the message.
    error : type
        Error to raise.

    Raises
    ------
    SignalError
        Or `error`, if they are not real numbers or rows have unequal lengths.

    Examples
    --------
    >>> read_array("abc", "a size", "give three lengths")
    Traceback (most recent call last):
    rir.errors.SignalError: a size must be numbers, not str 'abc'; give three lengths
    """
    advice = f"; {hint}" if hint else ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            raw = np.asarray(value)
            if raw.dtype.kind in "OSUVmM":
                _refuse_text(value)
            return np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError, Warning) as cause:
        complex_ = getattr(getattr(value, "dtype", None), "kind", "") == "c"
        kind = "complex" if complex_ else type(value).__name__
        told = f"{what} must be numbers, not {kind} {shown(value)}{advice}"
        raise error(told) from cause


def _refuse_text(value: Any) -> None:
    """Raise `TypeError` for what NumPy would read as numbers though it is none."""
    if isinstance(value, str | bytes | dict | set):
        raise TypeError
    flat = np.asarray(value, dtype=object).ravel()
    if any(isinstance(part, str | bytes | np.datetime64) for part in flat):
        raise TypeError


def read_number(
    value: Any,
    what: str,
    *,
    least: float = -np.inf,
    above: float = -np.inf,
    most: float = np.inf,
    error: type[ResoundingError] = SignalError,
) -> float:
    """Return one finite real number within limits.

    Parameters
    ----------
    value : float
        The number.
    what : str
        What it is, with its unit, for the message.
    least, above, most : float
        The number is at least `least`, above `above`, and at most `most`.
    error : type
        Error to raise.

    Examples
    --------
    >>> read_number(-1, "a height [m]", above=0)
    Traceback (most recent call last):
    rir.errors.SignalError: a height [m] must be one number above 0, not -1
    """
    bounds = [f" above {above:g}"] if above > -np.inf else []
    bounds += [f" of at least {least:g}"] if least > -np.inf else []
    bounds += [f" of at most {most:g}"] if most < np.inf else []
    told = f"{what} must be one number{','.join(bounds)}, not {shown(value)}"
    if value is None or isinstance(value, complex):
        raise error(told)
    array = read_array(value, what, error=error)
    if array.ndim or not np.isfinite(array).all():
        raise error(told)
    number = float(array)
    if not (number >= least and number > above and number <= most):
        raise error(told)
    return number


def read_count(
    value: Any,
    what: str,
    *,
    least: int = 0,
    most: int = 2**62,
    error: type[ResoundingError] = SignalError,
) -> int:
    """Return a whole number within limits.

    Examples
    --------
    >>> read_count(0, "the number of rays", least=1)
    Traceback (most recent call last):
    rir.errors.SignalError: the number of rays must be 1 or more, not 0
    """
    told = f"{what} must be a whole number, {least} or more, not {shown(value)}"
    try:
        number = operator.index(value)
    except TypeError as cause:
        if not isinstance(value, float | np.floating) or value != np.round(value):
            raise error(told) from cause
        number = int(read_number(value, what, error=error))
    if number < least:
        raise error(f"{what} must be {least} or more, not {shown(value)}")
    if number > most:
        raise error(f"{what} must be {most} or less, not {shown(value)}")
    return number
