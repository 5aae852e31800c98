from pathlib import Path

import numpy as np
import pytest

from capture.session.folder import SessionFolder, lossless_format
from rir import SessionError


@pytest.fixture
def folder(tmp_path: Path) -> SessionFolder:
    folder = SessionFolder(tmp_path / "session")
    folder.raw_path.mkdir(parents=True)
    return folder


@pytest.mark.parametrize(
    ("step", "channels", "suffix"),
    [(2.0**-23, 2, ".flac"), (2.0**-23, 9, ".wav"), (None, 2, ".wav")],
)
def test_every_bit_comes_back(
    folder: SessionFolder, step: float | None, channels: int, suffix: str
) -> None:
    samples = np.random.default_rng(0).uniform(-1, 1, (channels, 1000))
    if step:
        samples = np.clip(np.round(samples / step) * step, -1, 1 - step)
    path = folder.write_raw("P01_AB_1", samples, 48000)
    assert path.suffix == suffix
    np.testing.assert_array_equal(folder.read_raw(f"raw/{path.name}"), samples)


def test_single_precision_stays_single() -> None:
    samples = np.random.default_rng(0).uniform(-3, 3, (2, 50)).astype(np.float32)
    assert lossless_format(samples.astype(float)) == (".wav", "FLOAT")


def test_the_same_samples_give_the_same_bytes(folder: SessionFolder) -> None:
    samples = np.random.default_rng(0).standard_normal((2, 100))
    content = folder.write_raw("a", samples, 48000).read_bytes()
    place = content.find(b"PEAK")
    assert content[place + 12 : place + 16] == bytes(4)


def test_half_written_files_are_swept(folder: SessionFolder) -> None:
    (folder.raw_path / ".P01_AB_1.wav.partial").write_bytes(b"half")
    assert len(folder.sweep_partials()) == 1
    assert not list(folder.raw_path.iterdir())


def test_a_folder_without_a_session_says_so(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match=r"no session\.yaml"):
        SessionFolder(tmp_path).load_config()
