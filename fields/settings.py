"""A model's configuration from a preset and what a person sets beside it."""

import math
from collections.abc import Mapping
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin, get_type_hints

from fields.table import FIELDS
from rir.errors import ConfigError

__all__ = ["exchange_form", "model_config", "self_supervised_form"]

COUNTS = frozenset(
    [
        "bounce_points",
        "channels",
        "depth",
        "directions",
        "feature_width",
        "grid_features",
        "neighbours",
        "rays",
        "scan_rows",
        "shells",
        "source_taps",
        "view_columns",
        "view_rows",
        "width",
    ]
)
# Above these, sinusoids and grids resolve less than float32 does.
MOST = {"octaves": 24, "distance_octaves": 24, "hash_levels": 24}
LEAST = {"grid_spacing": 0.01}
SELF_SUPERVISED = ("none", "pattern", "teacher", "paper", "contrastive")


def model_config(model: str, values: Mapping[str, Any], preset: str = "cpu") -> Any:
    """Build a model's configuration from a preset and the values that differ.

    Raises
    ------
    ConfigError
        If the preset, a name or a value is unknown, with all mistakes at once.
    """
    presets = FIELDS[model].load_module().PRESETS
    if preset not in presets:
        raise ConfigError(
            f"{model} has no preset {preset!r}; known: {', '.join(presets)}"
        )
    if not isinstance(values, Mapping):
        raise ConfigError(f"settings are name and value pairs, not {values!r}")
    start = presets[preset]
    plain = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in values.items()
    }
    known = {one.name for one in dataclass_fields(start)}
    kinds = get_type_hints(type(start))
    mistakes = [
        f"{name}: {problem}"
        for name, value in plain.items()
        if (
            problem := _unfit(name, value, getattr(start, name), kinds[name])
            if name in known
            else f"{model} has no such setting{_hint(str(name), known)}"
        )
    ]
    if mistakes:
        raise ConfigError("\n".join(mistakes))
    return replace(start, **plain)


def _unfit(name: str, value: Any, default: Any, kind: Any) -> str:
    """Say why a value cannot stand where ``default`` stands."""
    if get_origin(kind) is Literal:
        choices = get_args(kind)
        known = ", ".join(map(str, choices))
        # 1 equals True, but is no switch.
        held = any(type(value) is type(one) and value == one for one in choices)
        return "" if held else f"no {value!r}; known: {known}"
    kinds = (int, float) if isinstance(default, float) else (type(default),)
    # True is an int to Python, but no number to a person.
    switched = isinstance(value, bool) and not isinstance(default, bool)
    if switched or not isinstance(value, kinds):
        return f"{value!r} is not {type(default).__name__}, as {default!r} is"
    if isinstance(value, int | float):
        return _out_of_range(name, value)
    return ""


def _out_of_range(name: str, value: float) -> str:
    least = LEAST.get(name, 1 if name in COUNTS else 0)
    if not value >= least:
        return f"{value!r} is below {least}"
    if not value <= MOST.get(name, math.inf) or value == math.inf:
        return f"{value!r} is above {MOST.get(name, 'all bounds')}"
    return ""


def _hint(name: str, known: set[str]) -> str:
    near = get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else f"; known: {sorted(known)}"


def exchange_form(exchange: bool | str) -> str:
    """Return none, flip or double.

    Raises
    ------
    ConfigError
        If the form is unknown.
    """
    if isinstance(exchange, bool):
        return "double" if exchange else "none"
    if exchange in ("none", "flip", "double"):
        return exchange
    raise ConfigError(f"no exchange {exchange!r}; known: none, flip, double")


def self_supervised_form(form: bool | str) -> str:
    """Return the name of the reciprocity loss; True is "pattern".

    Raises
    ------
    ConfigError
        If the form is unknown.
    """
    if isinstance(form, bool):
        return "pattern" if form else "none"
    if form in SELF_SUPERVISED:
        return form
    raise ConfigError(
        f"no self-supervised form {form!r}; known: {', '.join(SELF_SUPERVISED)}"
    )
