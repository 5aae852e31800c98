"""A laboratory's package, installed beside ours and used by the commands."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fields.conformance import small_dataset
from rir import Dataset

PACKAGE = Path(__file__).with_name("example_package")
BIN = Path(sys.executable).parent
ENVELOPE = "{low_m: [0, 0, 0], high_m: [5, 4, 3]}"
Run = Callable[..., str]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder the package is installed in, off line and apart from ours."""
    target = tmp_path_factory.mktemp("site")
    source = tmp_path_factory.mktemp("source") / "package"
    shutil.copytree(PACKAGE, source)
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet"]
    subprocess.run(
        [sys.executable, "-m", "pip", "install", *options, "--target", target, source],
        check=True,
        env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )
    return target


@pytest.fixture
def run(site: Path, tmp_path: Path) -> Run:
    """Return what runs a command in a fresh process and answers what it printed."""

    def start(command: str, *arguments: str) -> str:
        done = subprocess.run(
            [BIN / command, *arguments],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(site), "COLUMNS": "200"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return start


@pytest.mark.parametrize(
    "check",
    [
        "rooms.conformance import check_effect as check; check('ball')",
        "capture.checks.conformance import check_check as check; check('twins')",
        "fields.conformance import check_field as check; check('mean')",
        "rigs.conformance import *; check_rig('cart', {'envelope': ENVELOPE})",
        "rir.files.conformance import check_format as check; check('text')",
        "analysis.conformance import check_metric as check; check('Ts')",
        "rir.walls.conformance import check_wall_model as c; c('resonators')",
    ],
)
def test_each_part_keeps_the_promises_of_its_kind(run: Run, check: str) -> None:
    run("python", "-c", f"from {check}")


def test_the_model_is_listed_trained_and_opened_elsewhere(
    run: Run, tmp_path: Path
) -> None:
    small_dataset().save(tmp_path / "set.h5")
    assert "the mean response over distance" in run("train-field", "list")
    options = ["--model", "mean", "--set", "every=2", "--out", "run", "--quiet"]
    told = run("train-field", "set.h5", *options, "--sample-rate", "0")
    assert "model mean" in told
    assert "Ts ms" in told
    assert (
        json.loads((tmp_path / "run" / "table.json").read_text())["units"]["Ts"] == "ms"
    )
    program = "from fields import load_field; print(load_field('run').name)"
    assert run("python", "-c", program) == "mean\n"
    comparison = "title: t\nsets: [{path: set.h5}]\nseeds: [0]\n"
    models = "models: [{model: mean, forms: [vanilla]}]\n"
    (tmp_path / "c.yaml").write_text(comparison + models)
    compared = run("train-field", "compare", "c.yaml", "--out", "c")
    assert "mean vanilla" in compared
    assert "Ts ms" in compared


def test_the_effect_stands_in_the_plan_where_it_says(run: Run) -> None:
    told = run("simulate-room", "kitchen", "--explain")
    order = [told.index(name) for name in ("direct", "ball", "specular")]
    assert order == sorted(order)
    assert "a ball of 0.1 m" in told


def test_the_rig_is_listed_and_read_from_a_rig_file(run: Run, tmp_path: Path) -> None:
    assert "rolls a cart, slowly" in run("rig", "kinds")
    part = f"{{kind: cart, envelope: {ENVELOPE}}}"
    text = f"name: carts\nemitter: {part}\nlistener: {part}\n"
    (tmp_path / "carts.yaml").write_text(text)
    assert '"kind": "cart"' in run("rig", "connect", "carts.yaml")


def test_the_format_is_written_and_recognised(run: Run, tmp_path: Path) -> None:
    dataset = small_dataset()
    dataset.save(tmp_path / "set.h5")
    run("convert-responses", "set.h5", "set.txt")
    run("convert-responses", "set.txt", "again.h5")
    again = Dataset.open(tmp_path / "again.h5").responses[:]
    np.testing.assert_array_equal(again, dataset.responses[:])


def test_a_session_is_checked_and_reported_with_both(run: Run, tmp_path: Path) -> None:
    quick = ["--pairs", "2", "--out", "session", "--sweep-seconds", "1", "--plain"]
    quick += ["--sample-rate", "16000"]
    run("capture-pairs", "--room", "kitchen", *quick)
    figures = [
        json.loads(line)
        for line in (tmp_path / "session/journal.jsonl").read_text().splitlines()
        if "twin_channels" in line
    ]
    assert len(figures) == 4
    run("analyze-reciprocity", "report", "session", "--out", "report")
    report = json.loads((tmp_path / "report/report.json").read_text())
    summary = report["rooms"][0]["metrics"]["Ts"]
    assert summary["unit"] == "ms"
    assert summary["paired"]["mean"] < summary["unpaired"]["mean"]
