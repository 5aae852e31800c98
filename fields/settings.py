"""Settings of a model: a frozen data class whose annotations say what may be set."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from difflib import get_close_matches
from typing import Annotated, Any, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field, ValidationError
from pydantic.dataclasses import dataclass

from rir.errors import ConfigError

__all__ = ["Count", "change_settings", "settings"]

T = TypeVar("T")
Count = Annotated[int, Field(ge=1)]
"""A whole number, one at least."""
STRICT = ConfigDict(strict=True, allow_inf_nan=False)
"""Nothing is converted in silence: True is no number, 2.5 no count."""


@dataclass_transform(frozen_default=True, field_specifiers=(Field,))
def settings(kind: type[T]) -> type[T]:
    """Make a class of annotated names the settings of a model.

    Examples
    --------
    >>> @settings
    ... class Config:
    ...     width: Count = 256
    >>> change_settings(Config(), {"width": 0, "dept": 3}, "my-model")
    Traceback (most recent call last):
    rir.errors.ConfigError: dept: my-model has no such setting; known: ['width']
    width: 0 is below 1
    """
    made: Any = dataclass(frozen=True, config=STRICT)(kind)
    return made


def change_settings(start: T, values: Mapping[str, Any], owner: str) -> T:
    """Return settings in which some values are others.

    Parameters
    ----------
    start : object
        Settings, of a class made by :func:`settings`.
    values : mapping
        What differs, by name.
    owner : str
        The model, for messages.

    Raises
    ------
    ConfigError
        If a name or a value is unknown, with all mistakes at once.
    """
    if not isinstance(values, Mapping):
        raise ConfigError(f"settings are name and value pairs, not {values!r}")
    usual: dict[Any, Any] = asdict(start)  # pyright: ignore[reportArgumentType]
    mistakes = [
        f"{name}: {owner} has no such setting{_hint(str(name), usual)}"
        for name in values
        if name not in usual
    ]
    plain = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in values.items()
        if name in usual
    }
    changed = start
    try:
        changed = replace(start, **plain)  # pyright: ignore[reportArgumentType]
    except ValidationError as error:
        mistakes += [_describe(problem, usual) for problem in error.errors()]
    if mistakes:
        raise ConfigError("\n".join(mistakes))
    return changed


def _describe(problem: Any, usual: Mapping[str, Any]) -> str:
    """Say why a value cannot stand where the usual one stands."""
    name, value, limits = problem["loc"][0], problem["input"], problem.get("ctx", {})
    match problem["type"]:
        case "greater_than_equal":
            return f"{name}: {value!r} is below {limits['ge']}"
        case "less_than_equal":
            return f"{name}: {value!r} is above {limits['le']}"
        case "finite_number":
            return f"{name}: {value!r} is not finite"
        case "literal_error":
            known = limits["expected"].replace(" or ", ", ").replace("'", "")
            return f"{name}: no {value!r}; known: {known}"
        case kind if kind.endswith(("_type", "_from_float")):
            sort = type(usual[name]).__name__
            return f"{name}: {value!r} is not {sort}, as {usual[name]!r} is"
    return f"{name}: {problem['msg']} (got {value!r})"


def _hint(name: str, known: Mapping[str, Any]) -> str:
    near = get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else f"; known: {sorted(known)}"
