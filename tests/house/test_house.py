"""What holds the house: short files, one class to a name, numbers with reasons."""

import ast
import runpy
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NUMBERS = runpy.run_path(str(ROOT / "tools" / "number-reasons"))
FILES = sorted(
    path for package in NUMBERS["PACKAGES"] for path in (ROOT / package).rglob("*.py")
)
MOST_LINES = 400
"""A file of more is read by nobody in one go."""
ONE_PER_MODEL = {"Config"}
"""What every file of a model offers under one name (`fields.table.FieldKind`)."""


def test_files_are_short() -> None:
    lengths = {path: len(path.read_text("utf-8").splitlines()) for path in FILES}
    assert {p: n for p, n in lengths.items() if n > MOST_LINES} == {}


def test_a_class_name_occurs_once() -> None:
    places = defaultdict(list)
    for path in FILES:
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(str(path.relative_to(ROOT)))
    for name in ONE_PER_MODEL:
        places[name] = [p for p in places[name] if not p.startswith("fields/models/")]
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_every_number_has_its_reason_beside_it() -> None:
    bare = [
        f"{path.relative_to(ROOT)}:{line} {name} = {value}"
        for path in FILES
        for line, name, value in NUMBERS["without_reason"](path)
    ]
    assert bare == []
