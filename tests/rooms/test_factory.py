import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from rir import Dataset, DatasetWriter
from rir.errors import ConfigError, DatasetError
from rooms.builtin import load_scene
from rooms.dataset_cli import main
from rooms.factory import Recipe, make_dataset
from rooms.layout import paper_layout
from rooms.simulation import simulate

BARE = str(Path(__file__).with_name("bare_room.yaml"))
SMALL = Recipe(BARE, sample_rate=8000, duration=0.05, emitters=2, unseen=1,
               listeners=150)  # fmt: skip

CLUSTER = """
import os, sys, time
from dataclasses import replace
from distributed import LocalCluster
from rooms.factory import Recipe, make_dataset
if __name__ == "__main__":
    recipe = Recipe(sys.argv[2], sample_rate=8000, duration=0.05, emitters=2, unseen=1,
                    listeners=150)
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(**options) as cluster:
        victim = next(iter(cluster.workers.values()))
        killed = []
        def tell(done, total):
            if not killed:
                killed.append(victim.pid)
                os.kill(victim.pid, 9)
        where = {"scheduler": cluster.scheduler_address, "tell": tell}
        make_dataset(recipe, sys.argv[1], **where)
        print("killed", len(killed))
"""


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return make_dataset(SMALL, tmp_path_factory.mktemp("data") / "one.h5")


def test_rows_are_what_simulate_answers(reference):
    data = Dataset.open(reference)
    layout = paper_layout(load_scene(BARE), emitters=2, unseen=1, listeners=150)
    assert data.simulated
    assert len(data) == len(layout) == 3 * len(layout.listeners)
    assert list(np.unique(data.table["split"])) == ["test", "train"]
    row = len(layout.listeners) + 5
    expected = simulate(
        load_scene(BARE), layout.emitters[1], layout.listeners[5],
        sample_rate=8000, duration=0.05,
    ).responses[0, 0]  # fmt: skip
    np.testing.assert_allclose(data.responses[row : row + 1][0], expected, atol=1e-6)
    np.testing.assert_array_equal(
        data.listeners[row].position, layout.listeners[5].position
    )


def test_any_number_of_workers_gives_the_same_bytes(reference, tmp_path):
    other = make_dataset(SMALL, tmp_path / "one.h5", workers=2)
    assert other.read_bytes() == reference.read_bytes()


def test_a_killed_run_is_taken_up_again(reference, tmp_path):
    target = tmp_path / "one.h5"
    program = (
        "from rooms.factory import *;"
        f"make_dataset({SMALL!r}, {str(target)!r}, tell=lambda *a: print(*a, flush=1))"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    child.stdout.readline()
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    assert not target.exists()
    told = []
    make_dataset(SMALL, target, tell=lambda done, total: told.append((done, total)))
    assert told[0][0] > 1
    assert target.read_bytes() == reference.read_bytes()
    assert [entry.name for entry in tmp_path.iterdir()] == ["one.h5"]


@pytest.mark.parametrize("moment", ["append", "close"])
def test_a_run_stopped_while_it_joins_loses_and_doubles_nothing(
    reference, tmp_path, monkeypatch, moment
):
    target = tmp_path / "one.h5"
    with monkeypatch.context() as patch:
        patch.setattr(DatasetWriter, moment, Mock(side_effect=KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            make_dataset(SMALL, target)
    assert not target.exists()
    told = []
    make_dataset(SMALL, target, tell=lambda *counts: told.append(counts))
    assert not told, "every block was kept"
    assert target.read_bytes() == reference.read_bytes()
    assert [entry.name for entry in tmp_path.iterdir()] == ["one.h5"]


@pytest.mark.slow
def test_a_cluster_survives_the_loss_of_a_worker(reference, tmp_path):
    pytest.importorskip("distributed")
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    target = tmp_path / "one.h5"
    done = subprocess.run(
        [sys.executable, str(script), str(target), BARE],
        capture_output=True, text=True, timeout=180, check=False,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )  # fmt: skip
    assert "killed 1" in done.stdout, done.stderr[-2000:]
    assert target.read_bytes() == reference.read_bytes()


def test_patterns_and_the_small_variant():
    scene = load_scene("office")
    full = paper_layout(scene, listeners=400)
    small = paper_layout(scene, listeners=400, fewer=10, gains="diff")
    assert len(full.emitters) == 15
    assert len(small.listeners) == -(-len(full.listeners) // 10)
    np.testing.assert_array_equal(small.emitters.positions, full.emitters.positions)
    assert full.emitter_gain == full.listener_gain
    assert small.emitter_gain != small.listener_gain
    with pytest.raises(ConfigError, match="'same' or 'diff'"):
        paper_layout(scene, gains="equal")
    with pytest.raises(ConfigError, match="not n = 0"):
        paper_layout(scene, fewer=0)


def test_no_workers_are_refused_before_anything_is_made(tmp_path):
    with pytest.raises(ConfigError, match="workers must be 1 or more, not 0"):
        make_dataset(SMALL, tmp_path / "none.h5", workers=0)
    assert not list(tmp_path.iterdir())


def test_the_command(tmp_path, capsys):
    out = tmp_path / "k.h5"
    arguments = ["kitchen", "--listeners", "30", "--emitters", "1", "--unseen", "0",
                 "--duration", "0.02", "--out", str(out)]  # fmt: skip
    assert main([*arguments, "--dry-run"]) == 0
    assert not out.exists()
    assert main(arguments) == 0
    assert "SIMULATED" in capsys.readouterr().out
    assert main(arguments) == 1
    assert "exists" in capsys.readouterr().err
    with pytest.raises(DatasetError, match="exists"):
        make_dataset(replace(SMALL, seed=1), out)
