"""Files that the first version of every stored kind wrote still open.

They lie in ``v1``, larger ones compressed. A new version of a kind gets a folder of its
own beside it; no file in here is ever written anew.
"""

import gzip
import importlib
import json
import pkgutil
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import rir.layout
from analysis.report.compare import compare_reports
from analysis.report.contents import REPORT, load_report
from capture.config import SESSION
from capture.session.folder import SessionFolder
from capture.session.journal import read_journal
from fields import FIELDS, load_field
from fields.commands.train import RUN
from fields.results import TABLE
from fields.split import SPLIT, Split
from fields.stored import FIELD
from fields.training.checkpoint import CHECKPOINT, TRAINING, read_checkpoint
from inverse.acoustics import FOUND_ROOM, Acoustics
from inverse.plan.ground_plan import GROUND_PLAN
from rir import Dataset, Poses
from rir.cost.curve import COST_CURVE, CostCurve
from rir.schema import Schema

FIRST = Path(__file__).parent / "v1"
OPENED: dict[str, Callable[[Path], Any]] = {}
PACKAGES = ("rir", "rooms", "rigs", "capture", "analysis", "inverse", "fields")


def unpack(name: str, folder: Path, as_name: str = "") -> Path:
    target = folder / (as_name or name)
    packed = FIRST / f"{name}.gz"
    if packed.exists():
        target.write_bytes(gzip.decompress(packed.read_bytes()))
    else:
        shutil.copy(FIRST / name, target)
    return target


def opens(schema: Schema) -> Callable[[Callable[[Path], Any]], Any]:
    """Enter a check under the kind whose first version it opens."""

    def enter(check: Callable[[Path], Any]) -> Callable[[Path], Any]:
        OPENED[schema.kind] = check
        return check

    return enter


@opens(SESSION)
def session(folder: Path) -> None:
    shutil.copytree(FIRST / "session", folder / "session")
    opened = SessionFolder(folder / "session")
    config = opened.load_config()
    assert (config.room.name, len(config.pairs)) == ("kitchen", 3)
    journal = read_journal(opened.journal_path)
    assert journal.complaints() == []
    assert [e["event"] for e in journal.events].count("take_finished") == 6


@opens(rir.layout.DATA_SET)
def data_set(folder: Path) -> None:
    opened = Dataset.open(unpack("dataset.h5", folder))
    assert opened.responses[:].shape == (6, 96)
    first = opened.responses[0]
    gap = opened.emitters.positions[0] - opened.listeners.positions[0]
    delay = np.linalg.norm(gap) / 343.2 * opened.sample_rate
    assert abs(np.argmax(first) - delay) < 1, "the direct sound comes after d/c"


@opens(SPLIT)
def split(folder: Path) -> None:
    rows = Dataset.open(unpack("dataset.h5", folder))
    opened = Split.load(unpack("split.json", folder), rows)
    assert sorted(opened.train + opened.test) == list(range(6))


@opens(FIELD)
def field(folder: Path) -> None:
    names = {path.name.split(".")[0][6:] for path in FIRST.glob("field-*")}
    assert names == set(FIELDS), "each model has a file here"
    told = np.load(unpack("answers.npz", folder))
    for path in FIRST.glob("field-*"):
        opened = load_field(unpack(path.stem, folder))
        of = "path_" if opened.name == "path" else ""
        answer = opened.predict(told[f"{of}emitters"], told[f"{of}listeners"])
        wanted = told[opened.name]
        # What other processors round otherwise stays far below this part of the peak.
        near = 1e-3 * np.abs(wanted).max()
        np.testing.assert_allclose(answer[:, : wanted.shape[1]], wanted, atol=near)


@opens(TRAINING)
def checkpoint(folder: Path) -> None:
    unpack("checkpoint.pt", folder, CHECKPOINT)
    state = read_checkpoint(folder)
    assert state is not None
    assert state["step"] == 2


@opens(RUN)
def run(folder: Path) -> None:
    plain = yaml.safe_load(unpack("run-config.yaml", folder).read_text())
    assert RUN.open(plain, "config.yaml")["model"] == "nearest"


@opens(TABLE)
def table(folder: Path) -> None:
    plain = json.loads(unpack("result-table.json", folder).read_text())
    rows = TABLE.open(plain, "table.json")["rows"]
    assert [row["method"] for row in rows] == ["nearest", "linear", "chance"]


@opens(REPORT)
def report(folder: Path) -> None:
    opened = load_report(unpack("report.json", folder))
    lines = compare_reports(opened, opened, np.random.default_rng(0))
    assert {line.room for line in lines} == {"kitchen"}
    assert all(line.first == line.second for line in lines)


@opens(COST_CURVE)
def cost_curve(folder: Path) -> None:
    opened = CostCurve.load(unpack("cost.json", folder))
    assert [point.setting for point in opened.points] == ["100", "400", "1600"]


@opens(FOUND_ROOM)
def found_room(folder: Path) -> None:
    opened = Acoustics.load(unpack("found-room.npz", folder))
    report = opened.report()
    assert report["walls"] == 6
    edges = sorted(-plane[3] for plane in report["planes"])[-3:]
    np.testing.assert_allclose(edges, [2.8, 4.0, 5.0], atol=1e-3)
    emitter, listener = Poses.of([[1.0, 1, 1]]), Poses.of([[2.0, 2, 1]])
    assert np.abs(opened.predict(emitter, listener, 200)).max() > 0


@opens(GROUND_PLAN)
def ground_plan(folder: Path) -> None:
    plain = json.loads(unpack("ground-plan.json", folder).read_text())
    assert len(GROUND_PLAN.open(plain, "plan.json")["walls"]) == 6


def schemas() -> dict[str, Schema]:
    found = {}
    for package in map(importlib.import_module, PACKAGES):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if module.name.endswith("__main__"):
                continue
            for value in vars(importlib.import_module(module.name)).values():
                if isinstance(value, Schema):
                    found[value.kind] = value
    return found


@pytest.mark.parametrize("kind", OPENED)
def test_a_file_of_the_first_version_opens(kind: str, tmp_path: Path) -> None:
    OPENED[kind](tmp_path)


def test_every_kind_has_files_of_every_version() -> None:
    found = schemas()
    assert set(found) == set(OPENED)
    versions = {path.name for path in FIRST.parent.glob("v*")}
    most = max(schema.version for schema in found.values())
    assert versions == {f"v{number}" for number in range(1, most + 1)}
