"""One screen without scrolling: what the session does now, and how it went so far."""

from collections import deque
from typing import TYPE_CHECKING, Any

from capture.operator.display import PlainDisplay, pair_line, take_line, time_text
from capture.plan import Move, SessionPlan, Wait
from capture.session.journal import Event

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

__all__ = ["LiveScreen", "level_style", "meter", "sparkline"]

LOG_LINES = 5  # screen and log fit 24 lines
METER_WIDTH = 30  # 2 dB a mark over 60 dB
QUIETEST_DB = -60.0  # below it no take is of use
BLOCKS = "▁▂▃▄▅▆▇█"
STATES = {
    "MOVE": "black on cyan",
    "WAIT": "black on white",
    "PLAYING": "white on blue",
    "CHECKING": "black on yellow",
    "FAULT": "white on red",
    "DONE": "black on green",
}


def level_style(peak_dbfs: float) -> str:
    """Return the colour of a level: red hot, green good, amber quiet.

    Examples
    --------
    >>> [level_style(level) for level in (-3, -20, -50)]
    ['red', 'green', 'yellow']
    """
    if peak_dbfs > -6:
        return "red"
    return "green" if peak_dbfs >= -40 else "yellow"


def meter(peak_dbfs: float) -> str:
    """Return a bar for a level, empty at -60 dBFS and full at 0.

    Examples
    --------
    >>> meter(-30).count("█"), len(meter(-30))
    (15, 30)
    """
    share = min(1.0, max(0.0, 1 - peak_dbfs / QUIETEST_DB))
    full = round(share * METER_WIDTH)
    return "█" * full + "·" * (METER_WIDTH - full)


def sparkline(values: list[float]) -> str:
    """Return values as a row of small blocks, lowest to highest.

    Examples
    --------
    >>> sparkline([20.0, 20.1, 20.2])
    '▁▅█'
    """
    if not values:
        return ""
    low, span = min(values), max(values) - min(values)
    steps = len(BLOCKS) - 1
    return "".join(
        BLOCKS[int((value - low) / span * steps + 0.5) if span else 0]
        for value in values
    )


