"""The reasons of module-level numbers: what counts as a number and as a reason."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TOOL = runpy.run_path(str(ROOT / "tools" / "number-reasons"))


def lines(tmp_path: Path, text: str) -> list[int]:
    file = tmp_path / "module.py"
    file.write_text(text)
    return [line for line, _, _ in TOOL["without_reason"](file)]


@pytest.mark.parametrize(
    "text",
    [
        "SPEED = 343.0  # m/s at 20 °C\n",
        "# m/s at 20 °C\nSPEED = 343.0\n",
        'SPEED = 343.0\n"""Speed of sound, m/s at 20 °C."""\n',
        "# exit codes of sysexits.h\nDONE = 0\nFAILED = 1\n",
        "BANDS = (\n    125.0,  # the lowest octave of ISO 3382-1\n    250.0,\n)\n",
    ],
)
def test_a_comment_or_a_docstring_beside_a_number_is_a_reason(
    tmp_path: Path, text: str
) -> None:
    assert lines(tmp_path, text) == []


def test_numbers_without_a_reason_are_named_by_line(tmp_path: Path) -> None:
    text = (
        "# a reason\nA = 1\n\nB = 2.0\n_C: float = -3e-4\nD = (1, 2.0)  # noqa\n"
        "E = 1 / 3\nF, G = 1, 2\nH = 10 / np.log(10)\n"
    )
    assert lines(tmp_path, text) == [4, 5, 6, 7, 8, 9]


@pytest.mark.parametrize(
    "text", ["NAME = 'a'\n", "FLAG = True\n", "lower = 3\n", "TWICE = 2 * OTHER\n"]
)
def test_what_is_no_number_needs_no_reason(tmp_path: Path, text: str) -> None:
    assert lines(tmp_path, text) == []
