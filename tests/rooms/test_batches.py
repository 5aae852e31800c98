"""Pairs in batches, shared by threads, are what each pair is alone."""

from dataclasses import replace

import numpy as np
import pytest

from rir import GainPattern
from rooms.batches import batches, in_threads
from rooms.builtin import load_scene
from rooms.hardware import DeviceResponse, Hardware
from rooms.places import random_places
from rooms.scene import Scene
from rooms.simulation import simulate

RUN = {
    "sample_rate": 8000, "duration": 0.1, "rays": 200, "max_order": 1,
    "effects": ["patterns", "scattering", "air", "direct", "specular", "late"],
}  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    return replace(load_scene("l-shaped"), emitter_gain=GainPattern.cardioid())


@pytest.fixture(scope="module")
def places(scene):
    return random_places(scene, 7, np.random.default_rng(0))


@pytest.fixture(scope="module")
def together(scene, places):
    return simulate(scene, places[:2], places[2:], **RUN).responses


def test_batches_hold_every_pair_once():
    for emitters, listeners, threads in ((1, 1, 4), (2, 300, 1), (9, 5, 3), (3, 0, 2)):
        parts = batches(emitters, listeners, threads)
        pairs = [
            (i, j) for part in parts for i in part.emitters for j in part.listeners
        ]
        assert len(set(pairs)) == len(pairs) == emitters * listeners
        assert len(parts) >= min(threads, listeners)


def test_emitters_share_rays_and_hear_what_each_hears_alone(scene, places, together):
    alone = simulate(scene, places[1], places[4], **RUN).responses
    np.testing.assert_array_equal(together[1, 2], alone[0, 0])


def test_threads_change_nothing_and_all_pairs_are_told(scene, places, together):
    told = []
    shared = simulate(
        scene, places[:2], places[2:], **RUN, threads=3, tell=lambda *n: told.append(n)
    )
    np.testing.assert_array_equal(shared.responses, together)
    assert told[-1] == (10, 10)


def test_a_moving_emitter_costs_what_a_moving_listener_costs(scene, places):
    many = simulate(scene, places[:5], places[6], **RUN)
    other = replace(
        scene, emitter_gain=scene.listener_gain, listener_gain=scene.emitter_gain
    )
    back = simulate(other, places[6], places[:5], **RUN)
    np.testing.assert_array_equal(many.responses[:, 0], back.responses[0])
    single = simulate(scene, places[3], places[6], **RUN).responses[0, 0]
    error = many.responses[3, 0] - single
    assert np.sum(error**2) < 1e-12 * np.sum(single**2)


def test_every_pair_has_noise_of_its_own():
    chain = Hardware(noise_db=-40.0)
    quiet = Scene.shoebox((4, 3, 2.5), absorption=1.0, hardware=chain)
    ends = [[1, 1, 1], [2, 1, 1]], [[3, 1, 1], [3, 2, 1]]
    made = simulate(quiet, *ends, sample_rate=8000, duration=0.05).responses
    noise = made.reshape(4, -1)[:, 200:]
    assert np.abs(np.corrcoef(noise) - np.eye(4)).max() < 0.3


def test_a_chain_delivers_of_many_pairs_what_it_delivers_of_each():
    flat = DeviceResponse(np.array([100.0, 1000.0]), np.array([-10.0, 0.0]))
    chain = Hardware(loudspeaker=flat, drift_ppm=3.0)
    pairs = np.random.default_rng(0).standard_normal((7, 960))
    together = chain.heard(pairs, 16000, np.random.default_rng(0))
    alone = [
        chain.heard(pair[None], 16000, np.random.default_rng(0))[0] for pair in pairs
    ]
    np.testing.assert_array_equal(together, alone)


def test_what_fails_in_a_thread_ends_all():
    def work(part: int) -> int:
        return 1 // part

    with pytest.raises(ZeroDivisionError):
        list(in_threads(work, [1, 0, 1], 2))
