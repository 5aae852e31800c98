"""Show a session to a person: a live bar on a terminal, plain lines elsewhere."""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from capture.plan import Measure, Move, SessionPlan
from capture.session.journal import Event
from rir import SessionError

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["PlainDisplay", "take_line", "time_text"]


def time_text(seconds: float) -> str:
    """Return a duration as a person says it.

    Examples
    --------
    >>> time_text(47), time_text(3 * 3600 + 240)
    ('47 s', '3 h 04 min')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    if minutes < 90:
        return f"{minutes} min"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def take_line(event: Event) -> str:
    """Return one line about a finished take."""
    figures = event.get("figures") or {}
    facts = []
    latency = figures.get("latency_samples")
    if isinstance(latency, int | float):
        facts.append(f"latency {latency:.2f}")
    inr = figures.get("inr_db")
    if isinstance(inr, dict):
        worst = [min(v) if isinstance(v, list) else v for v in inr.values() if v]
        levels = [value for value in worst if isinstance(value, int | float)]
        if levels:
            facts.append(f"worst octave INR {min(levels):.0f} dB")
    word = "good" if event["accepted"] else "REJECTED: " + "; ".join(event["reasons"])
    marks = f" ({'; '.join(event['marks'])})" if event["marks"] else ""
    return f"{event['take']} {word}{marks}{''.join(f', {fact}' for fact in facts)}"


def pair_line(event: Event) -> str:
    """Return one line about how close the two directions of a pair are."""
    centers = list(event["octaves_hz"])
    index = min(range(len(centers)), key=lambda n: abs(centers[n] - 1000.0))
    facts = [
        f"{event['pair']}: difference at {centers[index] / 1000:g} kHz "
        f"{level_text(event['measured_db'][index])} "
        f"(predicted floor {level_text(event['predicted_db'][index])}, "
        f"stretch taken out {level_text(event['compensated_db'][index])})",
        f"level {event['level_db'][index]:+.2f} dB",
        f"stretch {event['stretch_ppm']:+.0f} ppm",
    ]
    return ", ".join([*facts, *event["doubts"]])


def level_text(level: float) -> str:
    """Return a level in words; no difference at all has none.

    Examples
    --------
    >>> level_text(-61.24), level_text(float("-inf"))
    ('-61.2 dB', 'none')
    """
    return f"{level:.1f} dB" if level > -400 else "none"


class PlainDisplay:
    """One line per event that matters; for logs and pipes.

    Parameters
    ----------
    console : rich.console.Console
        Where lines go.
    simulated : bool
        Whether to say so on top.
    now : callable
        Returns the time in seconds; the pace so far gives the remaining time.
    """

    def __init__(
        self,
        console: "Console",
        *,
        simulated: bool,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.console = console
        self.simulated = simulated
        self.now = now
        self.begun = 0.0
        self.total = self.left = 0.0
        self.takes = self.takes_done = 0

    def show(self, event: Event) -> None:
        """Print what the event means, if it means anything to a person."""
        handlers = {
            "planned": self._on_planned,
            "step": self._on_step,
            "step_done": self._on_step_done,
            "take_finished": self._on_take_finished,
            "take_failed": self._on_take_failed,
            "gave_up": self._on_gave_up,
            "pair_judged": self._on_pair_judged,
            "closure_judged": self._on_closure_judged,
            "warning": self._on_warning,
            "stopped": self._on_stopped,
        }
        if event["event"] in handlers:
            handlers[event["event"]](event)

    def say(self, text: str, style: str = "") -> None:
        """Print one line."""
        self.console.out(text, style=style or None, highlight=False)

    def ask(self, text: str) -> str:
        """Show a text, wait for a line and return it.

        Raises
        ------
        SessionError
            If nobody can answer.
        """
        try:
            return self.console.input(f"{text} ", markup=False)
        except EOFError as error:
            raise SessionError(
                "nobody is there to answer; run on a terminal, or give --yes to let "
                "rigs home by themselves"
            ) from error

    def _on_planned(self, event: Event) -> None:
        plan, remaining = event["plan"], event["remaining"]
        if self.simulated:
            self.say(
                "SIMULATED: no sound is played, no microphone is heard", "bold red"
            )
        done = len(plan.measures) - len(remaining.measures)
        if done:
            self.say(f"resuming: {done} of {len(plan.measures)} directions are done")
        self.total = self.left = remaining.seconds()
        self.takes = sum(step.takes for step in remaining.measures)
        self.begun = self.now()
        self.start(remaining)

    def _on_step(self, event: Event) -> None:
        if isinstance(event["step"], Move):
            step = event["step"]
            self.at(f"{step.pair} {'→'.join(step.direction)}")

    def _on_step_done(self, event: Event) -> None:
        step = event["step"]
        if isinstance(step, Measure):
            self.takes_done += step.takes
        self.left = max(0.0, self.left - self._plan_seconds(step))
        self.advance(self._plan_seconds(step))

    def _plan_seconds(self, step: Any) -> float:
        return self._plan.step_seconds(step)

    def _on_take_finished(self, event: Event) -> None:
        self.say(
            f"{self.prefix()}{take_line(event)}",
            "" if event["accepted"] else "bold yellow",
        )

    def _on_take_failed(self, event: Event) -> None:
        self.say(f"{event['take']} FAILED: {event['reason']}", "bold red")

    def _on_gave_up(self, event: Event) -> None:
        self.say(f"{event['key']}: no good take; going on", "bold red")

    def _on_pair_judged(self, event: Event) -> None:
        self.say(f"  {pair_line(event)}", "yellow" if event["doubts"] else "dim")

    def _on_closure_judged(self, event: Event) -> None:
        self.say(f"  closure of {pair_line(event)}", "dim")

    def _on_warning(self, event: Event) -> None:
        self.say(f"warning: {event['text']}", "yellow")

    def _on_stopped(self, event: Event) -> None:
        self.say(f"stopped: {event['reason']}", "bold red")

    def prefix(self) -> str:
        """Return what stands before a take's line."""
        # Takes found after a crash are told before it is known how many are left.
        share = f"[{self.takes_done + 1}/{self.takes}] " if self.takes else ""
        return f"{share}{self.remaining()}"

    def remaining(self) -> str:
        """Return how long the rest takes at the pace so far, once there is one."""
        done = self.total - self.left
        if done <= 0:
            return ""
        seconds = (self.now() - self.begun) * self.left / done
        return f"about {time_text(seconds)} left, "

    def progress(self, samples: int, sample_rate: int) -> None:
        """Take note of how many samples of a take are recorded."""

    def start(self, plan: SessionPlan) -> None:
        """Begin to show progress."""
        self._plan = plan
        with_rig = " with a rig" if self.simulated else ""
        self.say(f"{self.takes} takes, about {time_text(self.total)}{with_rig}")

    def at(self, text: str) -> None:
        """Say what is being measured."""

    def advance(self, seconds: float) -> None:
        """Count planned seconds as done."""

    def __enter__(self) -> "PlainDisplay":
        return self

    def __exit__(self, *error: object) -> None: ...
