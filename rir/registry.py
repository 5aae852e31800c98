"""A table of interchangeable things, found by name."""

import logging
import sys
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any, Generic, TypeVar

from rir.errors import ExtensionError, UnknownNameError
from rir.extension import Extension, find_extensions

__all__ = ["Registry"]

T = TypeVar("T")
LOG = logging.getLogger(__name__)


class Registry(Mapping[str, T], Generic[T]):
    """Map names to things of one kind, loudly.

    Our own things enter themselves by :meth:`add`. Those of other installed packages
    are found by entry points, when a name is asked for that is not ours or when the
    table is listed; each is imported when it is first used. One that cannot be used
    is an error to whoever asks for it by name, and one logged line in a list.

    Parameters
    ----------
    kind : str
        What the table holds, in the singular; used in messages.
    group : str
        Group of entry points of other packages; none are looked for when empty.
    of : type, optional
        What the things of other packages must be instances of.

    Examples
    --------
    >>> EFFECTS: Registry = Registry("effect")
    >>> @EFFECTS.add("air")
    ... def air(scene): return scene
    >>> list(EFFECTS)
    ['air']
    >>> EFFECTS["aire"]
    Traceback (most recent call last):
    rir.errors.UnknownNameError: no effect 'aire' (did you mean 'air'?); known: air
    """

    def __init__(self, kind: str, group: str = "", of: Any = None) -> None:
        self.kind = kind
        self.group = group
        self._of = of
        self._things: dict[str, T] = {}
        self._found: dict[str, list[Extension]] | None = None
        self._left_out: set[str] = set()

    def add(self, name: str) -> Callable[[T], T]:
        """Return a decorator that enters a thing under `name`.

        Raises
        ------
        ValueError
            If the name is taken: a table never overwrites silently.
        """

        def enter(thing: T) -> T:
            if name in self._things:
                raise ValueError(f"{self.kind} {name!r} is entered twice")
            self._things[name] = thing
            return thing

        return enter

    def __getitem__(self, name: str) -> T:
        if isinstance(name, str) and name in self._things:
            return self._things[name]
        extensions = self._extensions()
        if isinstance(name, str) and name in extensions:
            return self._load(extensions[name])
        known = sorted({*self._things, *extensions})
        near = get_close_matches(str(name), known, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        listed = ", ".join(known) or "none"
        raise UnknownNameError(f"no {self.kind} {name!r}{hint}; known: {listed}")

    def __contains__(self, name: object) -> bool:
        return name in self._things or (
            name in self._extensions() and name in self._usable()
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._usable())

    def __len__(self) -> int:
        return len(self._usable())

    def __repr__(self) -> str:
        return f"<{self.kind} table: {', '.join(self._things)}>"

    def _usable(self) -> list[str]:
        """Return the names, after those of other packages have been imported."""
        for name, extensions in self._extensions().items():
            if name in self._things or name in self._left_out:
                continue
            try:
                self._load(extensions)
            except ExtensionError as error:
                self._leave_out(name, str(error))
        return list(self._things)

    def _load(self, extensions: list[Extension]) -> T:
        first, *others = extensions
        if others:
            rivals = " and ".join(one.origin for one in extensions)
            raise ExtensionError(
                f"{self.kind} {first.name!r} is offered by {rivals}; uninstall all "
                "but one"
            )
        return self._things.setdefault(first.name, first.load(self._of))

    def _extensions(self) -> dict[str, list[Extension]]:
        if self._found is None:
            self._found = {}
            for one in find_extensions(self.kind, self.group) if self.group else ():
                if one.name not in self._things:
                    self._found.setdefault(one.name, []).append(one)
                elif not self._is_entered(one):
                    reason = "the name belongs to resounding itself"
                    self._leave_out(one.name, f"{one.label}: {reason}")
        return self._found

    def _is_entered(self, one: Extension) -> bool:
        """Say whether the thing has entered itself, as ours do."""
        if one.point.module not in sys.modules:
            return False
        try:
            return one.load() is self._things[one.name]
        except ExtensionError:
            return False

    def _leave_out(self, name: str, reason: str) -> None:
        self._left_out.add(name)
        LOG.warning("left out: %s", reason)
