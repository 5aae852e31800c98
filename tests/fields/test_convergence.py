import numpy as np
import pytest

from fields.comparison.table import convergence_note
from fields.convergence import AT_REST, late_fall


def history(losses):
    return [(step, 0.1 * step, loss) for step, loss in enumerate(losses)]


@pytest.mark.parametrize("count", [40, 57, 200])
def test_fall_of_a_straight_line_is_told(count):
    losses = 1.0 - 0.8 * np.arange(count) / count
    # A quarter of the way down, from what was left at seven tenths.
    assert late_fall(history(losses)) == pytest.approx(0.2 / 0.44, abs=0.03)


def test_scatter_of_a_loss_at_rest_is_no_fall():
    rng = np.random.default_rng(1)
    losses = 2.0 + 0.2 * rng.standard_normal((50, 200))
    falls = [late_fall(history(one)) for one in losses]
    assert np.abs(falls).max() < 2 * AT_REST
    assert np.mean(np.array(falls) > AT_REST) < 0.1


@pytest.mark.parametrize("losses", [[], [1.0] * 39, [np.nan] * 100])
def test_too_few_losses_tell_nothing(losses):
    assert np.isnan(late_fall(history(losses)))


def test_losses_that_are_not_finite_are_left_out():
    losses = np.full(100, 3.0)
    losses[10] = np.nan
    assert late_fall(history(losses)) == 0.0


def test_note_names_what_moved_what_was_cut_short_and_nothing_else():
    def row(method, report):
        return {"method": method, "report": report}

    fitted = row("path vanilla", {"walls": 6})
    steady = row("inras vanilla", {"history": history([2.0] * 100)})
    falling = row("avr vanilla", {"history": history(np.linspace(3, 1, 100))})
    short = row("naf vanilla", {"history": history([1.0] * 5)})
    assert "every training had converged" in convergence_note([fitted, steady])
    told = convergence_note([fitted, steady, falling, short])
    assert "in the last quarter: avr vanilla (32 %); " in told
    assert told.endswith("after a few steps: naf vanilla")
