"""Play the firmware model and the driver's parser against recorded real dialogues."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from rigs import VirtualClock
from rigs.faults import AlarmError, RebootError, RefusedError, SilenceError
from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.grbl.link import GrblLink, Patience
from rigs.grbl.parsing import (
    Alarm,
    Banner,
    Noise,
    Ok,
    Refused,
    Status,
    read_status,
    read_word,
)
from rigs.marlin.parsing import read_reply

REPOSITORY = Path(__file__).parents[2]
FOLDER = Path(
    os.environ.get("RESOUNDING_TRANSCRIPTS", REPOSITORY.parent / "shared/transcripts")
)
TUNED = {
    1: 255, 22: 1, 24: 200, 25: 1500, 27: 2, 110: 3000, 111: 3000, 112: 3000,
    120: 200, 121: 200, 122: 200,
}  # fmt: skip
BOARDS = {
    "s01_grbl11h_boot_and_queries": {"settings": {}},
    "s02_grbl11h_alarm_on_start_and_homing": {},
    "s02b_grbl11h_power_cycle": {},
    "s03_grbl11h_moves": {},
    "s04_grbl11h_hold_resume_reset": {},
    "s05_grbl11h_soft_limits": {},
    "s06_grbl11h_hard_limits": {"startup": ("G90", "")},
    "s07_grbl11h_homing_failures": {},
    "s08_grbl11h_error_codes": {},
    "s09_grbl11h_jog": {},
    "s10_grbl11h_coordinates": {},
    "s11_grbl11h_streaming": {"startup": ("G90", "")},
    "s12_grbl11h_rx_overrun": {"settings": {**TUNED, 22: 0}},
    "s13_pty_unplug_while_moving": {},
    "s14_grbl11h_door_sleep": {},
}
MISREAD = ("<Run|MPos:-57.412,-50.000,-2.600|FS:3000,0>",)
"""Damaged so that it still looks right; the machine never was there."""
STOPS = (b"!", b"\x85", b"\x84", b"\x18")
MOVING = ("Run", "Jog", "Home")
STOPPED_WITHIN = 3.5
"""Where a stop catches the real machine depends on its PC's load, mm."""

pytestmark = pytest.mark.skipif(
    not FOLDER.is_dir(), reason=f"no recorded dialogues in {FOLDER}"
)


def events(name):
    lines = (FOLDER / f"{name}.jsonl").read_text().splitlines()
    return [
        (time, way, bytes.fromhex(data)) for time, way, data in map(json.loads, lines)
    ]


def replies(name):
    """Return the lines the controller sent."""
    joined = b"".join(data for _, way, data in events(name) if way == "<-")
    return [line.strip(b"\r").decode("latin-1") for line in joined.split(b"\n")]


def damaged(line):
    return line in MISREAD or (line.startswith("<") and read_status(line) is None)


