from pathlib import Path

import numpy as np
import pytest
import yaml

from rigs import VirtualClock
from rigs.dialogue.controller import Dialogue, DialogueController, DialogueOptions
from rigs.faults import RefusedError, SilenceError, StrayError
from rigs.firmware.turntable import TurntableFirmware
from rigs.lines.direct import DirectLine
from rir.errors import OutOfReachError, RigError

FULL = yaml.safe_load(Path(__file__).with_name("turntable.yaml").read_text())


def bench(silent=False, *, words):
    clock = VirtualClock()
    table = TurntableFirmware(30.0, silent=silent)
    options = DialogueOptions(dialogue=Dialogue(**words))
    driver = DialogueController(DirectLine(table, clock), clock, options)
    driver.connect()
    return driver, table, clock


def angle(table, clock):
    table.advance(clock.now())
    return float(table.true_position[0])


def test_acknowledged_and_done():
    driver, table, clock = bench(words=FULL)
    driver.home()
    np.testing.assert_allclose(driver.move([np.array([90.0])]), [90.0])
    assert angle(table, clock) == pytest.approx(90.0)
    assert not driver.open_loop
    with pytest.raises(OutOfReachError, match=r"outside -180 to 180"):
        driver.move([np.array([200.0])])


def test_polled_until_idle():
    words = FULL | {"done": None, "poll": "P", "idle": r"P-45\.00"}
    driver, table, clock = bench(words={k: v for k, v in words.items() if k != "home"})
    table.offset = 0.0
    driver.home()
    driver.move([np.array([-45.0])])
    assert angle(table, clock) == pytest.approx(-45.0)


def test_open_loop_waits_by_the_speed():
    driver, table, clock = bench(silent=True, words={"move": "A{position:.1f}"})
    driver.home()
    began = clock.now()
    driver.move([np.array([90.0])])
    assert clock.now() - began == pytest.approx(90.0 / 10.0 + 1.0 + 1.0, abs=0.01)
    assert angle(table, clock) == pytest.approx(30.0 + 90.0)
    assert driver.open_loop
    assert driver.describe()["open_loop"]


def test_steps_are_filled_in():
    driver, table, clock = bench(
        silent=True, words={"move": "I1M{step_count},R;{steps}"}
    )
    driver.options = driver.options.model_copy(update={"steps_per_unit": 80.0})
    driver.home()
    driver.move([np.array([10.0])])
    driver.move([np.array([7.5])])
    table.advance(clock.now())
    assert bytes(table.heard).endswith(b"I1M-200,R;600\r\n")


def test_refusals_silence_and_jumps_lose_the_position():
    driver, table, clock = bench(words=FULL | {"move": "X{position}"})
    driver.home()
    with pytest.raises(RefusedError, match="refused"):
        driver.move([np.array([10.0])])
    assert not driver.known
    driver.home()
    table.mute(1e9)
    with pytest.raises(SilenceError, match="no answer like"):
        driver.verify()
    driver, table, clock = bench(words=FULL)
    driver.home()
    driver.move([np.array([90.0])])
    table.power_cycle()
    clock.sleep(1.0)
    with pytest.raises(StrayError, match="jumped from 90 to 0"):
        driver.verify()
    with pytest.raises(RigError, match="home"):
        driver.move([np.array([0.0])])
