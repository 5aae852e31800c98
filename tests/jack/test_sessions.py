import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis import paper_metrics
from capture.config import SessionConfig
from capture.devices.stage import set_stage
from capture.plan import build_plan
from capture.session.dataset import build_dataset
from capture.session.engine import Session
from capture.session.folder import SessionFolder
from capture.session.journal import Event, Journal, read_journal
from capture.session.record import SessionRecord
from capture.session.recover import recover
from capture.session.start import SessionRequest, merge, plan_session
from capture.session.take_judge import TakeJudge
from rir import Dataset, SessionError
from rir.files.audio import read_audio

pytestmark = pytest.mark.jack

STREET = Path("/usr/share/jconvolver/config-files/demo-reverbs")
QUICK = {
    "interface": "portaudio",
    "device": {"name": "room", "stall_s": 1.0},
    "channels": {"microphones": [1], "loopback": 2},
    "response_s": 0.5,
    "settle_s": 0.0,
    "sweep": {"seconds": 0.6, "noise_s": 0.15, "tail_s": 0.7},
}
ROOM = ["/impulse/read 1 1 0.5 0 0 0 1 {file}", "/impulse/dirac 1 2 0.5 0"]


def make_config(pairs: int = 1, **settings: Any) -> SessionConfig:
    settings = merge(QUICK, settings)
    return plan_session(SessionRequest("kitchen", str(pairs), settings=settings))


def start_room(server: Any) -> None:
    lines = [line.format(file=STREET / "street2-L.wav") for line in ROOM]
    server.start_room(lines, 1, 2)


def open_session(
    path: Path, config: SessionConfig, show: Callable[[Event], None] = print
) -> Session:
    folder = SessionFolder(path)
    if not folder.exists:
        folder.create(config)
    stage = set_stage(config)
    return Session(
        folder,
        config,
        build_plan(config),
        SessionRecord(Journal(folder.journal_path), lambda: "2026-01-01", show),
        stage.mover,
        stage.open_interface,
        clock=stage.clock,
    )


def test_a_street_is_recovered(start_jack: Callable[..., Any]) -> None:
    server = start_jack()
    lines = [
        f"/impulse/read 1 1 1 0 0 0 1 {STREET}/street2-L.wav",
        f"/impulse/read 1 2 1 0 0 0 1 {STREET}/street2-R.wav",
        "/impulse/dirac 1 3 1 0",
    ]
    server.start_room(lines, 1, 3)
    channels = {
        "microphones": [1, 2],
        "loopback": 3,
        "microphone_offsets_m": [[0, 0, 0], [0, 0.1, 0]],
    }
    sweep = {"seconds": 4.0, "band_hz": (20.0, 20000.0), "tail_s": 1.2}
    config = make_config(channels=channels, sweep=sweep, response_s=1.0, pre_s=0.5)
    interface = set_stage(config).open_interface()
    take_judge = TakeJudge(config)
    take = interface.play_record(take_judge.signal, len(take_judge.signal), label="t")
    interface.close()
    event = {"air": {}, "emitter": {}, "listener": {}}
    found = take_judge.check(take.samples, event).response
    # The band's slopes ring before and after: the window holds all of it.
    for whole, name in zip(found, ("street2-L", "street2-R"), strict=True):
        own, rate = read_audio(STREET / f"{name}.wav")
        heard = whole[take_judge.pre :]
        own = np.pad(own[0], (0, len(heard) - own.shape[1]))
        n = 2 * len(whole)
        frequencies = np.fft.rfftfreq(n, 1 / rate)
        inside = (frequencies >= 20) & (frequencies <= 20000)
        placed = np.pad(own, (take_judge.pre, 0))
        ours, theirs = (np.fft.rfft(h, n)[inside] for h in (whole, placed))
        error = np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)
        assert 20 * np.log10(error) <= -100
        differences = paper_metrics(own, heard, rate)
        assert differences["T60"] <= 1e-3
        assert differences["C50"] <= 1e-3


@pytest.mark.slow
def test_twenty_pairs_run_unattended(
    start_jack: Callable[..., Any], tmp_path: Path
) -> None:
    start_room(start_jack())
    config = make_config(20)
    session = open_session(tmp_path / "session", config)
    assert session.run() == []
    session.record.journal.close()
    dataset = Dataset.open(build_dataset(session.folder))
    assert len(dataset) == 40
    # The same convolver answers both ways: the room is exactly reciprocal.
    for pair in dataset.pairs():
        forward = dataset.responses[pair.forward][0]
        reverse = dataset.responses[pair.reverse][0]
        error = np.linalg.norm(forward - reverse) / np.linalg.norm(forward)
        assert error <= 1e-5


def stall(server: Any) -> None:
    server.room.send_signal(signal.SIGSTOP)
    time.sleep(0.25)
    server.room.send_signal(signal.SIGCONT)


def pull(server: Any) -> None:
    [port] = [p for p in server.ports() if p.startswith("PortAudio") and "in_0" in p]
    server.disconnect("room:mic1", port)


def end_room(server: Any) -> None:
    server.room.terminate()
    server.room.wait()


def end_server(server: Any) -> None:
    server.server.terminate()
    server.server.wait()


def kill_server(server: Any) -> None:
    server.server.kill()
    server.server.wait()


FAULTS = [
    (stall, "the driver reported", True),
    (pull, "channel 0 is exactly zero", False),
    (end_room, "channel 1 is exactly zero", False),
    (end_server, "audio stream stopped", False),
    (kill_server, "audio stream stopped", False),
]


@pytest.mark.parametrize(("fault", "reason", "heals"), FAULTS)
def test_a_fault_spoils_its_take_and_the_session_goes_on(
    start_jack: Callable[..., Any],
    tmp_path: Path,
    fault: Callable[[Any], None],
    reason: str,
    heals: bool,
) -> None:
    server = start_jack()
    start_room(server)
    config = make_config(retakes=1, stop_after=1)
    threads: list[threading.Thread] = []

    def harm(event: Event) -> None:
        if event["event"] == "playing" and event["take"] == "P01_AB_1":
            threads.append(threading.Timer(0.45, fault, [server]))
            threads[-1].start()

    session = open_session(tmp_path / "session", config, harm)
    if heals:
        assert session.run() == []
    else:
        with pytest.raises(SessionError, match="run again|resumes"):
            session.run()
    threads[0].join()
    session.record.journal.close()
    events = read_journal(session.folder.journal_path).events
    spoiled = [e for e in events if e.get("take") == "P01_AB_1"][-1]
    told = spoiled.get("reason") or "; ".join(spoiled["reasons"])
    assert reason in told
    if not heals:
        server.stop()
        start_room(start_jack())
        again = open_session(tmp_path / "session", config)
        assert recover(again) == []
        assert again.run() == []
        again.record.journal.close()
