import numpy as np
import pytest

from rigs import VirtualClock
from rigs.faults import (
    AlarmError,
    RebootError,
    RefusedError,
    SilenceError,
    StrayError,
    UnknownPositionError,
)
from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.grbl.controller import GrblController
from rigs.grbl.options import GrblOptions
from rigs.lines.direct import DirectLine
from rir.errors import OutOfReachError, RigError

SETTINGS = {
    20: 1, 22: 1, 24: 200, 25: 1500, 27: 2, 110: 3000, 111: 3000, 112: 3000,
    120: 200, 121: 200, 122: 200,
}  # fmt: skip
A, B = np.array([-50.0, -60.0, -20.0]), np.array([-150.0, -60.0, -20.0])


class Bench:
    """A board, a line and a driver in simulated time."""

    def __init__(self, settings=SETTINGS, **options):
        self.clock = VirtualClock()
        self.board = GrblFirmware(settings, at=(-60.0, -50.0, -40.0))
        self.line = DirectLine(self.board, self.clock)
        self.driver = GrblController(self.line, self.clock, GrblOptions(**options))

    def later(self, seconds, action):
        self.board.advance(self.clock.now())
        self.board.schedule(seconds, action, lasting=True)

    def press(self, seconds, data):
        self.later(seconds, lambda: [self.board.hear(byte) for byte in data])

    @property
    def moves_sent(self):
        return bytes(self.line.sent).count(b"G1 ")


@pytest.fixture
def bench():
    built = Bench()
    built.driver.connect()
    built.driver.home()
    return built


def test_connecting_resets_and_moves_nothing():
    bench = Bench()
    bench.driver.connect()
    assert b"\x18" not in bench.line.sent
    assert bench.board.moves_started == 0
    assert bench.driver.state == "Alarm"
    assert not bench.driver.known
    assert bench.driver.describe()["firmware"] == "Grbl 1.1h.20190830"


def test_nothing_moves_before_homing():
    bench = Bench()
    bench.driver.connect()
    with pytest.raises(UnknownPositionError, match="not been homed"):
        bench.driver.move([A])
    assert bench.moves_sent == 0


def test_homing_finds_the_pull_off(bench):
    np.testing.assert_allclose(bench.driver.position(), [-2, -2, -2])
    np.testing.assert_allclose(bench.board.true_position, [-2, -2, -2])


def test_moves_arrive_past_their_way_points(bench):
    np.testing.assert_allclose(bench.driver.move([A, B]), B)
    np.testing.assert_allclose(bench.board.true_position, B, atol=1e-9)
    assert bytes(bench.line.sent).count(b"G4 P0.01") == 1


def test_a_hundred_random_moves(bench):
    rng = np.random.default_rng(5)
    for target in rng.uniform(-198.0, -2.0, (100, 3)).round(3):
        reached = bench.driver.move([target])
        np.testing.assert_allclose(reached, target, atol=0.0045)
        np.testing.assert_allclose(reached, bench.board.true_position, atol=1e-6)


def test_a_homed_board_is_recognised_after_reconnecting(bench):
    bench.driver.move([A])
    again = GrblController(bench.line, bench.clock)
    again.connect()
    np.testing.assert_allclose(again.verify(), A)
    assert b"\x18" not in bench.line.sent


def test_a_board_reset_in_between_is_not_trusted(bench):
    bench.press(0.0, b"\x18")
    bench.clock.sleep(1.0)
    again = GrblController(bench.line, bench.clock)
    again.connect()
    assert not again.known


@pytest.mark.parametrize(
    ("disturb", "error", "known"),
    [
        ("brown-out", RebootError, False),
        ("reset", (RebootError, AlarmError), False),
        ("switch", AlarmError, False),
        ("soft limit", AlarmError, True),
        ("hold", RigError, True),
        ("door", RigError, True),
    ],
)
def test_a_disturbed_move_ends_in_the_right_state(bench, disturb, error, known):
    bench.driver.move([A])
    bench.later(
        1.0,
        {
            "brown-out": bench.board.power_cycle,
            "reset": lambda: bench.board.hear(0x18),
            "switch": lambda: bench.board.alarm(1, critical=True),
            "soft limit": lambda: bench.board.alarm(2, critical=True),
            "hold": lambda: bench.board.hear(ord("!")),
            "door": lambda: bench.board.hear(0x84),
        }[disturb],
    )
    with pytest.raises(error):
        bench.driver.move([B])
    assert bench.driver.known is known
    believed = bench.driver.position()
    if believed is not None:
        np.testing.assert_allclose(believed, bench.board.true_position, atol=1e-3)
    bench.driver.home()
    np.testing.assert_allclose(bench.driver.move([A]), A)
    np.testing.assert_allclose(bench.board.true_position, A, atol=1e-6)


