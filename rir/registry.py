"""A table of interchangeable things, found by name."""

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Generic, TypeVar

from rir.errors import UnknownNameError

__all__ = ["Registry"]

T = TypeVar("T")


class Registry(Mapping[str, T], Generic[T]):
    """Map names to things of one kind, loudly.

    Parameters
    ----------
    kind : str
        What the table holds, in the singular; used in messages.

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

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._things: dict[str, T] = {}

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
        near = get_close_matches(str(name), self._things, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        known = ", ".join(sorted(self._things)) or "none"
        raise UnknownNameError(f"no {self.kind} {name!r}{hint}; known: {known}")

    def __contains__(self, name: object) -> bool:
        return name in self._things

    def __iter__(self) -> Iterator[str]:
        return iter(self._things)

    def __len__(self) -> int:
        return len(self._things)

    def __repr__(self) -> str:
        return f"<{self.kind} table: {', '.join(self._things)}>"
