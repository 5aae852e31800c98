"""What answers where paths do not: symmetric, measured, stored and told in words."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fields import load_field, train
from fields.data import prepare
from fields.joined import FieldWithNetwork, held_out_rows, train_network
from fields.models.path import Config, PathField
from fields.plan import TrainingPlan
from inverse.acoustics import Acoustics
from inverse.blend.aligned import AlignedRows
from inverse.blend.direct_levels import DirectLevels
from inverse.blend.mixture import mix, mixing_weights
from inverse.find import room_in_rows
from inverse.guard import needs_network
from inverse.late.agreement import Agreement, bins_after
from inverse.late.gate import TileEnergies
from inverse.rows.directivity import directivity
from inverse.rows.fitset import FitSet, place_numbers
from inverse.rows.proof import Proof, prove
from inverse.rows.reading import read_rows
from inverse.rows.tiles import Tiles
from inverse.search import PriorKnowledge
from rir import Dataset, Poses, TrainingError

RATE, LENGTH, SPEED = 16000.0, 1600, 343.2


def diffuse_rows(count=120, places=4, seed=0, pattern=0.0, latency=0):
    """Return a room of direct sounds and decaying noise; nothing reflects as a wall.

    The loudspeakers look along x, with a level of 1 + pattern cos.
    """
    rng = np.random.default_rng(seed)
    emitters = rng.uniform([1, 1, 1], [5, 3.5, 2], (places, 3))
    emitters = np.repeat(emitters, -(-count // places), axis=0)[:count]
    listeners = rng.uniform([0.5, 0.5, 0.5], [6, 4, 2.5], (count, 3))
    gap = listeners - emitters
    distances = np.linalg.norm(gap, axis=1)
    level = (1 + pattern * gap[:, 0] / distances) / distances
    times = np.arange(LENGTH) / RATE
    noise = 0.1 * rng.standard_normal((count, LENGTH)) * np.exp(-25 * times)
    index = np.rint(distances / SPEED * RATE).astype(int) + latency
    noise[np.arange(LENGTH) < index[:, None] + 40] = 0
    noise[np.arange(count), index] = level
    return FitSet(
        noise,
        Poses.of(emitters),
        Poses.of(listeners),
        RATE,
        SPEED,
        place_numbers(emitters),
        np.zeros(count, dtype=np.int64),
    )


def dataset(rows):
    first = rows.emitters.positions[:: len(rows) // rows.n_places]
    grid = rows.listeners.positions[:12]
    responses = np.zeros((len(first), len(grid), LENGTH))
    rng = np.random.default_rng(1)
    times = np.arange(LENGTH) / RATE
    for k, emitter in enumerate(first):
        for m, listener in enumerate(grid):
            reach = float(np.linalg.norm(emitter - listener))
            start = round(reach / SPEED * RATE)
            wave = 0.1 * rng.standard_normal(LENGTH) * np.exp(-25 * times)
            wave[: start + 40] = 0
            wave[start] = 1 / reach
            responses[k, m] = wave
    return Dataset.from_arrays(responses, first, grid, sample_rate=round(RATE))


@pytest.fixture(scope="module")
def rows():
    return diffuse_rows()


@pytest.fixture(scope="module")
def acoustics(rows):
    return room_in_rows(rows)


def test_a_room_without_walls_is_answered_by_direct_sounds_and_late_energy(acoustics):
    assert acoustics.report()["walls"] == 0
    fresh = diffuse_rows(60, seed=5)
    told = acoustics.predict(fresh.emitters, fresh.listeners, LENGTH)
    proof = prove(
        fresh,
        {
            "told": told,
            "rows": AlignedRows.of(diffuse_rows()).predict(
                fresh.emitters, fresh.listeners, LENGTH
            ),
        },
    )
    assert proof.best == "told"
    assert proof.scores["told"]["C50"] < 0.6
    assert proof.ratio("told", "rows") < 0.7


def test_exchanged_ends_hear_the_same_bits(acoustics, rows):
    there = acoustics.predict(rows.emitters[:20], rows.listeners[:20], LENGTH)
    back = acoustics.predict(rows.listeners[:20], rows.emitters[:20], LENGTH)
    scale = np.abs(there).max()
    assert np.abs(there - back).max() <= 1e-12 * scale


def test_a_stored_rest_answers_the_same(acoustics, rows, tmp_path):
    kept = acoustics.as_arrays()
    np.savez(tmp_path / "one.npz", **kept)
    with np.load(tmp_path / "one.npz", allow_pickle=False) as stored:
        again = Acoustics.from_arrays(dict(stored))
    ends = rows.emitters[:6], rows.listeners[:6], LENGTH
    assert_allclose(again.predict(*ends), acoustics.predict(*ends), atol=1e-9)
    assert again.report()["held_out"] == acoustics.report()["held_out"]
    assert again.alarms == acoustics.alarms


def test_alarms_say_that_no_wall_is_sure_and_what_answers(acoustics):
    words = " ".join(acoustics.alarms)
    assert "no walls were found" in words or "none is believed" in words
    assert "late sound answer" in words


def test_rows_left_out_never_hear_their_own_emitter(rows):
    kept = AlignedRows.of(rows)
    own = kept.predict(rows.emitters, rows.listeners, LENGTH)
    apart = kept.left_out(rows)
    close = ((own - rows.responses) ** 2).sum() / (rows.responses**2).sum()
    far = ((apart - rows.responses) ** 2).sum() / (rows.responses**2).sum()
    assert close < 0.2
    assert far > 2 * close


def test_a_voice_that_explains_is_taken_as_it_is():
    tiles = Tiles(RATE, LENGTH)
    rng = np.random.default_rng(0)
    truth, other = rng.standard_normal((2, 10, LENGTH))
    weights = mixing_weights(truth, [truth, other], tiles)
    assert (weights[0] == 1).all()
    assert_array_equal(mix(tiles, weights, [truth, other]), truth)


def test_weights_find_the_voice_that_is_right_at_the_time():
    tiles = Tiles(RATE, LENGTH)
    rng = np.random.default_rng(0)
    truth, one, other = rng.standard_normal((3, 20, LENGTH))
    one[:, :800] = truth[:, :800]
    other[:, 800:] = truth[:, 800:]
    weights = mixing_weights(truth, [one, other], tiles)
    error = ((mix(tiles, weights, [one, other]) - truth) ** 2).sum()
    assert error < 0.1 * (truth**2).sum()


def test_directivity_is_told_from_places_left_out():
    assert directivity(diffuse_rows(places=5), 0.0) < 0.1
    assert directivity(diffuse_rows(places=5, pattern=0.9), 0.0) > 0.8


def test_direct_levels_follow_the_aim_of_the_loudspeaker():
    heard = diffuse_rows(160, 5, pattern=0.8)
    dull = np.array(heard.responses)
    index = np.rint(heard.distances / SPEED * RATE).astype(int)
    dull[np.arange(160), index] = 1 / heard.distances
    launch = DirectLevels.fit(heard, dull, 0.0)
    fresh = diffuse_rows(60, 5, seed=3, pattern=0.8)
    told = np.array(fresh.responses)
    index = np.rint(fresh.distances / SPEED * RATE).astype(int)
    told[np.arange(60), index] = 1 / fresh.distances
    moved = launch.apply(told, fresh.emitters, fresh.listeners)
    lines = np.arange(60), index
    before = np.abs(told[lines] / fresh.responses[lines] - 1).mean()
    after = np.abs(moved[lines] / fresh.responses[lines] - 1).mean()
    assert after < 0.35 * before


def test_a_network_is_asked_only_where_nothing_explains(acoustics, rows):
    assert needs_network(acoustics, rows)
    assert not needs_network(acoustics, rows.rows(np.arange(20)))
    others = {"C50": 1.0, "T60": 10.0}
    sure = Proof({"path": {"C50": 0.1, "T60": 2.0}, "rows": others})
    better = replace(acoustics, blend=replace(acoustics.blend, proof=sure))
    assert not needs_network(better, rows)


def test_a_network_answers_both_ways_alike_and_comes_back(rows, tmp_path, monkeypatch):
    from fields.models import path as module

    monkeypatch.setattr(module, "needs_network", lambda *_: True)
    held = dataset(rows)
    field = train(held, model="path", steps=3)
    assert isinstance(field, module.PathField)
    assert any("network" in one for one in field.alarms)
    from fields.data import prepare

    data = prepare(held)
    network, hidden, said = train_network(data, TrainingPlan(), 3, alike=True)
    assert said.shape == (hidden.sum(), LENGTH)
    assert hidden.any()
    assert not hidden.all()
    there = network.predict(data.emitters[:7], data.listeners[:7], LENGTH)
    back = network.predict(data.listeners[:7], data.emitters[:7], LENGTH)
    assert_array_equal(there, back)
    told = np.asarray(data.responses[np.flatnonzero(hidden)], dtype=float)
    field.joined = FieldWithNetwork.fit(network, told, 0.5 * told, said)
    again = load_field(field.save(tmp_path / "one"))
    ends = data.emitters[:5], data.listeners[:5]
    assert_allclose(again.predict(*ends), field.predict(*ends), atol=1e-6)
    with np.load(tmp_path / "one.npz", allow_pickle=False) as stored:
        older = {name: one for name, one in stored.items() if name != "unexplained"}
    np.savez(tmp_path / "older.npz", **older)
    with pytest.raises(TrainingError, match="older program wrote it"):
        load_field(tmp_path / "older.npz")


def test_held_out_rows_of_a_single_emitter_are_listeners(rows):
    from fields.data import prepare

    held = dataset(rows)
    alone = prepare(held).rows(np.arange(12))
    hidden = held_out_rows(alone)
    assert hidden.any()
    assert not hidden.all()


def test_ends_of_an_answer_with_a_network_may_be_exchanged():
    held = dataset(diffuse_rows())
    data, measured = prepare(held), read_rows(held)
    assert_array_equal(measured.responses, data.responses)
    plan = TrainingPlan(steps=3)
    acoustics = room_in_rows(measured, prior=PriorKnowledge(aimed=False))
    network, hidden, said = train_network(data, plan, 3, alike=True)
    unheard = measured.rows(np.flatnonzero(hidden))
    ends = unheard.emitters, unheard.listeners
    told = acoustics.predict(*ends, unheard.n_samples)
    joined = FieldWithNetwork.fit(network, unheard.responses, told, said)
    field = PathField(acoustics, data.frame, Config(), joined=joined)
    there = field.predict_exactly(*ends)
    back = field.predict_exactly(*ends[::-1])
    assert np.abs(there - told * data.frame.scale).max() > 0
    assert_allclose(back, there, rtol=0, atol=1e-12 * np.abs(there).max())


def test_agreement_is_one_where_waveforms_are_the_same_and_none_where_they_are_not():
    rng = np.random.default_rng(2)
    rows = diffuse_rows()
    tiles = Tiles(RATE, LENGTH)
    told = rows.responses.copy()
    late = np.arange(LENGTH) / RATE > rows.distances[:, None] / SPEED + 0.025
    told[late] = 0.02 * rng.standard_normal(int(late.sum()))
    held = TileEnergies(
        tiles.energies(rows.responses),
        tiles.energies(told),
        tiles.products(rows.responses, told),
        tiles.products(rows.responses, np.roll(told, 1, axis=0)),
    )
    after = bins_after(rows.distances, SPEED, tiles)
    apart = np.zeros(len(rows))
    shares, _ = Agreement.fit(held, after, apart).between(after, apart)
    wide = shares[:, 2:]
    index = np.broadcast_to(after[:, None], wide.shape)
    assert wide[index == 1].min() == 1
    assert wide[(index > 8) & (index < 16)].max() == 0