def test_a_quiet_reset_is_found_by_its_stamp(bench):
    bench.driver.move([A])
    bench.board.mute(0.5)
    bench.press(0.0, b"\x18")
    bench.clock.sleep(1.0)
    with pytest.raises(RebootError, match="unnoticed"):
        bench.driver.verify()
    assert bench.driver.position() is None


def test_unlocking_needs_a_known_position(bench):
    bench.driver.move([A])
    bench.board.alarm(2, critical=True)
    with pytest.raises(AlarmError, match="beyond the travel"):
        bench.driver.verify()
    assert bench.driver.position() is None
    bench.driver.unlock()
    np.testing.assert_allclose(bench.driver.verify(), A)
    bench.board.power_cycle()
    bench.clock.sleep(1.0)
    assert bench.driver.position() is None
    with pytest.raises(UnknownPositionError, match="pretend"):
        bench.driver.unlock()


def test_a_lost_ok_costs_a_stop_and_a_retry(bench):
    bench.driver.move([A])
    bench.later(0.0005, lambda: bench.board.mute(0.1))
    np.testing.assert_allclose(bench.driver.move([B]), B)
    np.testing.assert_allclose(bench.board.true_position, B, atol=1e-6)


def test_a_damaged_target_is_noticed_on_the_way(bench):
    bench.driver.move([A])
    sent = bench.line.write

    def damage(data):
        sent(data.replace(b"Y-60.000", b"Y-10.000"))

    bench.line.write = damage
    with pytest.raises(StrayError, match="leaves the straight way"):
        bench.driver.move([B])
    assert bench.board.true_position[1] < -20.0
    np.testing.assert_allclose(
        bench.driver.verify(), bench.board.true_position, atol=1e-3
    )


def test_targets_outside_the_travel_are_never_sent(bench):
    with pytest.raises(OutOfReachError, match=r"machine x = 5\.000 is outside"):
        bench.driver.move([A, np.array([5.0, -10, -10])])
    assert bench.moves_sent == 0


def test_silence_ends_in_time(bench):
    bench.driver.move([A])
    bench.board.mute(1e9)
    began = bench.clock.now()
    with pytest.raises(SilenceError):
        bench.driver.move([B])
    assert bench.clock.now() - began < 30.0
    assert not bench.driver.known


def test_ctrl_c_stops_with_the_position_kept(bench):
    bench.driver.move([A])
    read = bench.line.read
    start = bench.clock.now()

    def interrupted(timeout):
        if bench.clock.now() > start + 1.0:
            bench.line.read = read
            raise KeyboardInterrupt
        return read(timeout)

    bench.line.read = interrupted
    with pytest.raises(KeyboardInterrupt):
        bench.driver.move([B])
    assert bench.board.state.name == "Idle"
    np.testing.assert_allclose(
        bench.driver.verify(), bench.board.true_position, atol=1e-3
    )
    assert A[0] > bench.driver.verify()[0] > B[0]


def test_hold_and_resume(bench):
    bench.driver.link.command("G53 G1 X-150 F1500")
    bench.clock.sleep(1.0)
    bench.driver.hold()
    assert bench.board.state.name == "Hold"
    held = bench.board.position.copy()
    bench.clock.sleep(2.0)
    bench.driver.resume()
    bench.clock.sleep(10.0)
    bench.board.advance(bench.clock.now())
    assert held[0] > bench.board.position[0] == -150.0


def test_jogs_and_jog_cancel(bench):
    bench.driver.move([A])
    step = np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(bench.driver.jog(step, 1000), A + step)
    bench.driver.link.command("$J=G91 G21 X-100 F1500")
    bench.clock.sleep(1.0)
    rest = bench.driver.cancel_jog()
    np.testing.assert_allclose(rest, bench.board.true_position, atol=1e-3)
    assert bench.driver.known
    with pytest.raises(OutOfReachError):
        bench.driver.jog(np.array([0, 0, 500.0]), 1000)


