"""What `analyze-reciprocity report` does, behind its options."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from analysis.report.study import StudyOptions
from analysis.report.write import write_report
from rir.dataset import Dataset
from rir.errors import DatasetError

__all__ = ["make_report", "open_sessions"]


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
