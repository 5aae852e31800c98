"""Public names that are loaded on first use, so that commands start fast."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

__all__ = ["lazy_names"]


def lazy_names(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and ``__dir__`` of a package with lazy names.

    Parameters
    ----------
    package : str
        Name of the package.
    homes : mapping
        Module to the names that live there, separated by blanks.

    Examples
    --------
    >>> look_up, names = lazy_names("demo", {"math": "tau pi"})
    >>> look_up("pi"), names()
    (3.141592653589793, ['pi', 'tau'])
    """
    home_of = {name: home for home, names in homes.items() for name in names.split()}

    def look_up(name: str) -> Any:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(home_of[name]), name)

    return look_up, lambda: sorted(home_of)
