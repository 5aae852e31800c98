"""The table of checks."""

from collections.abc import Callable, Iterator

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from rir.registry import Registry

__all__ = ["CHECKS", "Check"]

Check = Callable[[Evidence], Iterator[Finding]]

CHECKS: Registry[Check] = Registry("check", "resounding.checks", Callable)
