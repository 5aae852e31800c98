"""Paired and un-paired distances."""

import numpy as np
import pytest

from analysis import METRICS, paper_metrics
from analysis.reciprocity import measure_pairs
from rir import DatasetError


def test_noise_free_pairs_are_equal(new_session):
    (room,) = measure_pairs(new_session(4, noise_db=-400))
    for symbol, values in room.paired.items():
        np.testing.assert_allclose(values, 0, atol=1e-9, err_msg=symbol)
    assert room.simulated
    assert room.mark == "SIMULATED"


def test_every_ordered_stranger_is_compared(session):
    (room,) = measure_pairs(session)
    assert {len(v) for v in room.unpaired.values()} == {12 * 10}
    assert np.all(room.strangers[:, 0] != room.strangers[:, 1])


def test_paired_distances_equal_the_metrics_in_both_orders(session):
    (room,) = measure_pairs(session, duration=0.1)
    pair = room.pairs[2]
    a, b = (session.responses[int(r[0])][:1600] for r in (pair.forward, pair.reverse))
    there, back = paper_metrics(a, b, 16000), paper_metrics(b, a, 16000)
    for symbol in METRICS:
        np.testing.assert_allclose(room.paired[symbol][2, 0], there[symbol])
        np.testing.assert_allclose(room.paired[symbol][2, 1], back[symbol])


def test_large_sets_are_compared_in_random_groups(new_session, monkeypatch):
    monkeypatch.setattr("analysis.reciprocity.MAX_STRANGERS", 60)
    (room,) = measure_pairs(new_session(8), symbols=["C50"])
    assert len(room.unpaired["C50"]) < 16 * 14
    assert set(room.strangers.ravel()) == set(range(8))


def test_incomplete_and_broken_pairs_are_counted_out_with_a_reason(new_session):
    whole = new_session(4)
    part = whole.subset(np.r_[0, 2:8])
    (room,) = measure_pairs(part, symbols=["Amp"])
    assert len(room.pairs) == 3
    assert room.excluded == [("memory/0", "no accepted take from B to A")]
    spoiled = new_session(2, columns={"accepted": [True, True, False, False]})
    (room,) = measure_pairs(spoiled, symbols=["Amp"])
    assert room.excluded == [("memory/1", "no accepted take")]
    with pytest.raises(DatasetError, match="no complete reciprocity pair"):
        measure_pairs(whole.subset([0, 2]))


def test_takes_of_a_pair_are_averaged(new_session):
    once = new_session(2, seed=1)
    double = new_session(2, seed=1, columns={})
    rows = np.r_[0:4, 0:4]
    both = double.subset(rows)
    a, b = (measure_pairs(d, symbols=["Amp"])[0] for d in (once, both))
    np.testing.assert_allclose(a.paired["Amp"], b.paired["Amp"])


def test_a_directional_loudspeaker_is_not_reciprocal(session, directional_session):
    (omni,), (cardioid,) = measure_pairs(session), measure_pairs(directional_session)
    for symbol in ("Amp", "Env", "C50", "STFT"):
        assert cardioid.paired[symbol].mean() > 3 * omni.paired[symbol].mean()
