"""What holds for every installed command: version, plain help, units that stay."""

import importlib
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from rich.table import Table

from rir.command import make_app, make_console, run
from rir.records import software_version

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SCRIPTS: dict[str, str] = PROJECT["project"]["scripts"]
PACKAGES = PROJECT["tool"]["importlinter"]["root_packages"]


def load(entry: str) -> tuple[Callable[..., int], Any]:
    module, name = entry.split(":")
    loaded = importlib.import_module(module)
    return getattr(loaded, name), loaded.app


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_command_tells_its_version(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main, _ = load(SCRIPTS[name])
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"{name}: {software_version()}\n"


def helps(command: Any, words: list[str]) -> Iterator[tuple[list[str], Any]]:
    yield words, command
    for name, inner in getattr(command, "commands", {}).items():
        yield from helps(inner, [*words, name])


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_help_is_plain_and_keeps_what_stands_in_brackets(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main, app = load(SCRIPTS[name])
    for words, command in helps(typer.main.get_command(app), []):
        assert main([*words, "--help"]) == 0
        shown = capsys.readouterr().out
        assert "--version" in shown or words
        assert "--install-completion" not in shown
        assert not re.search("[╭│╰]", shown), "a box is not the style of help here"
        for parameter in command.params:
            for unit in re.findall(r"\[\S+\]", getattr(parameter, "help", None) or ""):
                assert unit in shown


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_mistake_names_the_page_of_help_of_its_command(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main, app = load(SCRIPTS[name])
    for words, _ in helps(typer.main.get_command(app), []):
        assert main([*words, "--nonsense"]) == 2
        shown = capsys.readouterr().err
        assert shown.endswith(f"(see {' '.join([name, *words])} --help)\n")


@pytest.mark.parametrize("name", SCRIPTS)
def test_no_command_takes_a_negative_seed(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main, app = load(SCRIPTS[name])
    for words, command in helps(typer.main.get_command(app), []):
        if "seed" in {parameter.name for parameter in command.params}:
            assert main([*words, "--seed", "-1"]) == 2
            assert "Invalid value for '--seed'" in capsys.readouterr().err


def test_a_path_that_cannot_be_used_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("")
    app = make_app()

    @app.command()
    def act() -> None:
        """Make a folder below a file."""
        (taken / "below").mkdir()

    assert run(app, [], "act") == 1
    told = f"act: cannot use {taken / 'below'}: Not a directory; choose another path\n"
    assert capsys.readouterr().err == told


def test_help_and_tables_keep_units(capsys: pytest.CaptureFixture[str]) -> None:
    app = make_app()

    @app.command()
    def act(delay: float = 0.0) -> None:
        """Wait for [s] or [m]."""
        console = make_console()
        console.out(f"waited {delay} [s] :clock1:")
        table = Table("delay [s]", title="[m] and [kg]")
        table.add_row("[bold]1[/]")
        console.print(table)

    assert run(app, ["--help"], "act") == 0
    assert "Wait for [s] or [m]." in capsys.readouterr().out
    assert run(app, [], "act") == 0
    shown = capsys.readouterr().out
    for kept in ("[s] :clock1:", "delay [s]", "[m] and [kg]", "[bold]1[/]"):
        assert kept in shown


def test_only_one_place_makes_commands_and_terminals() -> None:
    made = re.compile(r"\b(Console|typer\.Typer)\(")
    found = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if made.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"rir/command.py"}
