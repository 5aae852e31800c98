import pytest

from rigs import load_rig
from rir.errors import ConfigError
from rir.pose import Pose

GOOD = """
name: two thoughts
emitter: {kind: simulated, settle_s: 0.0}
listener:
  kind: simulated
  settle_s: 0.0
  envelope: {low_m: [0, 0, 0], high_m: [2, 2, 2]}
separation_m: 0.3
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "rig.yaml"
        path.write_text(text)
        return path

    return write


def test_both_carriers_report_to_their_own_callback(write):
    emitter, listener = [], []
    path = write(GOOD)
    carriers = load_rig(path, on_emitter=emitter.append, on_listener=listener.append)
    carriers.place(Pose.at(1, 1, 1), Pose.at(2, 1, 1))
    assert [p.position.tolist() for p in emitter] == [[1, 1, 1]]
    assert [p.position.tolist() for p in listener] == [[2, 1, 1]]
    assert carriers.separation == 0.3


def test_a_mistake_is_named_with_its_place(write):
    path = write(GOOD.replace("high_m: [2, 2, 2]", "high_m: [2, 2]"))
    with pytest.raises(ConfigError, match=r"listener.*envelope\.high_m"):
        load_rig(path)


def test_all_mistakes_are_told_at_once(write):
    text = GOOD.replace("settle_s: 0.0}", "setle_s: 0.0}").replace(
        "kind: simulated\n", "kind: simulatd\n"
    )
    with pytest.raises(ConfigError, match=r"(?s)setle_s.*'simulatd'"):
        load_rig(write(text))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("- 1\n- 2\n", "(whole file): should hold keys and values, not a list"),
        (
            "name: x\nemitter: {kind: sledge}\nlistener: {kind: manual}\n",
            "emitter: no kind 'sledge'; known: grbl, marlin,",
        ),
    ],
)
def test_what_a_rig_file_is_not_is_said_in_plain_words(write, text, told):
    with pytest.raises(ConfigError) as refused:
        load_rig(write(text))
    assert told in str(refused.value)
    assert "Input" not in str(refused.value)
