import numpy as np
import pytest

from rigs import VirtualClock
from rigs.faults import (
    RebootError,
    RefusedError,
    SilenceError,
    UnknownPositionError,
)
from rigs.firmware.marlin import MarlinFirmware
from rigs.lines.direct import DirectLine
from rigs.marlin.controller import MarlinController, MarlinOptions
from rir.errors import OutOfReachError

A, B = np.array([50.0, 60.0, 20.0]), np.array([150.0, 60.0, 20.0])


class Bench:
    def __init__(self):
        self.clock = VirtualClock()
        self.board = MarlinFirmware()
        self.line = DirectLine(self.board, self.clock)
        options = MarlinOptions(settle_s=0.1, low_mm=(0, 0, 0))
        self.driver = MarlinController(self.line, self.clock, options)
        self.driver.connect()

    def later(self, seconds, action):
        self.board.advance(self.clock.now())
        self.board.schedule(seconds, action, lasting=True)


@pytest.fixture
def bench():
    built = Bench()
    built.driver.home()
    return built


def test_nothing_moves_before_homing():
    bench = Bench()
    with pytest.raises(UnknownPositionError, match="not been homed"):
        bench.driver.move([A])
    assert b"G1" not in bench.line.sent


def test_moves_arrive_with_busy_lines_in_between(bench):
    bench.driver.options = MarlinOptions(feed_mm_per_min=300, settle_s=0.1)
    np.testing.assert_allclose(bench.driver.move([A]), A)
    np.testing.assert_allclose(bench.board.true_position, A)
    assert b"M400" in bench.line.sent


def test_damaged_lines_are_sent_again(bench):
    sent = bench.line.write
    damages = [b"G1", b"M400"]

    def damage(data):
        if damages and damages[0] in data:
            data = data.replace(damages.pop(0), b"G9")
        sent(data)

    bench.line.write = damage
    np.testing.assert_allclose(bench.driver.move([B]), B)
    np.testing.assert_allclose(bench.board.true_position, B)
    assert damages == []


def test_a_lost_ok_does_not_repeat_the_move(bench):
    bench.driver.move([A])
    bench.later(0.001, lambda: bench.board.mute(0.5))
    np.testing.assert_allclose(bench.driver.move([B]), B)
    assert bench.board.moves_started == 2


def test_a_restart_is_found_by_its_greeting(bench):
    bench.driver.move([A])
    bench.later(0.5, bench.board.power_cycle)
    with pytest.raises(RebootError):
        bench.driver.move([B])
    assert not bench.driver.known
    bench.driver.home()
    np.testing.assert_allclose(bench.driver.move([B]), B)
    np.testing.assert_allclose(bench.board.true_position, B)


def test_a_silent_restart_is_found_by_its_line_numbers(bench):
    bench.driver.move([A])
    bench.board.mute(1.0)
    bench.board.power_cycle()
    bench.clock.sleep(2.0)
    with pytest.raises(RebootError, match="asks for line 1"):
        bench.driver.verify()
    assert bench.driver.position() is None


def test_silence_ends_in_time(bench):
    bench.board.mute(1e9)
    began = bench.clock.now()
    with pytest.raises(SilenceError):
        bench.driver.move([A])
    assert bench.clock.now() - began < 30.0
    assert not bench.driver.known


def test_a_killed_board_is_not_believed(bench):
    bench.later(0.3, lambda: [bench.board.hear(byte) for byte in b"M112\n"])
    with pytest.raises((RefusedError, SilenceError)):
        bench.driver.move([B])
    assert bench.driver.position() is None


def test_targets_outside_are_never_sent(bench):
    with pytest.raises(OutOfReachError):
        bench.driver.move([np.array([300.0, 0, 0])])
    assert b"G1" not in bench.line.sent


def test_an_interrupted_move_is_stopped_and_not_believed(bench):
    read = bench.line.read
    start = bench.clock.now()

    def interrupted(timeout):
        if bench.clock.now() > start + 0.5:
            raise KeyboardInterrupt
        return read(timeout)

    bench.line.read = interrupted
    with pytest.raises(KeyboardInterrupt):
        bench.driver.move([B])
    bench.line.read = read
    bench.clock.sleep(1.0)
    bench.board.advance(bench.clock.now())
    assert bench.board.glide is None
    assert bench.board.true_position[0] < 150.0
    assert not bench.driver.known
