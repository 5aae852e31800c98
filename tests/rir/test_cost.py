"""Error against seconds."""

import itertools
import json

import numpy as np
import pytest

from analysis.cli import main
from analysis.cost import write_cost_page
from rir import DatasetError
from rir.cost import CostCurve, measure_cost, measure_costs


def curve_of(errors, seconds, **options):
    ticks = itertools.count()
    times = dict(zip(range(len(errors)), seconds, strict=True))
    return measure_cost(
        "order",
        range(len(errors)),
        lambda k, _: errors[k],
        float,
        quantity="C50",
        unit="dB",
        rng=np.random.default_rng(0),
        seconds=lambda k, _: times[k],
        clock=lambda: next(ticks),
        **options,
    )


def test_front_and_knee_of_a_bent_curve():
    curve = curve_of([8.0, 1.0, 0.9, 0.8, 2.0], [1.0, 2.0, 8.0, 32.0, 30.0])
    assert [p.on_front for p in curve.points] == [True, True, True, True, False]
    assert curve.knee == 1
    # 1.0 -> 0.9 dB is 0.152 halvings for a factor 4: 2^(2 / 0.152)
    factor = 2 ** (2 / np.log2(1 / 0.9))
    assert f"the next halving costs {factor:.2g}×" in curve.sentence


def test_straight_trade_says_what_a_halving_costs():
    curve = curve_of([0.4, 0.2, 0.1], [1.0, 4.0, 16.0])
    assert "costs 4×" in curve.sentence or curve.knee == 2
    first = curve.points[0]
    assert curve._halving_factor(first) == pytest.approx(4.0)


def test_repeats_give_medians_and_intervals_and_use_the_clock():
    draws = itertools.count()
    times = iter(np.arange(0, 1000, 0.5))
    curve = measure_cost(
        "n",
        [1],
        lambda _, rng: float(rng.standard_normal()) * 0 + next(draws),
        float,
        quantity="x",
        repeats=25,
        rng=np.random.default_rng(0),
        clock=lambda: float(next(times)),
    )
    (point,) = curve.points
    assert point.error == 12
    assert (point.error_low, point.error_high) == (7, 17)
    assert point.seconds == 0.5


def test_all_settings_of_a_repeat_see_the_same_draws():
    seen = []
    measure_cost(
        "n",
        [1, 2],
        lambda n, rng: seen.append((n, rng.integers(1 << 30))) or 0.0,
        float,
        quantity="x",
        repeats=3,
        rng=np.random.default_rng(1),
    )
    assert [a[1] for a in seen[::2]] == [b[1] for b in seen[1::2]]
    assert len({a[1] for a in seen}) == 3


def test_save_load_and_page(tmp_path, capsys):
    curve = curve_of([1.0, 0.5, 0.4], [1.0, 2.0, 9.0])
    path = curve.save(tmp_path / "order.json")
    assert CostCurve.load(path) == curve
    page = write_cost_page([curve], tmp_path / "cost.html").read_text()
    assert curve.sentence in page
    assert "<svg" in page
    assert main(["cost", str(path), "--out", str(tmp_path / "page.html")]) == 0
    assert "dB of C50 costs" in capsys.readouterr().out
    path.write_text(json.dumps({"format": "other"}))
    with pytest.raises(DatasetError, match="no cost curve"):
        CostCurve.load(path)


def test_nothing_finite_gives_no_recommendation():
    curve = curve_of([np.nan], [1.0])
    assert curve.knee == -1
    assert "no setting gave a result" in curve.sentence


def test_one_run_gives_a_curve_for_each_quantity_per_thing_made():
    rows = measure_costs(
        "n",
        [1, 4],
        lambda n, _: n,
        lambda n: {"floor": 0.1 / n},
        units={"floor": "ratio", "C50": "dB"},
        rng=np.random.default_rng(0),
        repeats=2,
        seconds=lambda n, _: 8.0 * n,
        count=2,
        per="pair",
        mark="SIMULATED",
    )
    floor, clarity = rows
    assert [p.seconds for p in floor.points] == [4.0, 16.0]
    assert floor.sentence.startswith("SIMULATED: n 4: -32.0 dB of floor costs 16 s a p")
    assert clarity.knee == -1


def test_files_of_before_the_mark_still_open(tmp_path):
    path = curve_of([1.0, 0.5], [1.0, 2.0]).save(tmp_path / "order.json")
    plain = json.loads(path.read_text())
    del plain["mark"], plain["per"]
    path.write_text(json.dumps(plain))
    assert CostCurve.load(path).mark == ""


def test_warming_is_not_timed():
    now = itertools.count()
    curve = measure_cost(
        "n",
        [1],
        lambda n, _: n,
        float,
        quantity="x",
        rng=np.random.default_rng(0),
        warm=lambda _: [next(now) for _ in range(100)],
        clock=lambda: float(next(now)),
    )
    assert curve.points[0].seconds == 1.0
