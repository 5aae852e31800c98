from datetime import date
from pathlib import Path

import numpy as np
import pytest

from capture.session.folder import SessionFolder
from capture.session.start import SessionRequest, choose_folder, merge, plan_session
from rir import ConfigError, OutOfReachError, SessionError

TODAY = date(2026, 1, 2)


def no(question: str) -> bool:
    del question
    return False


def yes(question: str) -> bool:
    del question
    return True


def test_lengths_follow_the_reverberation_time() -> None:
    config = plan_session(SessionRequest("kitchen", "1"))
    decay = config.room.eyring_t60().max()
    np.testing.assert_allclose(config.sweep.seconds, 8 * decay, atol=0.06)
    assert config.sweep.tail_s >= 1.4 * decay
    assert config.response_s >= 1.2 * decay


def test_options_win_over_the_file_and_the_file_over_defaults(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text("takes: 3\nsweep: {seconds: 2.5}\n")
    settings = {"takes": 2, "sweep": {"seconds": None}}
    request = SessionRequest("kitchen", "1", config=path, settings=settings)
    config = plan_session(request)
    assert config.takes == 2
    assert config.sweep.seconds == 2.5


def test_low_rates_get_a_band_that_fits() -> None:
    settings = {"sample_rate": 16000}
    config = plan_session(SessionRequest("kitchen", "1", settings=settings))
    assert config.sweep.band_hz == (40.0, 6720.0)
    settings = {"sample_rate": 16000, "sweep": {"band_hz": [40, 7900]}}
    with pytest.raises(ConfigError, match="can reach 7520 Hz"):
        plan_session(SessionRequest("kitchen", "1", settings=settings))


def test_a_file_may_not_set_what_options_set(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text("seed: 3\n")
    with pytest.raises(ConfigError, match="sets seed"):
        plan_session(SessionRequest("kitchen", "1", config=path))


def test_all_mistakes_of_a_file_are_told(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text("taks: 3\nsweep: {seconds: -1}\nchannels: {microphones: [2]}\n")
    with pytest.raises(ConfigError) as caught:
        plan_session(SessionRequest("kitchen", "1", config=path))
    told = str(caught.value)
    assert "taks: unknown key (did you mean 'takes'?)" in told
    assert "sweep.seconds" in told
    assert "each input can carry one thing" in told


def test_listed_pairs_must_stand_in_free_air(tmp_path: Path) -> None:
    path = tmp_path / "pairs.yaml"
    path.write_text("pairs: [{a: [1, 1, 1], b: [99, 1, 1]}]\n")
    with pytest.raises(OutOfReachError):
        plan_session(SessionRequest("kitchen", str(path)))


def test_the_same_seed_gives_the_same_session() -> None:
    one, other = (plan_session(SessionRequest("office", "5", seed=3)) for _ in range(2))
    assert one == other
    assert one.pairs != plan_session(SessionRequest("office", "5", seed=4)).pairs


@pytest.fixture
def unfinished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SessionFolder:
    monkeypatch.chdir(tmp_path)
    folder = SessionFolder(Path("sessions/kitchen-2026-01-01"))
    folder.create(plan_session(SessionRequest("kitchen", "1")))
    return folder


def test_an_unfinished_session_is_offered(unfinished: SessionFolder) -> None:
    chosen = choose_folder(None, "kitchen", today=TODAY, resume=None, ask=yes)
    assert chosen == unfinished
    chosen = choose_folder(None, "kitchen", today=TODAY, resume=None, ask=no)
    assert chosen.path.name == "kitchen-2026-01-02"
    chosen = choose_folder(None, "office", today=TODAY, resume=None, ask=yes)
    assert chosen.path.name == "office-2026-01-02"


def test_resume_and_new_ask_nobody(unfinished: SessionFolder) -> None:
    chosen = choose_folder(None, "kitchen", today=TODAY, resume=True, ask=no)
    assert chosen == unfinished
    same_day = date(2026, 1, 1)
    chosen = choose_folder(None, "kitchen", today=same_day, resume=False, ask=yes)
    assert chosen.path.name == "kitchen-2026-01-01-2"
    with pytest.raises(SessionError, match="no unfinished session of office"):
        choose_folder(None, "office", today=TODAY, resume=True, ask=yes)


def test_nothing_set_changes_nothing() -> None:
    assert merge({"a": 1}, {"a": None, "b": {"c": None}}) == {"a": 1}
