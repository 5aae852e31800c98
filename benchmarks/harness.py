"""What every benchmark has: --quick, --out, and a file of results."""

import argparse
import json
from pathlib import Path
from typing import Any

__all__ = ["make_parser", "write_results"]


def make_parser(
    description: str | None, name: str, quick: str = "smaller and fewer: does it run?"
) -> argparse.ArgumentParser:
    """Return a parser that knows --quick and --out (results/NAME.json)."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument("--out", type=Path, default=Path(f"results/{name}.json"))
    return parser


def write_results(path: Path, results: Any) -> None:
    """Write results as JSON, making the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
