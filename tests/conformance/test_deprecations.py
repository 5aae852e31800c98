"""What is deprecated works, says so in one line, and goes when its time has come."""

import tomllib
import warnings
from pathlib import Path

import pytest
import typer

from rir.command import make_app, run
from rir.deprecation import DEPRECATIONS, DeprecatedWarning, warn_deprecated

ROOT = Path(__file__).parents[2]


def numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split("."))


def overdue(version: str) -> list[str]:
    return [
        name
        for name, known in DEPRECATIONS.items()
        if numbers(known.removed_in) <= numbers(version)
    ]


def test_nothing_deprecated_is_overdue() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    late = overdue(project["version"])
    assert not late, f"remove them, and their lines in rir/deprecation.py: {late}"


def test_what_goes_becomes_overdue_with_its_version() -> None:
    assert overdue("0.2.9") == []
    assert "capture-pairs --check" in overdue("0.3.0")
    assert "capture-pairs --check" in overdue("1.0.0")


def test_a_program_is_warned_where_it_used_the_name() -> None:
    def old_name() -> None:
        warn_deprecated("capture-pairs --check")

    with pytest.warns(DeprecatedWarning, match=r"goes in version 0\.3\.0") as told:
        old_name()
    assert told[0].filename == __file__


def test_a_command_warns_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    app = make_app()

    @app.command()
    def act() -> None:
        warn_deprecated("capture-pairs --check")
        typer.echo("done")

    assert run(app, [], "act") == 0
    shown = capsys.readouterr()
    assert shown.out == "done\n"
    assert shown.err == (
        "capture-pairs --check goes in version 0.3.0: use capture-pairs check\n"
    )


def test_other_warnings_stay_what_they_were() -> None:
    app = make_app()

    @app.command()
    def act() -> None:
        warnings.warn("the air is thin", RuntimeWarning, stacklevel=1)

    with pytest.warns(RuntimeWarning, match="the air is thin"):
        run(app, [], "act")
