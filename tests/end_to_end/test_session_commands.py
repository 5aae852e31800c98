"""The commands round a session, and what may not be asked together."""

from collections.abc import Callable
from pathlib import Path

import pytest

from capture.commands.capture_pairs import main
from capture.commands.options import SessionOptions
from capture.config import SessionConfig

ROOM = ["--room", "kitchen"]


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str]]:
    """Return what runs the command and gives exit code and words."""

    def run(*arguments: str) -> tuple[int, str]:
        code = main(arguments)
        heard = capsys.readouterr()
        return code, heard.out + heard.err

    return run


Say = Callable[..., tuple[int, str]]


def test_an_alias_warns_and_does_what_its_command_does(say: Say) -> None:
    goes = "capture-pairs {0} goes in version 0.3.0: use capture-pairs {1}\n"
    options = [*ROOM, "--pairs", "2", "--seed", "4", "--takes", "3"]
    plan = say("plan", *options)
    code, told = say(*options, "--dry-run")
    assert (code, told) == (plan[0], plan[1] + goes.format("--dry-run", "plan"))
    assert "2 pairs, 12 takes" in plan[1]
    code, told = say("rebuild", "nowhere")
    alias = say("--rebuild", "nowhere")
    assert alias == (code, goes.format("--rebuild", "rebuild") + told)


@pytest.mark.parametrize(
    ("options", "one", "other"),
    [
        (["--list-devices", "--rebuild", "x"], "--list-devices", "--rebuild"),
        (["--dry-run", "--check", *ROOM], "--dry-run", "--check"),
        (["--cost", "--list-devices"], "--cost", "--list-devices"),
        (["--rebuild", "x", *ROOM], "--room", "--rebuild"),
        (["--list-devices", *ROOM], "--room", "--list-devices"),
        ([*ROOM, "--resume", "--dry-run"], "--resume", "--dry-run"),
        ([*ROOM, "--new", "--check"], "--new", "--check"),
        ([*ROOM, "--calibrator-db", "94"], "--calibrator-db", "check"),
        ([*ROOM, "--calibrator-db", "94", "--dry-run"], "--calibrator-db", "--dry-run"),
        ([*ROOM, "--cost", "--device", "x"], "--device", "--cost"),
        ([*ROOM, "--cost", "--rig", "manual"], "--rig", "--cost"),
        ([*ROOM, "--noise-db", "-60", "--device", "x"], "--noise-db", "--device"),
        ([*ROOM, "--measured", "x", "--device", "x"], "--measured", "--device"),
        ([*ROOM, "--host-api", "JACK"], "--host-api", "--device"),
        ([*ROOM, "--pairs", "x.yaml", "--apart", "2"], "--apart", "--pairs x.yaml"),
        (
            [*ROOM, "--loopback", "0", "--loopback-output", "2"],
            "--loopback-output",
            "0",
        ),
        ([*ROOM, "--overlap", "--outputs", "2"], "--overlap", "--outputs 2"),
        (
            [*ROOM, "--measured", "x", "--loudspeaker", "omni"],
            "--loudspeaker",
            "--measured",
        ),
        ([*ROOM, "--rig", "manual", "--yes", "--out", "k"], "--yes", "person"),
        ([*ROOM, "plan"], "--room", "plan"),
    ],
)
def test_what_contradicts_is_refused_by_name(
    options: list[str],
    one: str,
    other: str,
    say: Say,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    code, said = say(*options)
    assert code == 2
    assert one in said
    assert other in said
    assert said.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_config_that_measures_contradicts_simulating(
    say: Say, tmp_path: Path
) -> None:
    checked = tmp_path / "checked.yaml"
    checked.write_text("interface: portaudio\ndevice: {name: Fireface}\n")
    code, said = say("plan", *ROOM, "--config", str(checked), "--noise-db", "-60")
    assert code == 2
    assert "--noise-db simulates" in said
    assert "portaudio" in said


def test_a_word_that_is_no_command_is_told_what_there_is(say: Say) -> None:
    assert say("chek")[1].startswith("capture-pairs: no command 'chek': did you mean")
    code, said = say("kitchen")
    assert code == 2
    assert "plan, check, devices, rebuild, cost" in said
    assert "--room" in said


def test_a_session_is_not_resumed_as_another(
    say: Say, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from capture import SessionFolder, SessionRequest, plan_session

    monkeypatch.chdir(tmp_path)
    SessionFolder(Path("k")).create(plan_session(SessionRequest("kitchen", "1")))
    code, said = say(*ROOM, "--out", "k", "--takes", "3")
    assert code == 2
    assert "takes 1, not 3" in said
    assert "in kitchen, not in office" in say("--room", "office", "--out", "k")[1]
    assert "no session to resume" in say(*ROOM, "--out", "n", "--resume")[1]


def test_every_option_names_a_key_there_is() -> None:
    options = SessionOptions(
        takes=2,
        sweep_seconds=2.0,
        sample_rate=44100,
        rig="manual",
        device="x",
        host_api="y",
        overlap=True,
        thermometer="ask",
        closure=True,
        noise_db=-60.0,
        placement_mm=1.0,
        measured=Path("m"),
    )
    known = SessionConfig.model_json_schema()
    for key, _ in options.keys_set():
        outer, _, inner = key.partition(".")
        assert outer in known["properties"]
        kind = {"sweep": "SweepConfig", "simulation": "SimulationConfig"}.get(
            outer, outer.capitalize()
        )
        assert not inner or inner in known["$defs"][kind]["properties"]
