"""The documents: indexes are up to date, links and named files exist."""

import importlib
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INDEXES = runpy.run_path(str(ROOT / "tools" / "write-indexes"))
PAGES = sorted(
    [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md")]
)
NOW = [page for page in PAGES if page.name != "CHANGELOG.md"]
"""Pages of what there is; the change log names what has moved or gone, too."""
PACKAGES = ("rir", "rooms", "rigs", "capture", "analysis", "inverse", "fields")
PLACES = tuple(
    f"{place}/" for place in (*PACKAGES, "docs", "benchmarks", "tests", "tools")
)


@pytest.mark.parametrize("path", INDEXES["PAGES"], ids=lambda path: path.parent.name)
def test_an_index_says_what_the_files_say(path: Path) -> None:
    written = INDEXES["PAGES"][path]()
    assert path.read_text(encoding="utf-8") == written, "run tools/write-indexes"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files(page: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", NOW, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_and_objects_named_in_a_page_exist(page: Path) -> None:
    told = set(re.findall(r"`([\w./-]+)", page.read_text(encoding="utf-8")))
    files = {name for name in told if name.startswith(PLACES)}
    assert sorted(name for name in files if not (ROOT / name).exists()) == []
    objects = {
        name for name in told if re.match(rf"({'|'.join(PACKAGES)})\.(?!md$)", name)
    }
    assert sorted(name for name in objects - files if not resolves(name)) == []


def resolves(name: str) -> bool:
    """Tell whether a dotted name leads to a module or to something in one."""
    parts = name.rstrip(".").split(".")
    for count in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        return all(
            (thing := getattr(thing, part, None)) is not None for part in parts[count:]
        )
    return False


def test_a_superseded_record_and_its_successor_name_each_other() -> None:
    pattern = r"\*\*{}\*\*(.+?)(?= · \*\*|$)"
    found: dict[str, set[tuple[str, str]]] = {
        "Supersedes": set(),
        "Superseded by": set(),
    }
    for record in INDEXES["DECISIONS"].glob("[0-9]*.md"):
        head = record.read_text(encoding="utf-8").split("\n")[2]
        for word, pairs in found.items():
            for said in re.findall(pattern.format(word), head):
                for other in re.findall(r"\[(\d{4})\]", said):
                    ends = (record.name[:4], other)
                    pairs.add(ends if word == "Supersedes" else ends[::-1])
    assert found["Supersedes"] == found["Superseded by"]
