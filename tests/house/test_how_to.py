"""The how-to pages show the example package, which other tests install and run."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "tests" / "extension" / "example_package"
PAGES = sorted(ROOT.glob("docs/how-to/add-*.md"))


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text("utf-8"), re.S)


def test_every_file_of_the_example_has_its_page() -> None:
    shown = {block for page in PAGES for block in blocks(page, "python")}
    files = EXAMPLE.glob("lab_acoustics/[a-z]*.py")
    assert [file.name for file in files if file.read_text("utf-8") not in shown] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_entry_points_are_those_of_the_example(page: Path) -> None:
    (lines,) = blocks(page, "toml")
    assert lines in (EXAMPLE / "pyproject.toml").read_text("utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_promises_shown_are_there_and_run_on_the_example(page: Path) -> None:
    test = blocks(page, "python")[-1]
    ((module, names),) = re.findall(r"^from (\S+) import (.+)$", test, re.M)
    for name in names.split(", "):
        assert hasattr(importlib.import_module(module), name)
    (thing,) = re.findall(r"    check_\w+\(\"(\w+)\"", test)
    runs = (EXAMPLE.parent / "test_example_package.py").read_text("utf-8")
    assert module in runs
    assert f"'{thing}'" in runs