class LiveScreen(PlainDisplay):
    """The live display: state, meters, progress, last take, pairs, temperature."""

    def __init__(self, console: "Console", *, simulated: bool) -> None:
        from rich.live import Live

        super().__init__(console, simulated=simulated)
        self.state = "WAIT"
        self.place = ""
        self.peaks: list[float] = []
        self.last: Event = {}
        self.pair: Event = {}
        self.temperatures: deque[float] = deque(maxlen=40)
        self.verdicts: dict[str, str] = {}
        self.log: deque[str] = deque(maxlen=LOG_LINES)
        self.played_s = self.take_s = 0.0
        self._live = Live(console=console, auto_refresh=False, transient=False)

    def show(self, event: Event) -> None:
        """Take note of an event and draw the screen anew."""
        super().show(event)
        self._follow(event)
        if self._live.is_started:
            self._live.update(self.render(), refresh=True)

    def say(self, text: str, style: str = "") -> None:
        """Put a line into the log, or print it while no screen is shown."""
        if self._live.is_started:
            self.log.append(f"[{style}]{_plain(text)}[/]" if style else _plain(text))
        else:
            super().say(text, style)

    def start(self, plan: SessionPlan) -> None:
        """Show the screen."""
        self._plan = plan
        for step in plan.measures:
            self.verdicts.setdefault(step.pair, "·")
        self._live.start()

    def progress(self, samples: int, sample_rate: int) -> None:
        """Show how far the take has come."""
        self.played_s = samples / sample_rate
        if self._live.is_started:
            self._live.update(self.render(), refresh=True)

    def ask(self, text: str) -> str:
        """Take the screen away while the operator types."""
        self._live.stop()
        try:
            return super().ask(text)
        finally:
            self._live.start()

    def prefix(self) -> str:
        """Return nothing: the screen says it."""
        return ""

    def _follow(self, event: Event) -> None:
        kind = event["event"]
        if kind == "step":
            self._follow_step(event["step"])
        elif kind == "playing":
            self.state, self.take_s, self.played_s = "PLAYING", event["seconds"], 0.0
        elif kind == "recorded":
            self.state, self.peaks = "CHECKING", event["peak_dbfs"]
        elif kind == "take_started":
            temperature = event["air"]["temperature_c"]
            if temperature is not None and temperature == temperature:
                self.temperatures.append(temperature)
        elif kind == "take_finished":
            self.last = event
            self.state = "CHECKING" if event["accepted"] else "FAULT"
        elif kind in ("take_failed", "gave_up", "stopped"):
            self.state = "FAULT"
        elif kind == "pair_judged":
            self.pair = event
            self.verdicts[event["pair"]] = "!" if event["doubts"] else "✓"
        elif kind == "session_finished":
            self.state = "DONE"
        if kind == "gave_up":
            self.verdicts[event["key"].split("_")[0]] = "✗"

    def _follow_step(self, step: Any) -> None:
        if isinstance(step, Move):
            self.state = "MOVE"
            self.place = f"{step.pair} {'→'.join(step.direction)}"
        elif isinstance(step, Wait):
            self.state = "WAIT"

    def render(self) -> "RenderableType":
        """Return the screen as it is now."""
        from rich.console import Group
        from rich.panel import Panel
        from rich.text import Text

        mark = "[bold red]SIMULATED[/] " if self.simulated else "[bold]MEASURED[/] "
        style = STATES[self.state]
        head = (
            f"{mark}[{style}] {self.state} [/]  [bold]{_plain(self.place)}[/]  take "
            f"{min(self.takes_done + 1, self.takes)}/{self.takes}  {self._time_left()}"
        )
        parts = [head, *self._meters(), self._sweep(), *self._cards(), self._pairs()]
        if self.temperatures:
            now = self.temperatures[-1]
            parts.append(f"air {now:.2f} °C {sparkline(list(self.temperatures))}")
        lines = (Text.from_markup(part) for part in (*parts, *self.log))
        return Panel(Group(*lines), title="capture-pairs", width=100)

    def _time_left(self) -> str:
        elapsed = time_text(self.now() - self.begun)
        return f"{elapsed} gone, {self.remaining().rstrip(', ') or '…'}"

    def _meters(self) -> list[str]:
        names = [f"in {n + 1}" for n in range(len(self.peaks))]
        return [
            f"{name:5s} [{level_style(peak)}]{meter(peak)}[/] {peak:6.1f} dBFS"
            for name, peak in zip(names[:8], self.peaks[:8], strict=True)
        ]

    def _sweep(self) -> str:
        share = min(1.0, self.played_s / self.take_s) if self.take_s else 0.0
        full = round(share * METER_WIDTH)
        return f"take  {'━' * full}{'╌' * (METER_WIDTH - full)} {self.played_s:5.1f} s"

    def _cards(self) -> list[str]:
        cards = []
        if self.last:
            cards.append(f"last take: {_plain(take_line(self.last))}")
        if self.pair:
            cards.append(f"last pair: {_plain(pair_line(self.pair))}")
        return cards

    def _pairs(self) -> str:
        verdicts = self.verdicts.items()
        marks = _plain(" ".join(f"{name}{mark}" for name, mark in verdicts))
        return f"pairs: {marks}" if len(marks) < 400 else f"pairs: {self._counts()}"

    def _counts(self) -> str:
        marks = list(self.verdicts.values())
        return "  ".join(f"{mark} {marks.count(mark)}" for mark in "✓!✗·")

    def __exit__(self, *error: object) -> None:
        if self._live.is_started:
            self._live.update(self.render(), refresh=True)
        self._live.stop()


def _plain(text: str) -> str:
    """Keep square brackets from being read as mark-up."""
    return text.replace("[", r"\[")
