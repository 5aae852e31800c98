"""The `deconvolve-sweep` command: responses from recordings made elsewhere."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from rir.command import make_app, make_console, run

__all__ = ["app", "main"]

SPOILED = 3
"""Exit code of --strict: written, but not to be trusted."""

app = make_app()


@app.command()
def deconvolve_sweep(
    recording: Annotated[
        Path, typer.Option("--recording", help="WAV or FLAC, any number of channels.")
    ],
    excitation: Annotated[
        Path, typer.Option("--excitation", help="What was played, as a sound file.")
    ],
    out: Annotated[
        Path, typer.Option("--out", help="Result: .wav (float), .npz or .h5.")
    ],
    loopback: Annotated[
        Path | None,
        typer.Option("--loopback", help="Recorded loopback, as a sound file."),
    ] = None,
    loopback_channel: Annotated[
        int | None,
        typer.Option(
            "--loopback-channel",
            min=1,
            help="Channel of the loopback, counted from 1 (of the recording, unless "
            "--loopback names a file).",
        ),
    ] = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option("--band", help="Flat band, low and high, Hz."),
    ] = None,
    length: Annotated[
        float | None, typer.Option("--length", help="Seconds to keep after emission.")
    ] = None,
    pre: Annotated[
        float, typer.Option("--pre", help="Seconds to keep before emission.")
    ] = 0.0,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit with code 3 if a hard fault is flagged."),
    ] = False,
) -> None:
    """Deconvolve recorded sweeps, check them, and write the responses.

    Several sweeps in one recording are found; each gives its own responses.
    """
    from capture.deconvolution.files import DeconvolutionJob, deconvolve_files

    job = DeconvolutionJob(
        recording, excitation, out, loopback, loopback_channel, band, length, pre
    )
    results = deconvolve_files(job)
    _tell(results, out)
    if strict and any(result.flags for result in results):
        raise typer.Exit(SPOILED)


def _tell(results: Sequence[Any], out: Path) -> None:
    console = make_console()
    for number, result in enumerate(results, start=1):
        name = f"sweep {number}: " if len(results) > 1 else ""
        console.out(f"{name}{result.response.shape[-1]} samples each")
        if result.latency == result.latency:
            console.out(
                f"  latency {result.latency:.3f} samples, "
                f"drift {result.drift_ppm:+.3f} ppm"
            )
        ranges = result.figures.get("inr_db", {})
        for octave, values in ranges.items():
            shown = ", ".join(
                "-" if value is None else f"{value:.0f}" for value in values
            )
            console.out(f"  impulse to noise ratio at {octave} Hz: {shown} dB")
        for finding in result.findings:
            word = "FLAG" if finding.hard else "mark"
            console.out(f"  {word} {finding.word}: {finding.text}")
        if not result.findings:
            console.out("  no flags")
    console.out(f"MEASURED responses written to {out}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(app, argv, "deconvolve-sweep")