class Replay:
    """Feed the host's bytes to the model when its machine is where the real one was."""

    def __init__(self, board, recorded):
        self.board, self.state = board, board.state
        self.recorded = recorded
        self.out = b""
        self.stopping = False
        self.compared = 0

    def run(self):
        clock = 0.0
        for place, (time, way, data) in enumerate(self.recorded):
            if way == "->":
                if self.at_rest and self.state.held is None:
                    self.advance(self.board.now + min(time - clock, 2.5) * 0.9)
                elif not self.homing and data.startswith(b"$"):
                    self.advance(self.board.now + min(time - clock, 0.01))
                self.say(data, place)
            elif way == "<-":
                self.expect(data)
            clock = time
        return self.compared

    @property
    def at_rest(self):
        return self.state.glide is None and not self.state.queue and not self.homing

    @property
    def homing(self):
        return self.state.homing_line

    def advance(self, until):
        self.board.advance(until)
        self.out += self.board.take()

    def say(self, data, place):
        if data in (b"?", *STOPS):
            self.synchronise(place, data)
        if data in STOPS:
            self.stopping = data != b"\x85" or self.state.name == "Jog"
        elif data not in (b"?", b"$G\n"):
            self.stopping = False
        self.board.receive(data)
        # bytes written together arrive together; replies have their own time
        self.advance(self.board.now + len(data) * 1e-4)

    def synchronise(self, place, data):
        """Wait until the model is where the next report says the real machine was."""
        ahead = self.recorded[place + 1 :]
        following = (d for _, way, d in ahead if way == "<-")
        for chunk in following:
            match = re.search(rb"<[^>]*>", chunk)
            text = match[0].decode("latin-1") if match else ""
            status = None if damaged(text) else read_status(text)
            if status is not None:
                break
        else:
            return
        if self.homing:
            if data == b"\x18":
                self.reach(status)
        elif self.stopping:
            self.wait_for_stop(status)
        elif status.state in MOVING:
            self.wait_for_place(status)
        elif data == b"?":
            self.wait_for_stop(status)

    def wait_for_place(self, status):
        for _ in range(300):
            if self.state.glide is None:
                if self.board.next_event() == np.inf:
                    return
                self.advance(min(self.board.next_event(), self.board.now + 0.05))
            elif self.reach(status):
                return
            else:
                self.advance(self.state.glide.end_time + 1e-6)

    def wait_for_stop(self, status):
        """Let a stop go on until the model is in the recorded state."""
        for _ in range(30000):
            if status.state in MOVING or self.at_rest:
                return
            if self.state.name == status.state and (status.substate or 0) > 0:
                return
            self.advance(self.board.now + 0.002)

    def reach(self, status):
        """Advance to the recorded place if it lies ahead on the present move."""
        glide, place = self.state.glide, status.machine
        way = glide.end - glide.start
        along = float((place - glide.start) @ way) / max(glide.length, 1e-9)
        off = np.linalg.norm(glide.at(max(along, 0.0)) - place)
        if off > 0.02 or along < glide.travelled(self.board.now) - 0.02:
            return False
        low, high = self.board.now, glide.end_time
        for _ in range(60):
            middle = (low + high) / 2
            reached = glide.travelled(middle) >= along
            low, high = (low, middle) if reached else (middle, high)
        self.advance(high)
        return True

    def expect(self, data):
        for wanted in data.split(b"\r\n"):
            if wanted:
                self.expect_line(wanted.decode("latin-1"))

    def expect_line(self, wanted):
        got = self.next_line()
        self.compared += 1
        if damaged(wanted) or got == wanted:
            return
        a, b = read_status(wanted), read_status(got)
        assert a is not None, f"recorded {wanted!r}, model said {got!r}"
        assert b is not None, f"recorded {wanted!r}, model said {got!r}"
        self.compare(wanted, got, a, b)

    def compare(self, wanted, got, a, b):
        moving = a.state in MOVING or (a.state in ("Hold", "Door") and a.substate)
        assert (a.state, a.substate, a.pins) == (b.state, b.substate, b.pins), (
            f"recorded {wanted!r}, model said {got!r}"
        )
        loose = moving or self.stopping
        assert masked(wanted, loose) == masked(got, loose), (
            f"recorded {wanted!r}, model said {got!r}"
        )
        off = np.max(np.abs(a.machine - b.machine))
        assert off <= (STOPPED_WITHIN if self.stopping else 0.0045), (wanted, got)
        if self.stopping and self.state.glide is None:
            self.state.rest = a.machine.copy()
            self.state.planned = a.machine.copy()

    def next_line(self):
        limit = self.board.now + 60.0
        while b"\r\n" not in self.out.lstrip(b"\r\n"):
            step = min(self.board.next_event(), limit)
            assert step < limit, "the model says nothing more"
            self.advance(step)
        line, _, self.out = self.out.lstrip(b"\r\n").partition(b"\r\n")
        return line.decode("latin-1")


def masked(line, moving):
    """Return a report without its momentary speed, while moving without its place."""
    if not moving:
        return line
    return re.sub(r"FS:[^|>]*", "FS:*", re.sub(r"[MW]Pos:[^|>]*", "Pos:*", line))


@pytest.mark.parametrize("name", BOARDS)
def test_the_model_answers_like_the_real_board(name):
    options = {"settings": TUNED, "at": (-60.0, -60.0, -60.0), **BOARDS[name]}
    compared = Replay(GrblFirmware(**options), events(name)).run()
    assert compared == len([line for line in replies(name) if line])


