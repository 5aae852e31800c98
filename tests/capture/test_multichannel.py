from collections.abc import Callable
from pathlib import Path

import numpy as np

from capture.devices.mounting import mounted
from capture.session.dataset import build_dataset
from capture.session.engine import Session
from capture.session.folder import SessionFolder
from capture.signal.interleave import Interleaving
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


def test_overlapped_sweeps_separate_exactly(
    make_session: MakeSession, tmp_path: Path
) -> None:
    apart = make_session(channels=CHANNELS, folder=SessionFolder(tmp_path / "apart"))
    together = make_session(channels=CHANNELS, overlap=True)
    assert apart.run() == []
    assert together.run() == []
    assert together.plan.seconds() < apart.plan.seconds() - 2.0
    one, other = (
        Dataset.open(build_dataset(session.folder)) for session in (apart, together)
    )
    assert len(one) == len(other)
    for column in ("loudspeaker", "channel", "direction"):
        np.testing.assert_array_equal(one.table[column], other.table[column])
    np.testing.assert_allclose(one.emitters.positions, other.emitters.positions)
    ours, theirs = (inside(data.responses[:]) for data in (one, other))
    error = np.linalg.norm(ours - theirs) / np.linalg.norm(ours)
    # What rings beyond the windows of 0.2 s is all that is left.
    assert 20 * np.log10(error) < -55


def inside(responses: np.ndarray) -> np.ndarray:
    """Return the spectra where the band is flat; its slopes depend on the take."""
    spectra = np.fft.rfft(responses, 2 * responses.shape[-1])
    frequencies = np.fft.rfftfreq(2 * responses.shape[-1], 1 / 16000)
    return spectra[:, (frequencies > 100) & (frequencies < 6000)]


def test_signals_and_windows_belong_together() -> None:
    plan = Interleaving.of(3, pre=10, length=100, sample_rate=1000)
    signals = plan.signals(np.ones(50), before=20, after=30)
    assert plan.spacing == 130
    assert signals.shape == (3, 20 + 50 + 260 + 30)
    starts = [int(np.flatnonzero(row)[0]) for row in signals]
    assert starts == [20, 150, 280]
    numbers = np.arange(10 + 260 + 100.0)[None]
    assert plan.separate(numbers)[:, 0].tolist() == [0, 130, 260]
    assert "distortion limits the range" in plan.price(0.05, 1000)
