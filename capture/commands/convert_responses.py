"""The command ``convert-responses``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture.commands.options import Misuse
from rir.command import make_app, run

if TYPE_CHECKING:
    from rir import Dataset

__all__ = ["app", "main"]

app = make_app()


@app.command()
def convert_responses(
    source: Annotated[
        Path, typer.Argument(help="Data set, session, SOFA file, or folder.")
    ],
    target: Annotated[Path, typer.Argument(help="dataset.h5, x.sofa, or a folder.")],
    read_as: Annotated[
        str | None, typer.Option("--from", help="Format of the source, if not seen.")
    ] = None,
    write_as: Annotated[
        str | None,
        typer.Option(
            "--to",
            help="wav, npz, meshrir, sofa, dataset, or an installed format.",
        ),
    ] = None,
    simulated: Annotated[
        bool | None,
        typer.Option(
            "--simulated/--measured", help="What the responses are, if not written."
        ),
    ] = None,
    excitation: Annotated[
        Path | None,
        typer.Option("--excitation", help="The source holds recordings of this sweep."),
    ] = None,
    loopback: Annotated[
        int | None,
        typer.Option("--loopback", help="Channel with the loopback, from 1."),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--seconds", help="Length of deconvolved responses.")
    ] = 1.0,
) -> None:
    """Convert impulse responses between this project's data sets and other tools.

    A folder of WAV files needs a poses.csv; see docs/measuring.md.
    """
    from capture.deconvolution.recordings import PlayedSweep, read_recordings

    if excitation is None and loopback is not None:
        raise Misuse("--loopback means nothing without --excitation: give both")
    if excitation is not None and read_as is not None:
        raise Misuse("--from contradicts --excitation: leave one of them out")
    if excitation is not None:
        played = PlayedSweep(excitation, loopback, None, seconds)
        dataset = read_recordings(source, played, simulated)
    else:
        dataset = _read(source, read_as, simulated)
    _write(dataset, target, write_as)
    typer.echo(f"{dataset.mark}: {len(dataset)} responses written to {target}")


def recognize(path: Path) -> str:
    """Return the format that a path looks like.

    Examples
    --------
    >>> recognize(Path("x.sofa"))
    'sofa'
    """
    from rir.files import FORMATS

    # What any folder may hold speaks last.
    formats = sorted(FORMATS.items(), key=lambda item: "*" in item[1].holds)
    found = (name for name, kind in formats if kind.suits(path))
    return next(found, "dataset")


def _read(path: Path, name: str | None, simulated: bool | None) -> "Dataset":
    from rir import Dataset
    from rir.files import FORMATS, is_simulated

    name = name or recognize(path)
    if name == "dataset":
        dataset = Dataset.open(path)
        is_simulated(simulated, {"simulated": dataset.simulated}, path)
        return dataset
    return FORMATS[name].read(path, simulated)


def _write(dataset: "Dataset", path: Path, name: str | None) -> None:
    from rir import ConfigError
    from rir.files import FORMATS

    known = {kind.suffix: name for name, kind in FORMATS.items() if kind.suffix}
    name = name or (known | {".h5": "dataset"}).get(path.suffix)
    if name is None:
        raise ConfigError(f"say what {path} shall be: --to {', '.join(FORMATS)}")
    if name == "dataset":
        dataset.save(path)
    else:
        FORMATS[name].write(dataset, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``convert-responses`` and return its exit code."""
    return run(app, argv, "convert-responses")
