"""The table of checks."""

from collections.abc import Callable, Iterator

from capture.checks.evidence import Evidence
from capture.checks.finding import Verdict
from rir.registry import Registry

__all__ = ["CHECKS", "Check"]

Check = Callable[[Evidence], Iterator[Verdict]]

CHECKS: Registry[Check] = Registry("check", "resounding.checks", Callable)
