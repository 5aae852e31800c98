import os
import runpy
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "kill_session.py"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs os.fork")
def test_sessions_survive_being_killed(tmp_path: Path) -> None:
    main = runpy.run_path(str(BENCHMARK))["main"]
    out = str(tmp_path / "kill.json")
    assert main(["--kills", "4", "--pairs", "2", "--out", out]) == 0
