import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig_ordeal import (
    FAULTS,
    SEPARATION,
    Fault,
    Ordeal,
    random_pose,
    run_sequence,
)

repeatable = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
faults = st.builds(
    Fault,
    kind=st.sampled_from(FAULTS),
    carrier=st.integers(0, 1),
    after=st.floats(0.0, 8.0),
    amount=st.floats(0.1, 2.0),
)


@pytest.mark.slow
@given(seed=st.integers(0, 2**32 - 1))
@repeatable
def test_random_sequences_break_no_rule(seed):
    run_sequence(seed)


@pytest.mark.slow
@given(seed=st.integers(0, 2**32 - 1))
@settings(repeatable, max_examples=20)
def test_lost_steps_are_found_by_confirming(seed):
    run_sequence(seed, calls=2, lost_steps=True)


@pytest.mark.slow
@given(
    planned=st.lists(st.lists(faults, max_size=3), min_size=1, max_size=3),
    seed=st.integers(0, 1000),
)
@repeatable
def test_chosen_faults_break_no_rule(planned, seed):
    rng = np.random.default_rng(seed)
    ordeal = Ordeal(seed)
    ordeal.call("home")
    for together in planned:
        for fault in together:
            ordeal.inflict(fault)
        poses = [random_pose(rng, reach) for reach in ordeal.reaches]
        between = poses[0].position - poses[1].position
        if np.linalg.norm(between[:2]) <= SEPARATION:
            continue
        if not ordeal.call("place", *poses):
            ordeal.call("home")
