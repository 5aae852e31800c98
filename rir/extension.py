"""What other installed packages add to a table, found by entry points."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rir.errors import ExtensionError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["Extension", "find_extensions"]


@dataclass(frozen=True)
class Extension:
    """One entry point of an installed package."""

    kind: str
    """What the table holds, in the singular."""
    name: str
    """Name in the table."""
    origin: str
    """Package, version and object, for messages."""
    point: "EntryPoint"
    """Loads the object."""

    @property
    def label(self) -> str:
        """The extension in words."""
        return f"{self.kind} {self.name!r} of {self.origin}"

    def load(self, of: type | None = None) -> Any:
        """Import the object.

        Raises
        ------
        ExtensionError
            If it cannot be imported, or is no `of`.
        """
        try:
            thing = self.point.load()
        # A package of others may fail in any way, even end the program as a script
        # does, and must not take us with it.
        except (Exception, SystemExit) as error:
            cause = " ".join(f"{type(error).__name__}: {error}".split())
            raise ExtensionError(f"{self.label} cannot be loaded: {cause}") from error
        if of is not None and not isinstance(thing, of):
            raise ExtensionError(
                f"{self.label} is a {type(thing).__name__}; the table holds objects "
                f"of {of.__module__}.{of.__qualname__}"
            )
        return thing


def find_extensions(kind: str, group: str) -> list[Extension]:
    """Return what installed packages offer in a group, by name; nothing is imported.

    Parameters
    ----------
    kind : str
        What the table holds, in the singular.
    group : str
        Group of entry points, such as resounding.checks.
    """
    from importlib.metadata import entry_points

    points = sorted(entry_points(group=group), key=lambda point: point.name)
    return [Extension(kind, point.name, _origin(point), point) for point in points]


def _origin(point: "EntryPoint") -> str:
    package = point.dist
    title = f"{package.name} {package.version}" if package else "an unnamed package"
    return f"{title} ({point.value})"
