from pathlib import Path

import numpy as np
import pytest

from capture.config import Channels, SessionConfig
from capture.plan import Measure, Move, build_plan
from capture.session.placing import draw_pairs, load_pairs, pair_between
from rir import ConfigError, RoomSpec

ROOM = RoomSpec.model_validate(
    {
        "name": "box",
        "size_m": (4.0, 3.5, 2.6),
        "surfaces": {"all": {"absorption": 0.3}},
        "furniture": [{"name": "table", "low": (1, 1, 0), "high": (2, 2, 0.8)}],
    }
)


def make_config(count: int = 3, **more: object) -> SessionConfig:
    pairs = draw_pairs(ROOM, count, rng=np.random.default_rng(1))
    return SessionConfig.model_validate({"room": ROOM, "pairs": pairs, **more})


def test_both_directions_follow_each_other_and_starts_alternate() -> None:
    keys = [step.key for step in build_plan(make_config()).measures]
    assert keys == ["P01_AB", "P01_BA", "P02_BA", "P02_AB", "P03_AB", "P03_BA"]


def test_directions_swap_the_very_same_poses() -> None:
    forward, reverse = build_plan(make_config(1)).measures
    assert forward.emitter == reverse.listener
    assert forward.listener == reverse.emitter


def test_fronts_face_each_other() -> None:
    [pair] = make_config(1).pairs
    way = pair.b.pose.position - pair.a.pose.position
    cosine = way @ pair.a.pose.forward / np.linalg.norm(way)
    np.testing.assert_allclose(cosine, 1.0, atol=1e-12)
    cosine = -way @ pair.b.pose.forward / np.linalg.norm(way)
    np.testing.assert_allclose(cosine, 1.0, atol=1e-12)


def test_what_is_done_is_left_out_with_its_moves() -> None:
    plan = build_plan(make_config())
    left = plan.without({"P01_AB", "P01_BA", "P02_BA"})
    assert isinstance(left.steps[0], Move)
    assert (left.steps[0].pair, left.steps[0].direction) == ("P02", "AB")
    assert [step.key for step in left.measures] == ["P02_AB", "P03_AB", "P03_BA"]
    assert len(left.moves) == 3
    assert not plan.without({step.key for step in plan.measures}).steps


def test_estimate_adds_takes_moves_and_waits() -> None:
    config = make_config(2, takes=3, settle_s=2.0)
    plan = build_plan(config, move_s=10.0)
    take = config.sweep.noise_s + config.sweep.seconds + config.sweep.tail_s
    np.testing.assert_allclose(plan.seconds(), 4 * (10 + 2 + 3 * take))


def test_loudspeakers_play_in_turn_at_one_place() -> None:
    offsets = ((0.0, 0.0, 0.0), (0.0, 0.2, 0.0))
    channels = Channels(loudspeakers=(1, 2), loudspeaker_offsets_m=offsets)
    plan = build_plan(make_config(1, channels=channels))
    assert [step.key for step in plan.measures[:2]] == ["P01_AB", "P01_AB-s2"]
    assert len(plan.moves) == 2
    assert isinstance(plan.steps[-1], Measure)


def test_drawn_pairs_keep_their_distances_and_repeat() -> None:
    rng = np.random.default_rng(5)
    pairs = draw_pairs(ROOM, 40, rng=rng, clearance=0.4, apart=1.2)
    assert len({pair.id for pair in pairs}) == 40
    for pair in pairs:
        for place in (pair.a, pair.b):
            ROOM.check_inside(place.position_m, 0.4)
        assert pair.a.pose.distance(pair.b.pose) >= 1.2
    again = draw_pairs(ROOM, 40, rng=np.random.default_rng(5), clearance=0.4, apart=1.2)
    assert again == pairs


def test_a_room_without_space_says_what_to_lower() -> None:
    with pytest.raises(ConfigError, match="found 0 of 5 pairs.*lower --clearance"):
        draw_pairs(ROOM, 5, rng=np.random.default_rng(0), apart=9.0)


def test_pairs_can_be_listed(tmp_path: Path) -> None:
    path = tmp_path / "pairs.yaml"
    path.write_text(
        "pairs:\n- {id: door, a: [1, 1, 1], b: [2, 1, 1]}\n"
        "- {a: [1, 2, 1], b: [3, 3, 1]}\n"
    )
    door, second = load_pairs(path)
    assert door == pair_between("door", np.array([1, 1, 1]), np.array([2, 1, 1]))
    assert second.id == "P02"


def test_mistakes_in_listed_pairs_are_told_together(tmp_path: Path) -> None:
    path = tmp_path / "pairs.yaml"
    path.write_text(
        "pairs:\n- {a: [1, 1], b: [2, 1, 1]}\n- {a: [1, 2, 1], c: [3, 3, 1]}\n"
    )
    with pytest.raises(ConfigError, match=r"(?s)pairs\.0\.a.*pairs\.1\.b"):
        load_pairs(path)


def test_ids_must_differ() -> None:
    pair = pair_between("P01", np.array([1, 1, 1]), np.array([2, 1, 1]))
    with pytest.raises(ValueError, match="twice: P01"):
        SessionConfig(room=ROOM, pairs=[pair, pair])
