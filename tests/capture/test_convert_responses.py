from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture.commands.convert_responses import main
from capture.signal.sweep import synchronized_sweep
from rir import Dataset, DatasetError, Pose, Poses
from rir.files import FORMATS
from rir.files.audio import write_audio
from rir.files.conformance import check_format, example_path

PLACES = [Pose.at(1, 1, 1, yaw_deg=30, pitch_deg=20), Pose.at(3, 2, 1.2, yaw_deg=-100)]


def make_pairs() -> Dataset:
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((4, 300)).astype(np.float32).astype(float)
    one, other = PLACES
    columns: dict[str, Any] = {
        "pair_id": np.array([0, 0, 1, 1]),
        "direction": np.array(["AB", "BA", "AB", "BA"]),
        "temperature_c": np.array([20.0, 20.1, 20.2, 20.3]),
        "time_utc": np.array(["2026-01-01T00:00:00+00:00"] * 4),
    }
    return Dataset.from_arrays(
        samples,
        Poses.of([one, other, one, other]),
        Poses.of([other, one, other, one]),
        sample_rate=16000,
        simulated=True,
        room_name="kitchen",
        columns=columns,
    )


def make_grid() -> Dataset:
    rng = np.random.default_rng(0)
    emitters = Poses(rng.uniform(0, 3, (2, 3)))
    listeners = Poses(rng.uniform(0, 3, (3, 3)))
    samples = rng.standard_normal((2, 3, 100)).astype(np.float32).astype(float)
    return Dataset.from_arrays(
        samples, emitters, listeners, sample_rate=48000, simulated=False
    )


def there_and_back(name: str, dataset: Dataset, folder: Path) -> Dataset:
    if name == "sofa":
        pytest.importorskip("sofar")
    path = example_path(name, folder)
    FORMATS[name].write(dataset, path)
    return FORMATS[name].read(path, None)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_every_format_conforms(name: str) -> None:
    if name == "sofa":
        pytest.importorskip("sofar")
    check_format(name)


@pytest.mark.parametrize("name", ["npz", "sofa", "wav"])
def test_pairs_come_back_with_labels_and_orientations(
    name: str, tmp_path: Path
) -> None:
    dataset = make_pairs()
    again = there_and_back(name, dataset, tmp_path)
    np.testing.assert_array_equal(again.responses[:], dataset.responses[:])
    assert again.simulated
    assert len(again.pairs()) == 2
    np.testing.assert_allclose(
        again.table["temperature_c"], dataset.table["temperature_c"]
    )
    np.testing.assert_allclose(
        again.emitters.forward, dataset.emitters.forward, atol=1e-9
    )
    np.testing.assert_allclose(
        np.abs(
            np.sum(again.listeners.orientations * dataset.listeners.orientations, 1)
        ),
        1.0,
        atol=1e-9,
    )


def test_sofa_passes_its_own_check_when_read_by_another(tmp_path: Path) -> None:
    sofar = pytest.importorskip("sofar")
    FORMATS["sofa"].write(make_pairs(), tmp_path / "x.sofa")
    sofa = sofar.read_sofa(str(tmp_path / "x.sofa"), verify=True, verbose=False)
    assert sofa.GLOBAL_SOFAConventions == "SingleRoomSRIR"
    assert sofa.GLOBAL_Comment == "SIMULATED"
    np.testing.assert_allclose(sofa.RoomTemperature, [293.15, 293.25, 293.35, 293.45])


def test_meshrir_has_no_place_for_gaps(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="use npz or wav"):
        FORMATS["meshrir"].write(make_pairs().subset([0, 1, 2]), tmp_path / "x")


@pytest.mark.parametrize("name", ["meshrir", "npz", "wav"])
def test_nobody_guesses_whether_responses_were_measured(
    name: str, tmp_path: Path
) -> None:
    FORMATS[name].write(make_grid(), tmp_path / "x")
    for about in ("about.json", "data.json"):
        (tmp_path / "x" / about).unlink(missing_ok=True)
    with pytest.raises(DatasetError, match="--measured or --simulated"):
        FORMATS[name].read(tmp_path / "x", None)
    assert FORMATS[name].read(tmp_path / "x", True).simulated


@pytest.mark.parametrize("name", ["dataset.h5", "x.sofa"])
def test_nobody_overrules_what_a_file_says(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make_pairs().save(tmp_path / "dataset.h5")
    FORMATS["sofa"].write(make_pairs(), tmp_path / "x.sofa")
    source, target = tmp_path / name, tmp_path / "other.h5"
    assert main([str(source), str(target), "--measured"]) == 1
    assert f"{source} says SIMULATED: leave out --measured" in capsys.readouterr().err
    assert not target.exists()


def test_missing_columns_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text("file,emitter_x,emitter_y\na.wav,1,2\n")
    with pytest.raises(DatasetError, match="emitter_z, listener_x, listener_y"):
        FORMATS["wav"].read(tmp_path, True)


def test_a_bad_number_is_told_with_its_line(tmp_path: Path) -> None:
    FORMATS["wav"].write(make_grid(), tmp_path)
    text = (tmp_path / "poses.csv").read_text().splitlines()
    fields = text[3].split(",")
    fields[2] = "one"
    text[3] = ",".join(fields)
    (tmp_path / "poses.csv").write_text("\n".join(text))
    with pytest.raises(DatasetError, match="line 4 of the poses"):
        FORMATS["wav"].read(tmp_path, None)


def test_the_command_goes_round_all_formats(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    make_grid().save("start.h5")
    steps = [("start.h5", "w", "wav"), ("w", "n", "npz"), ("n", "m", "meshrir")]
    for source, target, name in steps:
        assert main([source, target, "--to", name]) == 0
    assert main(["m", "end.h5"]) == 0
    assert "MEASURED: 6 responses written to end.h5" in capsys.readouterr().out
    one, other = Dataset.open("start.h5"), Dataset.open("end.h5")
    np.testing.assert_array_equal(one.responses[:], other.responses[:])
    assert main(["m", "elsewhere"]) == 1
    assert "say what elsewhere shall be" in capsys.readouterr().err


def test_recordings_of_another_program_are_deconvolved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    rate = 16000
    sweep = np.asarray(synchronized_sweep(40, 7600, 1.0, rate, band=(80, 7000)))
    write_audio("sweep.wav", sweep, rate, "DOUBLE")
    response = np.zeros(1000)
    response[[50, 400]] = 0.5, -0.2
    heard = np.convolve(np.pad(sweep, (0, 2000)), response)[: len(sweep) + 2000]
    loop = np.pad(sweep, (0, 2000))
    late = np.pad(np.stack((heard, loop)), ((0, 0), (700, 0)))
    Path("r").mkdir()
    write_audio("r/a.wav", late, rate, "DOUBLE")
    header = (
        "file,channel,emitter_x,emitter_y,emitter_z,listener_x,listener_y,listener_z"
    )
    Path("r/poses.csv").write_text(f"{header}\na.wav,1,0,0,1,2,0,1\n")
    options = ["--excitation", "sweep.wav", "--loopback", "2", "--measured"]
    assert main(["r", "r.h5", *options, "--seconds", "0.1"]) == 0
    found = Dataset.open("r.h5").responses[0]
    assert np.argmax(np.abs(found)) == 50
    np.testing.assert_allclose(found[400] / found[50], -0.4, atol=0.01)
