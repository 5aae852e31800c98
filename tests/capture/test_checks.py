"""Every kind of bad take is named, no good one is."""

import numpy as np
import pytest

from capture.checks import CHECKS
from capture.checks.clipping import clipped_samples
from capture.checks.conformance import check_check
from capture.checks.zeros import longest_gap
from sweep_cases import catalogue, judge

CHOSEN = (
    "clean/fs16000",
    "clean/fs48000",
    "noise/white/0dB",
    "hum50/-20dB",
    "clip/1pct",
    "drift/30ppm/loopback",
    "drop256/removed@0.75",
    "drop256/zeroed@0.75",
    "drop256/repeated@0.75",
    "drop256/removed@0.5/no_loopback",
    "burst",
    "hammerstein/H2-20dB",
    "short_sweep",
    "takes/4_one_drop",
    "bad/",
)


def test_the_table_holds_every_check() -> None:
    assert {"clipping", "drift", "events", "loopback", "noise", "tail"} <= set(CHECKS)


def test_chosen_cases_are_judged_rightly() -> None:
    wrong = [
        row
        for case in catalogue()
        if case.name.startswith(CHOSEN)
        for row in [judge(case)]
        if not row["verdict_right"] or row["quality"] is False
    ]
    assert wrong == []


@pytest.mark.parametrize("name", list(CHECKS))
def test_every_check_conforms(name: str) -> None:
    check_check(name)


@pytest.mark.parametrize("level", [1.0, 0.3])
def test_flat_tops_are_found_at_any_level(level: float) -> None:
    wave = level * np.sin(np.arange(20000) * 0.031)
    assert clipped_samples(wave)[0] == 0
    assert clipped_samples(np.clip(wave, -0.98 * level, level))[0] > 100
    slow = np.round(3000 * np.sin(np.arange(20000) * 0.002)) / 32768
    assert clipped_samples(slow)[0] == 0


def test_a_quiet_zero_crossing_is_no_gap() -> None:
    slow = np.round(20 * np.sin(np.arange(20000) * 0.002))
    assert longest_gap(slow, 0, slow.size)[1] == 0
    slow[5000:5012] = 0
    assert longest_gap(slow, 0, slow.size)[:2] == (5000, 12)
