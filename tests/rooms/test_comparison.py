import numpy as np
import pytest

from rir.errors import ConfigError
from rooms.cli import main
from rooms.comparison import compare_parameters, read_measured

HEAD = "source,receiver,parameter,unit,500,1000,entry\n"
BANDS = np.array([125.0, 250, 500, 1000])


def written(tmp_path, rows, head=HEAD):
    path = tmp_path / "measured.csv"
    path.write_text(head + rows)
    return path


def found(**values):
    return {name: np.full((1, 2, 4), value) for name, value in values.items()}


def test_errors_are_means_over_pairs_and_octaves_with_their_sign(tmp_path):
    rows = "s1,R1,T30,s,1.0,1.2,\nS1,R2,T30,ms,1400,,measured\nS1,R1,D50,%,40,50,\n"
    measured = read_measured(written(tmp_path, rows))
    got = compare_parameters(
        measured, found(T30=1.1, D50=0.45), (["S1"], ["R1", "R2"]), BANDS
    )
    assert [row.parameter for row in got] == ["T30", "D50"]
    np.testing.assert_allclose(got[0].mean_error, (0.1 + 0.1 + 0.3) / 3)
    np.testing.assert_allclose(got[0].signed, [(0.1 - 0.3) / 2, -0.1])
    np.testing.assert_allclose(got[1].signed, [5, -5])
    assert (got[0].count, got[0].rank, got[0].entries) == (3, 1, 1)


def test_entries_are_ranked_by_their_mean_error(tmp_path):
    rows = (
        "S1,R1,C80,dB,0,0,\nS1,R1,C80,dB,0.2,-0.2,A\n"
        "S1,R1,C80,dB,2,2,B\nS1,R1,T30,s,1,1,C\n"
    )
    measured = read_measured(written(tmp_path, rows))
    (got,) = compare_parameters(measured, found(C80=1.0), (["S1"], ["R1"]), BANDS)
    assert (got.rank, got.entries) == (2, 3)


@pytest.mark.parametrize(
    ("rows", "head", "told"),
    [
        ("", "source,receiver,parameter,125\n", "lacks the column 'unit'"),
        ("", "source,receiver,parameter,unit\n", "no column of an octave"),
        ("S1,R1,T30,s,1,2\n", HEAD, "line 2 has 6 cells"),
        ("S1,R1,T30,s,,-1,\n", HEAD, "line 2: T30 is never negative, not -1"),
        ("S1,R1,T31,s,1,2,\n", HEAD, "unknown parameter 'T31'"),
        ("S1,R1,T30,min,1,2,\n", HEAD, "the unit of T30 is 's' or 'ms'"),
        ("S1,R1,T30,s,one,2,\n", HEAD, "could not convert"),
        ("S1,R1,T30,s,1,2,\n" * 2, HEAD, "stands there twice"),
        ("S1,R1,T30,s,1,2,A\n", HEAD, "only entries"),
        ("", HEAD, "ends after its first line"),
    ],
)
def test_wrong_files_are_told_in_one_line(tmp_path, rows, head, told):
    with pytest.raises(ConfigError, match=told) as caught:
        read_measured(written(tmp_path, rows, head))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_text_is_told_in_one_line(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(HEAD, encoding="utf-16")
    with pytest.raises(ConfigError, match=r"cannot read measured\.csv.*in UTF-8"):
        read_measured(path)


def test_unknown_places_are_told_with_those_there_are(tmp_path):
    measured = read_measured(written(tmp_path, "A,B,T30,s,1,2,\n"))
    with pytest.raises(ConfigError, match=r"has a to b.*sources are S1"):
        compare_parameters(measured, found(T30=1.0), (["S1"], ["R1"]), BANDS)
    head = HEAD.replace("500,1000", "315,8000")
    measured = read_measured(written(tmp_path, "S1,R1,T30,s,1,1,\n", head))
    with pytest.raises(ConfigError, match="columns of 315 Hz are no octaves; "):
        compare_parameters(measured, found(T30=1.0), (["S1"], ["R1"]), BANDS)
    with pytest.raises(ConfigError, match="there is no file"):
        read_measured(tmp_path / "none.csv")


def test_the_command_compares_a_room_with_what_was_measured(tmp_path, capsys):
    room = tmp_path / "room.yaml"
    room.write_text(
        "name: box\nsize_m: [5, 4, 3]\nsurfaces: {all: {absorption: 0.4}}\n"
        "emitters: [{at: [1, 1, 1.5], name: stage}]\nlisteners: [[3, 2, 1.2]]\n"
    )
    rows = "stage,R1,C80,dB,10,10,\nstage,R1,C80,dB,40,40,other\n"
    call = [str(room), "--sample-rate", "8000", "--only", "direct,specular"]
    path = str(written(tmp_path, rows))
    assert main([*call, "--duration", "0.3", "--compare", path]) == 0
    said = capsys.readouterr().out
    assert "C80 dB" in said
    assert "1 of 2" in said
    assert main([*call, "--compare", str(tmp_path / "none.csv")]) != 0
