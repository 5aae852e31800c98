"""The driver over pyserial and pseudo-terminals."""

import numpy as np
import pytest

from rigs import FastClock, SystemClock, load_rig
from rigs.faults import LineError
from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.firmware.marlin import MarlinFirmware
from rigs.grbl.controller import GrblController
from rigs.grbl.options import GrblOptions
from rigs.kinds.grbl import USUAL_SETTINGS
from rigs.lines.serial import SerialLine, list_ports
from rigs.lines.stepped import SteppedClock
from rigs.lines.terminal import PseudoTerminal
from rigs.marlin.controller import MarlinController, MarlinOptions
from rigs.rigfile import PRESETS, find_rig_file, preset_names
from rir.errors import ConfigError, RigError
from rir.pose import Pose

pytest.importorskip("termios")
OPTIONS = GrblOptions(feed_mm_per_min=6000, settle_s=0.1)


@pytest.fixture
def stepped():
    clock = SteppedClock()
    yield clock
    for port in list(clock.terminals):
        clock.unserve(port)


def test_a_gantry_on_a_pseudo_terminal(stepped):
    board = GrblFirmware(USUAL_SETTINGS)
    line = SerialLine(stepped.serve(board), clock=stepped)
    driver = GrblController(line, stepped, OPTIONS)
    driver.connect()
    driver.home()
    for x in (-500.0, -20.0, -1999.0):
        target = np.array([x, -30.0, -40.0])
        np.testing.assert_allclose(driver.move([target]), target)
    board.unplug(5.0)
    with pytest.raises(LineError, match="unplugged"):
        driver.move([np.array([-1000.0, -30.0, -40.0])])
    assert not driver.known
    driver.close()


def test_an_unplugged_idle_board_is_recognised_again(stepped):
    board = GrblFirmware(USUAL_SETTINGS)
    driver = GrblController(
        SerialLine(stepped.serve(board), clock=stepped), stepped, OPTIONS
    )
    driver.connect()
    driver.home()
    target = np.array([-300.0, -30.0, -40.0])
    driver.move([target])
    board.unplug(2.0)
    assert driver.position() is None
    stepped.sleep(3.0)
    driver.connect()
    np.testing.assert_allclose(driver.verify(), target)
    driver.close()


def test_marlin_on_a_pseudo_terminal(stepped):
    board = MarlinFirmware()
    line = SerialLine(stepped.serve(board), 250000, stepped)
    driver = MarlinController(line, stepped, MarlinOptions(settle_s=0.0))
    driver.connect()
    driver.home()
    target = np.array([120.0, 30.0, 40.0])
    board.garble(1)
    np.testing.assert_allclose(driver.move([target]), target)
    np.testing.assert_allclose(board.true_position, target)
    board.power_cycle()
    stepped.sleep(1.0)
    with pytest.raises(RigError, match="restarted"):
        driver.move([target / 2])
    assert not driver.known
    driver.close()


def test_in_real_time_over_a_thread():
    board = GrblFirmware({**USUAL_SETTINGS, 24: 3000, 25: 30000, 26: 1})
    terminal = PseudoTerminal(board, FastClock(20.0))
    clock = FastClock(20.0)
    driver = GrblController(SerialLine(terminal.port, clock=clock), clock, OPTIONS)
    try:
        driver.connect()
        driver.home()
        target = np.array([-200.0, -30.0, -40.0])
        np.testing.assert_allclose(driver.move([target]), target)
    finally:
        driver.close()
        terminal.close()


def test_a_missing_port_says_what_to_do():
    with pytest.raises(LineError, match="rig ports"):
        SerialLine("/dev/does-not-exist", clock=SystemClock()).open()
    assert isinstance(list_ports(), list)


def test_a_port_is_opened_by_one_program_only(stepped):
    port = stepped.serve(GrblFirmware())
    first = SerialLine(port, clock=stepped)
    first.open()
    with pytest.raises(LineError, match="cannot be opened"):
        SerialLine(port, clock=stepped).open()
    first.close()


def test_the_kitchen_runs_through_its_brown_out():
    seen = []
    carriers = load_rig(PRESETS / "kitchen-simulated.yaml", on_emitter=seen.append)
    rng = np.random.default_rng(0)
    carriers.home()
    stops = []
    done = 0
    while done < 16:
        poses = [Pose(rng.uniform([0.9, 0.9, 1.0], [3.2, 1.7, 1.8])) for _ in "ab"]
        if np.linalg.norm((poses[0].position - poses[1].position)[:2]) < 0.4:
            continue
        try:
            carriers.place(*poses)
            with carriers.quiet():
                np.testing.assert_allclose(
                    seen[-1].position, poses[0].position, atol=1e-4
                )
            done += 1
        except RigError as error:
            stops.append(str(error))
            assert carriers.where()[0] is None
            carriers.home()
    assert len(stops) == 1, stops
    assert "restarted by itself" in stops[0]
    assert carriers.describe()["emitter"]["controllers"][0]["reboots_seen"] == 1
    carriers.close()


def test_presets_are_found_by_name():
    assert "kitchen-simulated" in preset_names()
    assert find_rig_file("kitchen-simulated").is_file()
    with pytest.raises(ConfigError, match="presets are"):
        find_rig_file("kitchn")