@pytest.mark.parametrize(
    "name",
    [
        *BOARDS,
        "h01_grblhal_boot_queries",
        "h02_grblhal_homing_alarms",
        "h03_grblhal_motion",
    ],
)
def test_the_driver_understands_every_line(name):
    lines = [line for line in replies(name) if line]
    noise = [line for line in lines if isinstance(read_word(line), Noise)]
    unreadable = [
        line for line in noise if not damaged(line) and not line.startswith("$N")
    ]
    assert unreadable == []
    statuses = [w for w in map(read_word, lines) if isinstance(w, Status)]
    assert len(noise) <= max(3, 0.05 * len(lines))
    assert all(s.machine is not None or s.work is not None for s in statuses)


def test_the_damaged_reports_are_dropped():
    lines = replies("s03_grbl11h_moves") + replies("s04_grbl11h_hold_resume_reset")
    assert [line for line in lines if damaged(line)] == [
        "<R0n|MPos:-8.692,-2.000,-2.000|FS:3000,0>",
        "<Run|MPos:-44.492,-2.000,-:.000|FS:1500,0>",
        "<Run|MPos:-82.720,-2.000,-2.000|FS:-500,0>",
    ]


def test_marlin_replies_are_understood():
    kinds = [read_reply(line).kind for line in replies("m01_octoprint_virtual_marlin")]
    assert kinds.count("busy") == 3
    assert kinds.count("resend") == 6
    assert kinds.count("error") == 6
    assert "position" not in kinds


class RecordedLine:
    """Answer with the recorded bytes, and accept only the recorded bytes."""

    def __init__(self, recorded, clock):
        self.recorded = list(recorded)
        self.clock = clock
        self.answers = b""

    def next_sent(self):
        return next((data for _, way, data in self.recorded if way == "->"), None)

    def open(self):
        pass

    def close(self):
        pass

    def finish(self):
        pass

    def write(self, data):
        while self.recorded and self.recorded[0][1] != "->":
            self.recorded.pop(0)
        assert data == self.recorded.pop(0)[2]
        while self.recorded and self.recorded[0][1] == "<-":
            self.answers += self.recorded.pop(0)[2]

    def read(self, timeout):
        if not self.answers:
            self.clock.sleep(timeout)
        data, self.answers = self.answers, b""
        return data


def outcome(answer):
    """Return what a driver must conclude from the recorded answer to a line."""
    for line in answer.decode("latin-1").split("\r\n"):
        word = read_word(line)
        if isinstance(word, Refused):
            return RefusedError, word.code
        if isinstance(word, Alarm):
            return AlarmError, word.code
        if isinstance(word, Banner):
            return RebootError, None
        if isinstance(word, Ok):
            return None, None
    return SilenceError, None


def ask(link, sent):
    """Make the driver say what the recorded host said."""
    if sent == b"?":
        link.status()
    elif sent == b"\x18":
        link.soft_reset()
    elif sent.endswith(b"\n") and sent.count(b"\n") == 1:
        link.command(sent[:-1].decode())
    else:
        link.send(sent)


def test_the_driver_says_and_concludes_what_was_recorded():
    concluded = 0
    for name in BOARDS:
        clock = VirtualClock()
        line = RecordedLine(events(name), clock)
        link = GrblLink(line, clock, Patience(status_tries=1))
        while (sent := line.next_sent()) is not None:
            line.answers = b""
            link.drain()
            after = line.recorded[[w for _, w, _ in line.recorded].index("->") + 1 :]
            kinds = [way for _, way, _ in after]
            answered = after[
                : next((k for k, w in enumerate(kinds) if w != "<-"), None)
            ]
            wanted, code = outcome(b"".join(data for _, _, data in answered))
            try:
                ask(link, sent)
                got, found = None, None
            except (RefusedError, AlarmError) as error:
                got, found = type(error), error.code
            except (RebootError, SilenceError) as error:
                got, found = type(error), None
            if sent.endswith(b"\n") and sent.count(b"\n") == 1:
                assert (got, found) == (wanted, code), (name, sent)
                concluded += 1
        assert line.next_sent() is None
    assert concluded > 500
