import numpy as np
import pytest

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
