"""Tables that other installed packages extend by entry points."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from rir.errors import ExtensionError, UnknownNameError
from rir.registry import Registry

GROUP = "resounding.numbers"
Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Return what puts a package of one module with entry points on the path."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def put(package: str, source: str, **points: str) -> None:
        module = package.replace("-", "_")
        (tmp_path / f"{module}.py").write_text(source)
        about = tmp_path / f"{module}-1.2.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Name: {package}\nVersion: 1.2\n")
        lines = [f"{name} = {module}:{thing}" for name, thing in points.items()]
        (about / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines]))
        monkeypatch.delitem(sys.modules, module, raising=False)

    return put


def table() -> Registry[int]:
    numbers: Registry[int] = Registry("number", group=GROUP, of=int)
    numbers.add("one")(1)
    return numbers


def test_an_installed_thing_is_found_and_stands_behind_ours(install: Install) -> None:
    install("lab-numbers", "TWO = 2", two="TWO")
    numbers = table()
    assert dict(numbers) == {"one": 1, "two": 2}
    assert "two" in numbers
    assert len(numbers) == 2


def test_nothing_is_imported_before_it_is_used(install: Install) -> None:
    install("lab-eager", "TWO = 2", two="TWO")
    numbers = table()
    assert numbers["one"] == 1
    with pytest.raises(UnknownNameError, match="known: one, two"):
        numbers["three"]
    assert "lab_eager" not in sys.modules
    assert numbers["two"] == 2
    assert "lab_eager" in sys.modules


def test_a_broken_thing_harms_no_other(
    install: Install, caplog: pytest.LogCaptureFixture
) -> None:
    install("lab-broken", "raise RuntimeError('no\\nlicence')", bad="BAD")
    install("lab-wrong", "WORD = 'two'", word="WORD")
    install("lab-right", "TWO = 2", two="TWO")
    numbers = table()
    assert list(numbers) == list(numbers) == ["one", "two"]
    assert "bad" not in numbers
    told = [record.getMessage() for record in caplog.records]
    assert told == [
        "left out: number 'bad' of lab-broken 1.2 (lab_broken:BAD) cannot be loaded: "
        "RuntimeError: no licence",
        "left out: number 'word' of lab-wrong 1.2 (lab_wrong:WORD) is a str; the "
        "table holds objects of builtins.int",
    ]
    with pytest.raises(ExtensionError, match="'bad' of lab-broken 1.2"):
        numbers["bad"]


def test_a_name_that_is_taken_stays_whose_it_was(
    install: Install, caplog: pytest.LogCaptureFixture
) -> None:
    install("lab-thief", "ONE = 11", one="ONE")
    numbers = table()
    assert dict(numbers) == {"one": 1}
    (record,) = caplog.records
    assert "'one' of lab-thief 1.2 (lab_thief:ONE)" in record.getMessage()
    assert "the name belongs to resounding itself" in record.getMessage()


def test_a_taken_name_may_lead_nowhere(install: Install) -> None:
    install("lab-loaded", "", one="GONE")
    __import__("lab_loaded")
    assert dict(table()) == {"one": 1}


def test_a_module_that_ends_the_program_is_left_out(install: Install) -> None:
    install("lab-script", "raise SystemExit(3)", two="TWO")
    numbers = table()
    assert list(numbers) == ["one"]
    with pytest.raises(ExtensionError, match="cannot be loaded: SystemExit: 3"):
        numbers["two"]


def test_two_packages_cannot_share_a_name(install: Install) -> None:
    install("lab-a", "TWO = 2", two="TWO")
    install("lab-b", "TWO = 22", two="TWO")
    numbers = table()
    assert list(numbers) == ["one"]
    with pytest.raises(ExtensionError, match=r"lab-a 1\.2 .* and lab-b 1\.2"):
        numbers["two"]
