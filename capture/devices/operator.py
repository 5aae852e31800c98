"""The person who looks after a session, as the devices know them."""

from typing import Protocol

__all__ = ["ConsentingOperator", "Operator"]


class Operator(Protocol):
    """Who answers questions and reads what is said."""

    def ask(self, text: str) -> str:
        """Show a text, wait for a line and return it."""
        ...

    def say(self, text: str) -> None:
        """Show a text."""
        ...


class ConsentingOperator:
    """An operator who has said yes to everything beforehand.

    Parameters
    ----------
    operator : Operator
        Is shown what was asked and answered.
    """

    def __init__(self, operator: Operator) -> None:
        self._operator = operator

    def ask(self, text: str) -> str:
        """Show the question and answer yes."""
        self.say(f"{text} yes")
        return "yes"

    def say(self, text: str) -> None:
        """Show a text."""
        self._operator.say(text)
