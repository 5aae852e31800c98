"""What `analyze-reciprocity report` does, behind its options."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from analysis.report.study import StudyOptions
from analysis.report.write import build_report, write_files
from rir.command import make_console
from rir.dataset import Dataset
from rir.errors import DatasetError

__all__ = ["compare_two", "make_report", "open_sessions"]


def make_report(
    sessions: Sequence[Path],
    out: Path | None,
    *,
    title: str,
    options: StudyOptions,
    figures: bool = False,
) -> dict[str, Path]:
    """Write the report and say where it is."""
    screen = make_console()
    first = Path(sessions[0])
    folder = out or (first if first.is_dir() else first.parent) / "report"
    studies, report = build_report(
        open_sessions(sessions),
        title=title,
        options=options,
        created_utc=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    paths = write_files(report, studies, folder, figures=figures)
    screen.out(report.mark, style="bold")
    for line in report.verdicts:
        screen.out(line)
    for path in paths.values():
        screen.out(f"wrote {path}")
    return paths


def open_sessions(paths: Sequence[Path]) -> list[Dataset]:
    """Open sessions, those of one sample rate as one data set.

    Raises
    ------
    DatasetError
        If the same session is named twice.
    """
    if len({Path(p).resolve() for p in paths}) < len(paths):
        raise DatasetError("a session is named twice: name each once")
    by_rate: dict[tuple[int, int], list[Path]] = {}
    for path in paths:
        opened = Dataset.open(path)
        by_rate.setdefault((opened.sample_rate, opened.n_samples), []).append(path)
    return [Dataset.open(*group) for group in by_rate.values()]


def compare_two(first: Path, second: Path, out: Path, seed: int) -> Path:
    """Compare two reports, print the lines, write the page."""
    import numpy as np

    from analysis.report.compare import compare_reports, write_comparison
    from analysis.report.contents import load_report
    from analysis.report.tables import number

    reports = [load_report(path) for path in (first, second)]
    lines = compare_reports(reports[0], reports[1], np.random.default_rng(seed))
    screen = make_console()
    for line in lines:
        screen.out(
            f"{line.room} {line.metric}: {number(line.first)} -> "
            f"{number(line.second)} {line.unit}, factor {number(line.change)} "
            f"({number(line.low)} to {number(line.high)}): {line.words}"
        )
    path = write_comparison(lines, (str(first), str(second)), out)
    screen.out(f"wrote {path}")
    return path
