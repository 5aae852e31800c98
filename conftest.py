"""Examples of the pages run in a folder that holds a small session of the kitchen."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def folder_of_examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with `sessions/kitchen`: two simulated pairs at 16 kHz."""
    from capture.commands.capture_pairs import main

    folder = tmp_path_factory.mktemp("examples")
    options = "--room kitchen --pairs 2 --sample-rate 16000 --noise-db -60 --plain"
    session = str(folder / "sessions" / "kitchen")
    code = main([*options.split(), "--placement-mm", "1", "--out", session])
    if code:
        raise RuntimeError(f"capture-pairs ended with {code}")
    return folder


@pytest.fixture(autouse=True)
def _beside_the_session(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run the examples of a page in that folder."""
    if request.node.path.suffix == ".md":
        monkeypatch.chdir(request.getfixturevalue("folder_of_examples"))
