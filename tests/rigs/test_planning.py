import itertools

import numpy as np
import pytest

from rigs import Carriers, Envelope, KeepOut, SimulatedRig
from rigs.operation.planview import draw_plan
from rigs.planning.coordination import Coordination
from rigs.planning.distance import segment_box_distance, segment_segment_distance
from rigs.planning.order import visiting_order
from rigs.planning.paths import Roadmap
from rir.errors import OutOfReachError
from rir.pose import Pose


def random_boxes(rng, count):
    lows = rng.uniform([0, 0, 0], [9, 7, 1], (count, 3))
    sizes = rng.uniform(0.2, 1.0, (count, 3))
    return [
        KeepOut(str(k), a, a + b)
        for k, (a, b) in enumerate(zip(lows, sizes, strict=True))
    ]


def random_points(rng, envelope, count):
    points = rng.uniform(envelope.low, envelope.high, (4 * count, 3))
    return points[envelope.contains(points)][:count]


def test_distances_agree_with_dense_sampling():
    rng = np.random.default_rng(0)
    a, b, c, d = rng.normal(size=(4, 60, 3))
    share = np.linspace(0, 1, 201)[:, None, None]
    first, second = a + share * (b - a), c + share * (d - c)
    between = np.linalg.norm(first[:, None] - second[None], axis=-1).min(axis=(0, 1))
    np.testing.assert_allclose(segment_segment_distance(a, b, c, d), between, atol=0.01)
    low, high = np.minimum(c, d), np.maximum(c, d)
    outside = np.maximum(np.maximum(low - first, first - high), 0)
    sampled = np.linalg.norm(outside, axis=-1).min(axis=0)
    np.testing.assert_allclose(
        segment_box_distance(a, b, low, high), sampled, atol=0.02
    )


def test_ways_keep_clear_of_twenty_boxes():
    rng = np.random.default_rng(1)
    envelope = Envelope([0, 0, 0], [10, 8, 3], random_boxes(rng, 20), 0.15)
    points = random_points(rng, envelope, 60)
    roadmap = Roadmap(envelope)
    lengths = roadmap.distances(points, points)
    assert np.isfinite(lengths).all()
    np.testing.assert_allclose(lengths, lengths.T, atol=1e-9)
    bent = 0
    for i, j in itertools.pairwise(range(60)):
        way = np.array(roadmap.way(points[i], points[j]))
        assert envelope.path_gap(way) > 0
        length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
        assert length == pytest.approx(lengths[i, j])
        bent += len(way) > 2
    assert bent > 3


def test_a_walled_in_pose_is_refused():
    wall = KeepOut("wall", [1, -1, -1], [1.2, 9, 9])
    roadmap = Roadmap(Envelope([0, 0, 0], [3, 3, 2], [wall], 0.1))
    with pytest.raises(OutOfReachError, match="no clear way"):
        roadmap.way([0.5, 1, 1], [2, 1, 1])


@pytest.mark.parametrize("column", ["none", "up"])
def test_carriers_change_places_without_meeting(column):
    rng = np.random.default_rng(2)
    boxes = [KeepOut("table", [0.8, 0.8, 0], [1.6, 1.4, 0.7])]
    envelope = Envelope([0, 0, 0.2], [3, 2.5, 2], boxes, 0.1, column)
    rules = Coordination((envelope, envelope), 0.35)
    for _ in range(15):
        while True:
            a, b = random_points(rng, envelope, 2)
            if rules.gap(a, b) > 0.4:
                break
        here = [a, b]
        for step in rules.plan((a, b), (b, a)):
            other = here[1 - step.carrier]
            for start, end in itertools.pairwise(step.way):
                for share in np.linspace(0, 1, 50):
                    assert rules.gap(start + share * (end - start), other) > 0.3499
            assert envelope.path_gap(np.array(step.way)) > 0
            np.testing.assert_allclose(step.way[0], here[step.carrier])
            here[step.carrier] = step.way[-1]
        np.testing.assert_allclose(here, [b, a])


