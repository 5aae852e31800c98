"""Registry, errors, audio files, commands and optional parts."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer

import rir
from rir import errors
from rir.command import run
from rir.files.audio import read_audio, write_audio
from rir.optional import require
from rir.registry import Registry
from rir.response import ImpulseResponse, as_samples


def test_every_error_is_in_the_tree_and_is_what_python_expects() -> None:
    for name in errors.__all__:
        leaf = getattr(errors, name)
        assert issubclass(leaf, errors.ResoundingError)
        if leaf is not errors.ResoundingError:
            assert len(leaf.__bases__) == 2
    assert str(errors.UnknownNameError("plain words")) == "plain words"


def test_all_public_names_load() -> None:
    assert [name for name in rir.__all__ if not hasattr(rir, name)] == []


def test_a_taken_name_is_refused() -> None:
    table: Registry[int] = Registry("effect")
    table.add("air")(1)
    with pytest.raises(ValueError, match="effect 'air' is entered twice"):
        table.add("air")(2)


def test_a_missing_part_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(errors.MissingPartError, match=r"resounding\[fields\]"):
        require("torch", why="training")


@pytest.mark.parametrize(
    ("suffix", "subtype", "step"),
    [("wav", "DOUBLE", 0.0), ("wav", "FLOAT", 2.0**-25), ("flac", "PCM_24", 2.0**-23)],
)
def test_sound_files_keep_samples(
    tmp_path: Path, suffix: str, subtype: str, step: float
) -> None:
    samples = np.random.default_rng(0).uniform(-0.9, 0.9, (3, 500))
    path = write_audio(tmp_path / f"a.{suffix}", samples, 44100, subtype)
    read, rate = read_audio(path)
    assert rate == 44100
    np.testing.assert_allclose(read, samples, rtol=0, atol=step)


def test_sound_files_that_fail_say_why(tmp_path: Path) -> None:
    with pytest.raises(errors.SignalError, match="FLAC holds 8 channels, not 9"):
        write_audio(tmp_path / "a.flac", np.zeros((9, 10)), 48000, "PCM_24")
    (tmp_path / "b.wav").write_text("no sound")
    with pytest.raises(errors.SignalError, match=r"cannot read .*b\.wav as sound"):
        read_audio(tmp_path / "b.wav")


def test_integers_are_scaled_by_their_full_scale() -> None:
    np.testing.assert_array_equal(
        as_samples(np.array([-32768, 16384], np.int16)), [-1, 0.5]
    )


def test_resampling_keeps_the_response_of_the_filter() -> None:
    # A unit sample is the identity at any rate: its spectrum stays 1 in band.
    samples = np.eye(1, 4001, 2000)[0]
    low = ImpulseResponse(samples, 48000).resampled(16000)
    gain = np.abs(np.fft.rfft(low.samples, 16000))
    np.testing.assert_allclose(gain[:7000], 1.0, atol=2e-5)


APP = typer.Typer()


@APP.command()
def act(what: str) -> None:
    if what == "fail":
        raise errors.SignalError("two Hz are no rate")
    if what == "stop":
        raise KeyboardInterrupt
    if what == "leave":
        raise typer.Exit(3)


@pytest.mark.parametrize(
    ("argv", "code", "said"),
    [
        (["go"], 0, ""),
        (["fail"], 1, "act: two Hz are no rate\n"),
        (["stop"], 130, "act: interrupted\n"),
        (["leave"], 3, ""),
        ([], 2, "act: Missing argument 'what'. (see act --help)\n"),
    ],
)
def test_commands_end_with_the_agreed_codes(
    argv: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(APP, argv, "act") == code
    assert capsys.readouterr().err == said


def test_importing_the_words_stays_cheap() -> None:
    heavy = ["torch", "matplotlib", "scipy.signal", "sounddevice", "serial", "h5py"]
    program = f"import sys, rir; print([m for m in {heavy} if m in sys.modules])"
    out = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert out.stdout.strip() == "[]"
