"""Learn acoustic fields and hear a room from any emitter.

Importing this package never imports torch; a neural model imports it when it
is trained or loaded. Names are loaded on first use, so that commands start
fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fields.field import Directional, Field, load_field
    from fields.run import train
    from fields.table import FIELDS

_HOME_OF = {
    "Directional": "fields.field",
    "FIELDS": "fields.table",
    "Field": "fields.field",
    "load_field": "fields.field",
    "train": "fields.run",
}

__all__ = ["FIELDS", "Directional", "Field", "load_field", "train"]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'fields' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
