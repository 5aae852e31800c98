from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from capture.config import SessionConfig
from capture.devices.stage import set_stage
from capture.interfaces import AudioInterface
from capture.plan import build_plan
from capture.session.engine import Session
from capture.session.folder import SessionFolder
from capture.session.journal import Journal
from capture.session.record import SessionRecord
from capture.session.start import SessionRequest, merge, plan_session

TINY = {
    "sample_rate": 16000,
    "response_s": 0.2,
    "sweep": {"seconds": 1.0, "band_hz": (60.0, 7000.0), "tail_s": 0.4, "noise_s": 0.3},
}

MakeConfig = Callable[..., SessionConfig]
MakeSession = Callable[..., Session]


BOOTH = """
name: booth
size_m: [4.2, 3.4, 2.5]
surfaces: {all: {absorption: 0.7}}
"""
"""A room whose responses fit the short takes of the tests."""


@pytest.fixture
def make_config(tmp_path: Path) -> MakeConfig:
    """Return what plans a small session in a dry room."""
    room = tmp_path / "booth.yaml"
    room.write_text(BOOTH)

    def make(pairs: int = 1, **settings: object) -> SessionConfig:
        settings = merge(TINY, settings)
        request = SessionRequest(str(room), str(pairs), seed=5, settings=settings)
        return plan_session(request)

    return make


@pytest.fixture
def make_session(tmp_path: Path, make_config: MakeConfig) -> Iterator[MakeSession]:
    """Return what opens a small session, new or from its folder."""
    journals: list[Journal] = []

    def make(
        *,
        open_interface: Callable[[], AudioInterface] | None = None,
        folder: SessionFolder | None = None,
        **settings: object,
    ) -> Session:
        folder = folder or SessionFolder(tmp_path / "session")
        if not folder.exists:
            folder.create(make_config(**settings))
        config = folder.load_config()
        journals.append(Journal(folder.journal_path))
        stage = set_stage(config)
        return Session(
            folder,
            config,
            build_plan(config),
            SessionRecord(journals[-1], lambda: "2026-01-01T00:00:00+00:00"),
            stage.mover,
            open_interface or stage.open_interface,
            stage.sensor,
            stage.clock,
        )

    yield make
    for journal in journals:
        journal.close()
