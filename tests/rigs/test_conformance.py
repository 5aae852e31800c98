"""What every kind of rig in the table must do."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from rigs import RIGS
from rigs.conformance import ENVELOPE, INSIDE, check_rig, homed
from rir.errors import OutOfReachError
from rir.pose import Pose

DIALOGUE = {
    "dialogue": yaml.safe_load(Path(__file__).with_name("turntable.yaml").read_text())
}
EXAMPLES = {
    "simulated": {"envelope": ENVELOPE},
    "manual": {"envelope": ENVELOPE},
    "grbl": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "frame": {"origin_m": [2.5, 2.5, 2.1]},
        "free_orientation": True,
    },
    "marlin": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "free_orientation": True,
        "board": {"high_mm": [2000, 2000, 2000], "feed_mm_per_min": 9000},
    },
    "turntable": {
        "port": "simulated",
        "envelope": ENVELOPE,
        "stage": {"axis": "x", "low": 0, "high": 2000, "speed": 200, **DIALOGUE},
        "fixed": {"y": 400, "z": 1000},
    },
    "composite": {
        "envelope": ENVELOPE,
        "frame": {"origin_m": [2.5, 2.5, 2.1]},
        "parts": [
            {"kind": "grbl", "port": "simulated"},
            {"kind": "turntable", "port": "simulated", "stage": DIALOGUE},
        ],
    },
}


def test_every_kind_has_an_example():
    assert set(EXAMPLES) == set(RIGS)


@pytest.mark.parametrize("name", list(EXAMPLES))
def test_every_kind_conforms(name):
    check_rig(name, EXAMPLES[name])


@pytest.mark.parametrize("name", ["grbl", "marlin", "composite"])
def test_a_machine_refuses_the_straight_way_through_a_keep_out(name):
    with homed(name, EXAMPLES[name]) as rig:
        before, beyond = Pose.at(1.05, 0.4, 0.2), Pose.at(1.8, 0.4, 1.35)
        above = Pose.at(1.05, 0.4, 1.35)
        rig.move(before, via=[INSIDE])
        for via in ([], [before]):
            with pytest.raises(OutOfReachError, match=r"straight way .*'table'"):
                rig.move(beyond, via=via)
            here = rig.where()
            assert here is not None
            np.testing.assert_allclose(here.position, before.position, atol=1e-4)
        reached = rig.move(beyond, via=[above])
        np.testing.assert_allclose(reached.position, beyond.position, atol=1e-4)
