from collections.abc import Callable, Iterator, Sequence

import pytest

from capture.config import SessionConfig
from capture.devices.movers import Person, Redo, RigPair, Skip
from capture.plan import Move, build_plan
from capture.session.engine import Session
from capture.session.journal import Event
from rigs import Carriers, SimulatedRig, VirtualClock
from rir import OutOfReachError, Pose, RigError

MakeConfig = Callable[..., SessionConfig]
MakeSession = Callable[..., Session]


class Operator:
    """Somebody who answers as scripted, and remembers what was said."""

    def __init__(self, *answers: str) -> None:
        self.answers: Iterator[str] = iter(answers)
        self.heard: list[str] = []
        self.notes: list[str] = []
        self.clock = VirtualClock()

    def ask(self, text: str) -> str:
        self.heard.append(text)
        return next(self.answers)

    def person(self, config: SessionConfig) -> Person:
        return Person(
            config.room,
            ask=self.ask,
            tell=self.heard.append,
            note=self.notes.append,
            clock=self.clock,
        )


def moves(config: SessionConfig) -> list[Move]:
    return build_plan(config).moves


def test_enter_starts_after_a_countdown(make_config: MakeConfig) -> None:
    config = make_config()
    operator = Operator("")
    move = moves(config)[0]
    assert operator.person(config).place(move) == (move.emitter, move.listener)
    assert operator.clock.now() == 5.0
    assert "P01A: put the loudspeaker at x" in operator.heard[0]
    assert "P01B: put the microphone at x" in operator.heard[0]
    assert operator.heard[-1] == "starting in 1 s"


def test_the_second_direction_is_called_a_swap(make_config: MakeConfig) -> None:
    config = make_config()
    operator = Operator("", "d")
    person = operator.person(config)
    for move in moves(config):
        person.place(move)
    assert any(text.startswith("SWAP the stands: P01B:") for text in operator.heard)
    assert operator.clock.now() == 20.0


@pytest.mark.parametrize(
    ("key", "request_"), [("s", Skip), ("r", Redo), ("q", KeyboardInterrupt)]
)
def test_keys_ask_for_what_they_say(
    make_config: MakeConfig, key: str, request_: type[BaseException]
) -> None:
    config = make_config()
    with pytest.raises(request_):
        Operator(key).person(config).place(moves(config)[0])


def test_notes_pauses_and_wrong_keys_ask_again(make_config: MakeConfig) -> None:
    config = make_config()
    operator = Operator("x", "n", "door was open", "p", "", "")
    operator.person(config).place(moves(config)[0])
    assert operator.notes == ["door was open"]
    assert "'x' is none of the keys" in operator.heard


def steered(session: Session, *answers: str) -> Operator:
    operator = Operator(*answers)
    person = operator.person(session.config)
    simulated = session.mover

    class Both(Person):
        """Ask the operator, then let the simulated rigs follow."""

        def __init__(self) -> None:
            self.__dict__ = person.__dict__

        def place(self, step: Move) -> tuple[Pose, Pose]:
            super().place(step)
            return simulated.place(step)

    session.mover = Both()
    return operator


def test_a_skipped_direction_is_missing_in_the_end(make_session: MakeSession) -> None:
    session = make_session()
    steered(session, "s", "")
    assert session.run() == ["P01_AB"]
    assert session.state.accepted("P01_BA")


def test_redo_measures_the_last_direction_again(make_session: MakeSession) -> None:
    session = make_session()
    steered(session, "", "r", "", "")
    assert session.run() == []
    assert [take.name for take in session.state.accepted("P01_AB")] == ["P01_AB_2"]
    assert [take.name for take in session.state.accepted("P01_BA")] == ["P01_BA_1"]
    assert not session.state.takes["P01_AB_1"].accepted


def test_redo_of_nothing_just_asks_again(make_session: MakeSession) -> None:
    session = make_session()
    steered(session, "r", "", "")
    assert session.run() == []


class Lost(SimulatedRig):
    """A rig that does not know where it is until it is homed."""

    homed = False

    def home(self) -> None:
        self.homed = True

    def move(self, pose: Pose, via: Sequence[Pose] = ()) -> Pose:
        if not self.homed:
            raise RigError("position lost")
        return super().move(pose, via)


@pytest.mark.parametrize("agrees", [True, False])
def test_a_lost_rig_is_homed_only_with_consent(
    make_config: MakeConfig, agrees: bool
) -> None:
    move = moves(make_config())[0]
    pair = RigPair(Carriers(Lost(), Lost()), ask=lambda _: agrees)
    if agrees:
        assert pair.place(move) == (move.emitter, move.listener)
    else:
        with pytest.raises(RigError, match="position lost"):
            pair.place(move)


def test_places_outside_the_room_are_refused(make_config: MakeConfig) -> None:
    config = make_config()
    move = Move("P01", "AB", Pose.at(-1, 1, 1), Pose.at(1, 1, 1))
    with pytest.raises(OutOfReachError):
        Operator().person(config).check(move)


def test_a_doubtful_pair_can_be_measured_again(
    make_session: MakeSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = make_session()
    judge = session.pair_judge.judge
    doubts = iter([["was the wrong stand moved?"], []])

    def doubting(*keys: object) -> Event | None:
        figures = judge(*keys)  # type: ignore[arg-type]
        return figures and {**figures, "doubts": next(doubts)}

    monkeypatch.setattr(session.pair_judge, "judge", doubting)
    operator = steered(session, "", "", "y", "")
    assert session.run() == []
    assert any("Measure this direction again?" in text for text in operator.heard)
    assert [take.name for take in session.state.accepted("P01_BA")] == ["P01_BA_2"]
