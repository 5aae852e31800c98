"""Configuration from YAML: checked as a whole, every mistake told at once."""

from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from rir.errors import ConfigError
from rir.schema import Schema

__all__ = ["StrictModel", "dump_yaml", "load_yaml", "parse_yaml", "validate"]


class StrictModel(BaseModel):
    """Parent of every configuration model: frozen, unknown keys are mistakes."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)


ConfigT = TypeVar("ConfigT", bound=BaseModel)


def parse_yaml(text: str, *, origin: str = "text") -> Any:
    """Parse YAML safely.

    Raises
    ------
    ConfigError
        If the text is not YAML; names the line.
    """
    import yaml

    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        place = " ".join(str(error).split())
        raise ConfigError(f"{origin} is not valid YAML: {place}") from error


def dump_yaml(value: Any) -> str:
    """Return plain YAML of a model or of plain data, keys in their own order."""
    import yaml

    plain = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
    return yaml.safe_dump(plain, sort_keys=False, allow_unicode=True)


def load_yaml(
    path: str | Path, model: type[ConfigT], schema: Schema | None = None
) -> ConfigT:
    """Read a YAML file into a model, brought up to date where it has a schema.

    Raises
    ------
    ConfigError
        If the file cannot be read, or with one line per mistake, each with the
        path of its key.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read {path}: {error}") from error
    data = parse_yaml(text, origin=str(path))
    if schema is not None:
        data = schema.open({} if data is None else data, path)
    return validate(data, model, origin=str(path))


def validate(data: Any, model: type[ConfigT], *, origin: str) -> ConfigT:
    """Check plain data against a model.

    Raises
    ------
    ConfigError
        With one line per mistake.

    Examples
    --------
    >>> class Sweep(StrictModel):
    ...     seconds: float
    >>> validate({"secnds": 3}, Sweep, origin="s.yaml")
    Traceback (most recent call last):
    rir.errors.ConfigError: s.yaml has 2 mistakes:
      seconds: Field required
      secnds: unknown key (did you mean 'seconds'?)
    """
    try:
        return model.model_validate({} if data is None else data)
    except ValidationError as error:
        lines = [_describe(problem, model) for problem in _told(error.errors())]
        count = f"{len(lines)} mistake" + ("s" if len(lines) > 1 else "")
        raise ConfigError("\n  ".join([f"{origin} has {count}:", *lines])) from error


def _told(problems: list[Any]) -> list[Any]:
    """Leave out that a value is not the one word that could stand in its place."""
    told = [p for p in problems if not _is_word(p)]
    return told + [p for p in problems if _is_word(p) and not _has_other(p, told)]


def _is_word(problem: Any) -> bool:
    return problem["type"] == "literal_error" and _is_branch(problem["loc"][-1])


def _has_other(problem: Any, told: list[Any]) -> bool:
    place = problem["loc"][:-1]
    return any(other["loc"][: len(place)] == place for other in told)


def _is_branch(part: Any) -> bool:
    # of several sorts of value, pydantic names the one that it tried, as "literal[x]"
    return "[" in str(part)


def _describe(problem: Any, model: type[BaseModel]) -> str:
    parts = [str(part) for part in problem["loc"] if not _is_branch(part)]
    path = ".".join(parts) or "(whole file)"
    if problem["type"] == "model_type":
        sort = type(problem["input"]).__name__
        article = "an" if sort[0] in "aeiou" else "a"
        return f"{path}: should hold keys and values, not {article} {sort}"
    if problem["type"] == "union_tag_invalid":
        tag, known = problem["ctx"]["tag"], problem["ctx"]["expected_tags"]
        return f"{path}: no kind {tag!r}; known: {known.replace(chr(39), '')}"
    if problem["type"] != "extra_forbidden":
        given = problem.get("input")
        shown = f" (got {given!r})" if isinstance(given, str | int | float) else ""
        return f"{path}: {problem['msg']}{shown}"
    known = _keys_at(model, problem["loc"][:-1])
    near = get_close_matches(str(problem["loc"][-1]), known, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    hint = hint or (f"; known: {', '.join(known)}" if known else "")
    return f"{path}: unknown key{hint}"


def _keys_at(model: type[BaseModel], place: tuple[Any, ...]) -> list[str]:
    """Return the keys that a nested place of a model knows."""
    current: Any = model
    for part in place:
        if not (isinstance(current, type) and issubclass(current, BaseModel)):
            return []
        entry = current.model_fields.get(str(part))
        current = entry.annotation if entry else None
    if isinstance(current, type) and issubclass(current, BaseModel):
        return list(current.model_fields)
    return []
