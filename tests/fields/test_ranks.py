import json
import subprocess
import sys

import pytest

SCRIPT = """
import json, os, sys
import numpy as np
import torch
from fields import train
from rir import Dataset

path, out = sys.argv[1:]
field = train(
    Dataset.open(path), model="inras", steps=3, seed=2, config={"width": 8, "depth": 1}
)
total = {n: float(w.double().sum()) for n, w in field.network.state_dict().items()}
rank = os.environ.get("RANK", "0")
open(f"{out}/{rank}.json", "w").write(json.dumps(total))
if torch.distributed.is_initialized():
    torch.distributed.destroy_process_group()
"""


@pytest.mark.slow
def test_two_gloo_ranks_hold_the_same_weights(grid, tmp_path):
    path = grid.save(tmp_path / "grid.h5")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    arguments = ["--nproc-per-node=2", str(script), str(path), str(tmp_path)]
    result = subprocess.run(
        [*command, *arguments], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr[-2000:]
    first, second = (
        json.loads((tmp_path / f"{rank}.json").read_text()) for rank in (0, 1)
    )
    assert first == second
