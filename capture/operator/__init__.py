"""What the operator sees of a session: a live screen, or plain lines."""

from typing import TYPE_CHECKING

from capture.operator.display import PlainDisplay
from capture.operator.screen import LiveScreen

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["LiveScreen", "PlainDisplay", "make_display"]


def make_display(console: "Console", *, simulated: bool, plain: bool) -> PlainDisplay:
    """Return the display that suits the console."""
    if plain or not console.is_terminal:
        return PlainDisplay(console, simulated=simulated)
    return LiveScreen(console, simulated=simulated)
