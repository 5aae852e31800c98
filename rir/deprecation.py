"""What still works but will go, with the version that it goes in."""

import warnings
from dataclasses import dataclass

__all__ = ["DEPRECATIONS", "DeprecatedWarning", "Deprecation", "warn_deprecated"]


class DeprecatedWarning(FutureWarning):
    """Something that was used goes in a later version."""


@dataclass(frozen=True)
class Deprecation:
    """One name that goes."""

    instead: str
    """What to use."""
    removed_in: str
    """Version in which the name is gone; a test fails once the project has it."""


DEPRECATIONS = {
    f"capture-pairs {old}": Deprecation(f"capture-pairs {new}", "0.3.0")
    for old, new in {
        "--dry-run": "plan",
        "--check": "check",
        "--list-devices": "devices",
        "--rebuild": "rebuild",
        "--cost": "cost",
    }.items()
}
"""All that goes, by name. A flag or public name stays for one minor version."""


def warn_deprecated(name: str) -> None:
    """Warn in one line that a name of `DEPRECATIONS` was used.

    Examples
    --------
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     warn_deprecated("capture-pairs --check")
    >>> print(told[0].message)
    capture-pairs --check goes in version 0.3.0: use capture-pairs check
    """
    known = DEPRECATIONS[name]
    warnings.warn(
        f"{name} goes in version {known.removed_in}: use {known.instead}",
        DeprecatedWarning,
        stacklevel=3,
    )
