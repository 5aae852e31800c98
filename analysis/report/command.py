"""What `analyze-reciprocity report` does, behind its options."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from analysis.report.study import StudyOptions
from analysis.report.write import write_report
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
    console: Console | None = None,
) -> dict[str, Path]:
    """Write the report and say where it is."""
    import json

    screen = console or Console()
    first = Path(sessions[0])
    folder = out or (first if first.is_dir() else first.parent) / "report"
    paths = write_report(
        open_sessions(sessions),
        folder,
        title=title,
        options=options,
        figures=figures,
        created_utc=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    said = json.loads(paths["json"].read_text(encoding="utf-8"))
    screen.print(f"[bold]{said['mark']}[/bold]")
    for line in said["verdicts"]:
        screen.print(line, highlight=False, markup=False)
    for path in paths.values():
        screen.print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)
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

    from analysis.report.compare import compare_reports, load_report, write_comparison
    from analysis.report.tables import number

    reports = [load_report(path) for path in (first, second)]
    lines = compare_reports(reports[0], reports[1], np.random.default_rng(seed))
    screen = Console()
    for line in lines:
        screen.print(
            f"{line['room']} {line['metric']}: {number(line['first'])} -> "
            f"{number(line['second'])} {line['unit']}, factor {number(line['change'])} "
            f"({number(line['low'])} to {number(line['high'])}): {line['words']}",
            highlight=False,
            markup=False,
        )
    path = write_comparison(lines, (str(first), str(second)), out)
    screen.print(f"wrote {path}", highlight=False, markup=False, soft_wrap=True)
    return path
