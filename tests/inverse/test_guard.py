"""Sets whose poses, units or rates are wrong: never worse than the nearest row."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from inverse.acoustics import Acoustics
from inverse.blend.fallback import NearestRows
from inverse.find import room_in_rows
from inverse.guard import guarded
from inverse.rows.proof import Proof


class LateRest:
    """Answer everything 20 ms late, as with poses in the wrong units."""

    proof = Proof()

    def left_out(self, early, rows):
        return np.roll(early, round(0.02 * rows.sample_rate), axis=1)

    apply = left_out


def test_what_is_worse_than_the_nearest_row_gives_way_to_it(box_set, unseen_set):
    late: Any = LateRest()
    spoiled = replace(room_in_rows(box_set), blend=late, unexplained=0.9)
    acoustics = guarded(spoiled, box_set)
    ends = unseen_set.emitters, unseen_set.listeners, unseen_set.n_samples
    assert_array_equal(acoustics.predict(*ends), NearestRows.of(box_set).predict(*ends))
    assert any("the nearest response is answered" in one for one in acoustics.alarms)


def test_rows_that_do_not_follow_the_poses_are_not_retimed(box_set):
    rng = np.random.default_rng(1)
    noise = replace(box_set, responses=rng.standard_normal(box_set.responses.shape))
    assert not NearestRows.of(noise).retimed
    assert NearestRows.of(box_set).retimed


def test_a_place_left_out_is_told_by_others_only(box_set):
    kept = replace(NearestRows.of(box_set), retimed=False)
    told = kept.left_out(box_set)
    own = [
        np.flatnonzero((np.abs(row - kept.responses) < 1e-6).all(axis=1))[0]
        for row in told
    ]
    assert (box_set.places[own] != box_set.places).all()


def test_nearest_rows_are_stored_with_how_they_answer(box_set):
    kept = replace(NearestRows.of(box_set), retimed=False)
    again = Acoustics.from_arrays(Acoustics(None, kept, None, 1.0).as_arrays()).rows
    assert again is not None
    assert again.retimed is False
    ends = box_set.emitters, box_set.listeners, box_set.n_samples
    assert_allclose(again.predict(*ends), kept.predict(*ends))


def test_a_room_that_is_understood_is_left_alone(box_set):
    acoustics = room_in_rows(box_set)
    assert guarded(acoustics, box_set) is acoustics
