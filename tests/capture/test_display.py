import io
from collections.abc import Callable

import pytest
from rich.console import Console

from capture.operator import make_display
from capture.operator.display import PlainDisplay, take_line, time_text
from capture.operator.screen import LiveScreen, sparkline
from capture.session.engine import Session
from rir import SessionError

MakeSession = Callable[..., Session]


def console(terminal: bool) -> tuple[Console, io.StringIO]:
    text = io.StringIO()
    return Console(
        file=text, force_terminal=terminal, width=120, color_system=None
    ), text


def test_without_a_terminal_lines_are_plain(make_session: MakeSession) -> None:
    out, text = console(terminal=False)
    session = make_session()
    with make_display(out, simulated=True, plain=False) as display:
        assert type(display) is PlainDisplay
        session.record.show = display.show
        session.run()
    told = text.getvalue()
    assert "SIMULATED: no sound is played" in told
    assert "[1/2]" in told
    assert "left, P01_BA_1 good" in told
    assert "P01: difference at 1 kHz none" in told
    assert "\x1b" not in told


def test_on_a_terminal_one_screen_tells_all(make_session: MakeSession) -> None:
    out, text = console(terminal=True)
    session = make_session(simulation={"temperature_sigma_c": 0.1})
    with make_display(out, simulated=True, plain=False) as display:
        assert isinstance(display, LiveScreen)
        session.record.show = display.show
        session.run()
        display.progress(8000, 16000)
    told = text.getvalue()
    for word in ("SIMULATED", "PLAYING", "CHECKING", "DONE", "dBFS", "P01✓", "°C"):
        assert word in told


def test_a_fault_is_shown(make_session: MakeSession) -> None:
    out, text = console(terminal=True)
    display = LiveScreen(out, simulated=False)
    fault = {"kind": "dead", "takes": "P01_AB_1", "at_s": 0.5}
    session = make_session(simulation={"faults": [fault]})
    with display:
        session.record.show = display.show
        session.run()
    assert "FAULT" in text.getvalue()
    assert "MEASURED" in text.getvalue()


def test_a_rejected_take_says_why() -> None:
    event = {
        "event": "take_finished",
        "take": "P01_AB_1",
        "accepted": False,
        "reasons": ["channel 0 is silent"],
        "marks": [],
        "figures": {"inr_db": {"1000": [40.0, 35.0]}},
    }
    line = take_line(event)
    assert "REJECTED: channel 0 is silent" in line
    assert "worst octave INR 35 dB" in line


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(5.4, "5 s"), (89, "89 s"), (600, "10 min"), (7500, "2 h 05 min")],
)
def test_times_are_said_as_people_do(seconds: float, text: str) -> None:
    assert time_text(seconds) == text


def test_nobody_at_the_keyboard_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    display = PlainDisplay(console(terminal=False)[0], simulated=True)
    with pytest.raises(SessionError, match="--yes"):
        display.ask("home?")


def test_a_sparkline_of_equal_values_is_flat() -> None:
    assert sparkline([1.0, 1.0]) == "▁▁"
    assert sparkline([]) == ""


def test_a_take_found_after_a_crash_is_not_one_of_none() -> None:
    screen, _ = console(terminal=False)
    assert "/0]" not in PlainDisplay(screen, simulated=True).prefix()