@pytest.mark.parametrize(
    ("end", "gap"),
    [
        ((3.0, 1.5, 0.5), 0.0),  # through the middle
        ((3.0, 1.5, 1.2), 0.2),  # above it, at just the clearance
        ((0.9, 1.5, 0.5), 0.1),  # ends too near
    ],
)
def test_straight_ways_through_keep_outs_are_refused(end, gap):
    table = KeepOut("table", [1, 1, 0], [2, 2, 1])
    envelope = Envelope([0, 0, 0], [4, 3, 2.5], [table], clearance=0.2)
    start = (0.5, 1.5, end[2])
    clear = np.array([start, (0.5, 2.5, end[2]), (3.0, 2.5, end[2])])
    envelope.check_path(clear, "the gantry")
    for way in ([start, end], [end, start], [*clear[::-1], end]):
        with pytest.raises(OutOfReachError, match=rf"gantry.*{gap:.3f} m.*'table'"):
            envelope.check_path(np.array(way), "the gantry")
        assert envelope.path_gap(np.array(way)) == pytest.approx(gap - 0.2, abs=1e-9)
    envelope.check_path(np.array([(*start[:2], 1.21), (*end[:2], 1.21)]))


def test_columns_make_shelves_forbidden_from_below():
    shelf = KeepOut("shelf", [1, 1, 1.2], [2, 2, 1.4])
    below = Pose.at(1.5, 1.5, 0.5)
    Envelope([0, 0, 0], [3, 3, 2], [shelf]).check(below)
    with pytest.raises(OutOfReachError, match="shelf"):
        Envelope([0, 0, 0], [3, 3, 2], [shelf], column="up").check(below)


def test_the_order_of_few_pairs_is_the_best_one():
    rng = np.random.default_rng(3)
    a, b = rng.uniform(0, 4, (2, 5, 3))
    swaps = 2 * np.linalg.norm(a - b, axis=1).sum()
    best = np.inf
    for order in itertools.permutations(range(5)):
        for swapped in itertools.product((False, True), repeat=5):
            first = [(b if s else a)[k] for k, s in zip(order, swapped, strict=True)]
            second = [(a if s else b)[k] for k, s in zip(order, swapped, strict=True)]
            ways = [
                np.linalg.norm(second[k] - first[k + 1])
                + np.linalg.norm(first[k] - second[k + 1])
                for k in range(4)
            ]
            best = min(best, swaps + sum(ways))
    visits = visiting_order(a, b, rng=np.random.default_rng(0))
    assert visits.travel == pytest.approx(best)


def test_the_order_starts_where_the_carriers_are():
    a = np.array([[0.0, 0, 0], [10, 0, 0]])
    b = a + np.array([0.0, 1.0, 0.0])
    start = np.array([11.0, 1, 0]), np.array([11.0, 0, 0])
    visits = visiting_order(a, b, rng=np.random.default_rng(0), start=start)
    assert visits.order.tolist() == [1, 0]
    assert visits.swapped.tolist() == [True, True] or visits.swapped[0]


def test_carriers_order_and_place_their_pairs():
    envelope = Envelope([0, 0, 0], [4, 3, 2], [KeepOut("t", [1, 1, 0], [2, 2, 1])], 0.1)
    seen = []
    rigs = [
        SimulatedRig(seen.append, envelope=envelope, start=Pose.at(x, 0.2, 1.5))
        for x in (0.2, 3.8)
    ]
    carriers = Carriers(*rigs, separation=0.4)
    rng = np.random.default_rng(4)
    points = random_points(rng, envelope, 12).reshape(6, 2, 3)
    pairs = [(Pose(a), Pose(b)) for a, b in points if np.linalg.norm(a - b) > 0.5]
    visits = carriers.order(pairs)
    assert sorted(visits.order) == list(range(len(pairs)))
    for k, swapped in zip(visits.order, visits.swapped, strict=True):
        a, b = pairs[k][::-1] if swapped else pairs[k]
        for goal in ((a, b), (b, a)):
            assert carriers.place(*goal) == goal
    with pytest.raises(OutOfReachError, match="keep-out 't'"):
        carriers.order([(Pose.at(1.5, 1.5, 0.5), pairs[0][1])])


def test_the_plan_view_shows_what_stands_where():
    envelope = Envelope([0, 0, 0], [4, 3, 2], [KeepOut("t", [1, 1, 0], [2, 2, 1])])
    pair = Pose.at(3, 0.5, 1), Pose.at(3, 2.5, 1)
    lines = draw_plan(envelope, [pair], (Pose.at(0, 0, 1), Pose.at(4, 3, 1)), width=40)
    picture = "\n".join(lines)
    assert lines[1].endswith("L│")
    assert lines[-3].startswith("│E")
    assert picture.count("a") == picture.count("b") == 1
    assert picture.count("▒") == 55
