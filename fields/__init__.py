"""Learn acoustic fields and hear a room from any emitter.

Importing this package never imports torch; a neural model imports it when it
is trained or loaded. Names are loaded on first use, so that commands start
fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from fields.field import Directional, Field, load_field
    from fields.run import train
    from fields.table import FIELDS

__all__ = ["FIELDS", "Directional", "Field", "load_field", "train"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fields.field": "Directional Field load_field",
        "fields.run": "train",
        "fields.table": "FIELDS",
    },
)