def test_streaming_by_characters_overfills_nothing(bench):
    bench.driver.move([A])
    lines = [f"G53 G1 X{-50 - 0.1 * k:.3f} F3000" for k in range(1, 101)]
    bench.driver.link.stream(lines, window=127)
    bench.driver.link.command("G4 P0.01", timeout=30.0)
    np.testing.assert_allclose(bench.board.position[0], -60.0)


@pytest.mark.parametrize(
    ("settings", "options", "match"),
    [
        ({13: 1}, {}, "inches"),
        ({}, {"expect": {130: 500.0}}, r"\$130 is 200\.0, the rig file expects 500"),
        ({}, {"expect": {999: 1.0}}, r"\$999 is None"),
    ],
)
def test_settings_are_checked(settings, options, match):
    bench = Bench(SETTINGS | settings, **options)
    with pytest.raises(RigError, match=match):
        bench.driver.connect()


def test_a_board_without_homing_is_never_believed():
    bench = Bench({**SETTINGS, 20: 0, 22: 0})
    bench.driver.connect()
    assert bench.driver.state == "Idle"
    assert not bench.driver.known
    with pytest.raises(RigError, match=r"\$22=0"):
        bench.driver.home()


def test_homing_without_a_switch_in_reach():
    bench = Bench({**SETTINGS, 130: 20, 131: 20, 132: 20})
    bench.driver.connect()
    with pytest.raises(AlarmError, match="alarm 9: homing found no switch"):
        bench.driver.home()
    assert not bench.driver.known


def test_refusals_say_what_they_mean(bench):
    with pytest.raises(RefusedError, match="error 20: the code is not supported"):
        bench.driver.link.command("G5")


def test_reports_in_work_coordinates_are_resolved(bench):
    bench.driver.link.command("G10 L2 P1 X-3 Y0 Z5")
    bench.driver.link.command("$10=0")
    bench.board.state.settings[10] = 0
    bench.driver.link.offset = None
    bench.driver.link.command("$10=1")
    bench.driver.move([A])
    bench.driver.link.command("$10=0")
    np.testing.assert_allclose(bench.driver.position(), A)


def test_quiet_sends_the_lines_of_the_rig_file():
    bench = Bench(quiet=("M9",), loud=("M5",))
    bench.driver.connect()
    bench.driver.home()
    bench.driver.quieten()
    bench.driver.unquieten()
    assert b"M9\n" in bench.line.sent
    bench.driver.quieten()
    bench.board.power_cycle()
    bench.clock.sleep(1.0)
    with pytest.raises(RebootError):
        bench.driver.unquieten()


@pytest.mark.parametrize("lost", [(0.0, 0, 0), (0.5, 0, 0), (0, -0.4, 0), (0, 0, 3.0)])
def test_lost_steps_are_felt_at_the_switches(lost):
    bench = Bench(reference=True)
    bench.driver.connect()
    bench.driver.home()
    np.testing.assert_allclose(bench.driver.confirm(), 0.0, atol=0.02)
    bench.driver.move([A])
    bench.board.slip(np.array(lost))
    np.testing.assert_allclose(bench.driver.move([B]), B)
    if not any(lost):
        np.testing.assert_allclose(bench.driver.confirm(), 0.0, atol=0.02)
        np.testing.assert_allclose(bench.driver.move([A]), A)
        return
    with pytest.raises(StrayError, match="steps were lost"):
        bench.driver.confirm()
    assert not bench.driver.known
    bench.driver.home()
    np.testing.assert_allclose(bench.driver.move([A]), A)
    np.testing.assert_allclose(bench.board.true_position, A, atol=1e-6)


def test_without_a_reference_drift_is_not_a_number(bench):
    assert np.isnan(bench.driver.confirm()).all()


def test_the_homed_corner_follows_the_direction_mask():
    bench = Bench({**SETTINGS, 23: 5})
    bench.driver.connect()
    np.testing.assert_allclose(bench.driver.home_position(), [-198, -2, -198])
