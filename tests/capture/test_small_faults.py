"""Faults as small as the bars ask are found in one take with a loopback."""

from collections.abc import Callable

import numpy as np
import pytest

from capture import deconvolve, synchronized_sweep
from capture.checks.clipping import clipped_samples
from capture.checks.events import AROUND, worst_event
from capture.signal.crests import measure_crests
from fault_detection import (
    Bench,
    clip,
    smoothly,
)
from sweep_cases import delayed


@pytest.fixture
def bench() -> Bench:
    return Bench(np.random.default_rng((3, 2)))


def test_a_clean_take_stays_unmarked(bench: Bench) -> None:
    assert bench.words(bench.microphone(), bench.cable()) == set()


@pytest.mark.parametrize(("cut", "decibels"), [(clip, 0.1), (smoothly, 0.3)])
def test_a_microphone_clipped_by_a_tenth_of_a_decibel_is_refused(
    bench: Bench, cut: Callable[[np.ndarray, float], np.ndarray], decibels: float
) -> None:
    assert "clipped" in bench.words(cut(bench.microphone(), decibels), bench.cable())


def test_two_equal_extremes_are_enough_in_fine_samples() -> None:
    wave = np.random.default_rng(0).standard_normal(5000)
    assert clipped_samples(wave)[0] == 0
    top = np.sort(wave)[-3]
    assert clipped_samples(np.minimum(wave, top))[0] == 3
    coarse = np.round(wave * 50) / 50
    assert clipped_samples(coarse)[0] == 0


def test_the_prediction_passes_a_clipped_crest_by_what_was_cut() -> None:
    rate = 8000
    rng = np.random.default_rng(1)
    grow = np.linspace(0, 1, 2 * rate)
    wave = grow * np.sin(0.2 * np.arange(grow.size))
    noise = 1e-4 * rng.standard_normal(wave.size)
    cut = np.clip(wave + noise, -0.9, 0.9)
    rest = (cut - wave).astype(np.float32)
    found = measure_crests(
        np.stack((cut, wave + noise)), np.stack((rest, noise.astype(np.float32))), rate
    )
    np.testing.assert_allclose(found.excess[0], np.abs(wave).max() - 0.9, rtol=0.01)
    assert abs(found.excess[1]) < 6 * found.sigma[1]
    np.testing.assert_allclose(found.sigma, 1e-4, rtol=0.5)


def test_a_small_constant_is_marked(bench: Bench) -> None:
    assert bench.words(bench.microphone() + 0.003, bench.cable()) == {"dc_offset"}


def test_swapped_channels_get_no_other_name_of_the_cable(bench: Bench) -> None:
    words = bench.words(bench.cable(), bench.microphone())
    assert "swapped_channels" in words
    assert not words & {"lost_samples", "bad_loopback", "gain_change", "clock_drift"}


def test_a_weak_copy_of_the_output_is_marked(bench: Bench) -> None:
    copy = 0.3e-2 * delayed(bench.played, 64.3)
    assert bench.words(bench.microphone() + copy, bench.cable()) == {"crosstalk"}


def test_a_rest_that_begins_with_the_sweep_is_no_event() -> None:
    rng = np.random.default_rng(2)
    rest = 1e-4 * (1 + 0.2 * rng.random(200))
    rest[:5] = 1e-8
    rest[60:] = 1e-7
    whole = np.full(200, 1e-2)
    found = worst_event(rest, whole)
    assert found is not None
    assert found[1] < 5
    rest[AROUND + 20 : AROUND + 22] = 1e-2
    found = worst_event(rest, whole)
    assert found is not None
    assert found[1] > 18


def test_a_short_cable_is_explained_below_its_own_noise() -> None:
    """The strong low end of a sweep must not outweigh its weak high end."""
    rng = np.random.default_rng(3)
    rate = 48000
    sweep = synchronized_sweep(49, 18000, 3.4, rate, band=(98, 16800))
    played = np.concatenate((np.zeros(2000), sweep, np.zeros(9600)))
    looped = delayed(0.3 * played, 166.8)
    noise = 10 ** (-75 / 20) * np.std(looped) * rng.standard_normal(looped.size)
    result = deconvolve(
        looped, np.asarray(sweep), rate, loopback=looped + noise, band=(98, 16800)
    )
    assert result.flags == ()
    assert result.figures["loopback_residual_db"] < -70
