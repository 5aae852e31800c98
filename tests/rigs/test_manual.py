import pytest

from rigs import ManualRig
from rir.errors import RigError
from rir.pose import Pose


def test_the_person_is_told_where():
    asked = []

    def ask(text):
        asked.append(text)
        return True

    ManualRig(ask, name="loudspeaker").move(Pose.at(1, 2, 0.5, yaw_deg=-90))
    assert asked == [
        "put the loudspeaker at x 1.000 m, y 2.000 m, z 0.500 m, facing -90° (pitch 0°)"
    ]


def test_a_refusal_makes_the_place_unknown():
    answers = [True, False]
    rig = ManualRig(lambda _: answers.pop(0))
    rig.move(Pose.at(1, 1, 1))
    with pytest.raises(RigError, match="unknown"):
        rig.move(Pose.at(2, 1, 1))
    assert rig.where() is None
