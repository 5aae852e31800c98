from collections.abc import Callable

import numpy as np
import pytest

from capture.session.engine import Session
from capture.session.outliers import find_outlier, take_distances

MakeSession = Callable[..., Session]


def takes(noise: float = 1e-3) -> np.ndarray:
    rng = np.random.default_rng(0)
    clean = rng.standard_normal(4000) * np.exp(-np.arange(4000) / 600)
    return clean + noise * rng.standard_normal((4, 4000))


def test_alike_takes_have_the_distance_of_their_noise() -> None:
    found = takes()
    expected = 10 * np.log10(4000e-6 / np.sum(found[0] ** 2))
    # The median of four is itself noisy, and follows each of them a little.
    np.testing.assert_allclose(take_distances(found), expected, atol=2.5)
    assert find_outlier(found) is None


@pytest.mark.parametrize("harm", ["knock", "moved", "louder"])
def test_a_spoiled_take_is_found(harm: str) -> None:
    found = takes()
    if harm == "knock":
        found[2, 1000:1400] += 0.02
    elif harm == "moved":
        found[2] = np.roll(found[2], 2)
    else:
        found[2] *= 1.01
    outlier = find_outlier(found)
    assert outlier is not None
    assert outlier[0] == 2
    assert "differs from the median take" in outlier[1]


def test_two_takes_cannot_tell_who_is_wrong() -> None:
    assert find_outlier(takes()[:2] * [[1.0], [2.0]]) is None


def test_equal_takes_agree() -> None:
    assert find_outlier(np.ones((3, 10))) is None


def test_a_session_makes_an_outlier_again(make_session: MakeSession) -> None:
    fault = {"kind": "gain", "takes": "P01_AB_2", "amount": 0.04, "channel": 0}
    session = make_session(takes=3, simulation={"noise_db": -60.0, "faults": [fault]})
    assert session.run() == []
    names = [take.name for take in session.state.accepted("P01_AB")]
    assert names == ["P01_AB_1", "P01_AB_3", "P01_AB_4"]
    assert not session.state.takes["P01_AB_2"].accepted
