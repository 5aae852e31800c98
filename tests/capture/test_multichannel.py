from collections.abc import Callable

import numpy as np

from capture.build import build_dataset
from capture.mounting import mounted
from capture.session import Session
from rir import Dataset

MakeSession = Callable[..., Session]

MICROPHONES = [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.05, 0.0, 0.2], [-0.1, 0.0, 0.0]]
CHANNELS = {
    "microphones": [1, 2, 3, 4],
    "loopback": 5,
    "loudspeakers": [1, 2],
    "microphone_offsets_m": MICROPHONES,
    "loudspeaker_offsets_m": [[0.0, 0.0, 0.0], [0.0, -0.15, 0.0]],
}


def test_every_speaker_meets_every_microphone_at_its_place(
    make_session: MakeSession,
) -> None:
    session = make_session(channels=CHANNELS)
    assert session.run() == []
    dataset = Dataset.open(build_dataset(session.folder))
    assert len(dataset) == 2 * 2 * 4
    assert (
        dataset.table["loudspeaker"].tolist() == [0] * 4 + [1] * 4 + [0] * 4 + [1] * 4
    )
    assert dataset.table["channel"].tolist() == [0, 1, 2, 3] * 4
    move = session.plan.moves[0]
    places = [
        pose.position
        for pose in mounted(move.listener, CHANNELS["microphone_offsets_m"])
    ]
    np.testing.assert_allclose(dataset.listeners.positions[:4], places)
    np.testing.assert_allclose(dataset.emitters.positions[0], move.emitter.position)


def test_arrivals_follow_the_distances(make_session: MakeSession) -> None:
    session = make_session(channels=CHANNELS)
    session.run()
    dataset = Dataset.open(build_dataset(session.folder))
    distances = np.linalg.norm(
        dataset.emitters.positions - dataset.listeners.positions, axis=1
    )
    speed = session.config.room.air.speed_of_sound
    for row, distance in enumerate(distances):
        expected = distance / speed * dataset.sample_rate
        first = np.argmax(np.abs(dataset.responses[row]) > 0.3 / distance)
        assert abs(first - expected) <= 3


def test_sixty_four_channels_are_as_exact_as_one(make_session: MakeSession) -> None:
    rng = np.random.default_rng(0)
    offsets = rng.uniform(-0.2, 0.2, (63, 3)).round(3)
    offsets[0] = 0.0
    many = make_session(
        channels={
            "microphones": list(range(1, 64)),
            "loopback": 64,
            "microphone_offsets_m": offsets.tolist(),
        }
    )
    assert many.run() == []
    dataset = Dataset.open(build_dataset(many.folder))
    assert len(dataset) == 2 * 63
    forward = dataset.responses[0]
    reverse = dataset.responses[63]
    error = np.linalg.norm(forward - reverse) / np.linalg.norm(forward)
    assert error <= 1e-9
