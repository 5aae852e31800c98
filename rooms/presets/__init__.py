"""Rooms that come with the program."""

from importlib.resources import files
from pathlib import Path

from rir import RoomSpec
from rir.config import parse_yaml, validate
from rir.errors import ConfigError, UnknownNameError

__all__ = ["PRESETS", "load_room"]

PRESETS = ("kitchen", "conference", "office")


def load_room(name_or_path: str | Path) -> RoomSpec:
    """Return a preset by name, or the room of a YAML file.

    Parameters
    ----------
    name_or_path : str or Path
        One of `PRESETS`, or a path ending in .yaml or .yml.

    Raises
    ------
    UnknownNameError
        If it is neither.
    ConfigError
        If the file has mistakes.

    Examples
    --------
    >>> load_room("kitchen").name
    'kitchen'
    """
    name = str(name_or_path)
    if name in PRESETS:
        text = files("rooms.presets").joinpath(f"{name}.yaml").read_text("utf-8")
        return validate(parse_yaml(text, origin=name), RoomSpec, origin=name)
    if Path(name).suffix in (".yaml", ".yml"):
        return RoomSpec.load(name)
    if Path(name).exists():
        raise ConfigError(f"{name} is not a room file; rooms end in .yaml")
    raise UnknownNameError(
        f"no room {name!r}; known: {', '.join(PRESETS)}, or a path to a .yaml file"
    )
