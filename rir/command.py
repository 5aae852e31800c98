"""How every command of the project starts, shows and ends."""

import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Protocol, runtime_checkable

from rir.deprecation import DeprecatedWarning
from rir.errors import ResoundingError

if TYPE_CHECKING:
    import typer
    from rich.console import Console

__all__ = [
    "EXIT_DONE",
    "EXIT_ERROR",
    "EXIT_INTERRUPTED",
    "EXIT_USAGE",
    "make_app",
    "make_console",
    "run",
]

# As shells have them: 2 for wrong usage, 128 + 2 (SIGINT) for an interruption.
EXIT_DONE = 0
EXIT_ERROR = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130


def make_app(about: str = "") -> "typer.Typer":
    """Return an empty application in the one style of help.

    Help is plain text, so that ``[m]`` is a unit and no mark-up; a command with
    sub-commands shows it when called without any.

    Parameters
    ----------
    about : str
        What a command with sub-commands is for; one without has its docstring.
    """
    import typer

    return typer.Typer(
        help=about or None,
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode=None,
    )


def make_console() -> "Console":
    """Return the terminal as every command writes to it.

    Nothing in a text is read as mark-up: a unit in square brackets stays. Lines go
    out with ``out``, which does not break them; tables with ``print``.
    """
    from rich.console import Console

    return Console(markup=False, highlight=False, emoji=False)


def run(app: "typer.Typer", argv: Sequence[str] | None = None, prog: str = "") -> int:
    """Run a typer application and return its exit code.

    0 done, 1 a known error or a file that cannot be used (told in one line on
    standard error), 2 wrong usage, 130 interrupted. An error nobody foresaw keeps its
    traceback.

    Parameters
    ----------
    app : typer.Typer
        The application.
    argv : sequence of str, optional
        Arguments; those of the process when left out.
    prog : str
        Name shown in messages.
    """
    import typer

    command = typer.main.get_command(app)
    command.params.append(_version_option())
    try:
        with _deprecations_in_a_line():
            code = command.main(
                args=list(sys.argv[1:] if argv is None else argv),
                prog_name=prog,
                standalone_mode=False,
            )
    except ResoundingError as error:
        return _tell(f"{prog}: {error}", EXIT_ERROR)
    except KeyboardInterrupt:
        return _tell(f"{prog}: interrupted", EXIT_INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone; keep Python from complaining at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_ERROR
    except OSError as error:
        if error.filename is None:
            raise
        # Of a file that is moved, the place it goes to is the second.
        path = error.filename2 or error.filename
        told = f"{prog}: cannot use {path}: {error.strerror}; choose another path"
        return _tell(told, EXIT_ERROR)
    except Exception as error:
        return _end(error, prog)
    # Some versions of typer answer Ctrl-C with this code instead of raising.
    if code == EXIT_INTERRUPTED:
        return _tell(f"{prog}: interrupted", EXIT_INTERRUPTED)
    return code if isinstance(code, int) else EXIT_DONE


@contextmanager
def _deprecations_in_a_line() -> Iterator[None]:
    """Print what is deprecated on standard error, without the place in the code."""

    def show(message: Warning | str, *rest: Any, **more: Any) -> None:
        if isinstance(message, DeprecatedWarning):
            print(message, file=sys.stderr)
        else:
            usual(message, *rest, **more)

    with warnings.catch_warnings():
        usual = warnings.showwarning
        warnings.simplefilter("always", DeprecatedWarning)
        warnings.showwarning = show
        yield


def _version_option() -> Any:
    """Return ``--version``, which every command has beside its own options."""
    import typer

    def show(context: typer.Context, wanted: bool) -> None:
        if wanted:
            from rir.records import software_version

            typer.echo(f"{context.find_root().info_name}: {software_version()}")
            raise typer.Exit

    def bare(
        version: Annotated[
            bool,
            typer.Option(
                "--version",
                help="Show the version and exit.",
                is_eager=True,
                expose_value=False,
                callback=show,
            ),
        ] = False,
    ) -> None: ...

    # Typer's own way to an option: it is read off a function.
    app = make_app()
    app.command()(bare)
    return typer.main.get_command(app).params[0]


@runtime_checkable
class _Ended(Protocol):
    """An end of the program, in any click's words."""

    exit_code: int


@runtime_checkable
class _Called(Protocol):
    """The command that was called, in any click's words."""

    command_path: str


@runtime_checkable
class _Misused(Protocol):
    """A mistake in the options, in any click's words."""

    exit_code: int
    ctx: _Called | None

    def format_message(self) -> str:
        """Return what was wrong."""
        ...


def _end(error: Exception, prog: str) -> int:
    """Turn click's own exceptions into exit codes, whichever click raised them."""
    match type(error).__name__, error:
        case "Abort", _:
            return _tell(f"{prog}: interrupted", EXIT_INTERRUPTED)
        case "Exit", _Ended(exit_code=code):
            return code
        case "NoArgsIsHelpError", _:
            return _tell(str(error), EXIT_USAGE)
        case _, _Misused():
            told, called = error.format_message(), error.ctx
            page = called.command_path if called else prog
            return _tell(f"{prog}: {told} (see {page} --help)", EXIT_USAGE)
    raise error


def _tell(message: str, code: int) -> int:
    print(message, file=sys.stderr)
    return code
