"""Count what is lost or counted twice when a session is killed at random moments.

Sessions are killed (SIGKILL) and resumed until the asked number of kills is
reached. After each kill every finished take must still be on the disk, bit for
bit; at the end of each session the data set must equal an undisturbed one's apart
from time stamps.

Bar: at 50 kills no finished take lost, none counted twice.
"""

import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from capture.config import SessionConfig
from capture.operator.display import PlainDisplay
from capture.session.dataset import raw_problem
from capture.session.folder import SessionFolder
from capture.session.journal import read_journal
from capture.session.run import run_session
from capture.session.start import SessionRequest, is_complete, plan_session
from capture.session.state import SessionState
from harness import make_parser, write_results
from rir import Dataset

SETTINGS = {
    "sample_rate": 16000,
    "takes": 2,
    "response_s": 0.2,
    "sweep": {"seconds": 1.0, "band_hz": (60.0, 7000.0), "tail_s": 0.4, "noise_s": 0.3},
    "simulation": {"noise_db": -60.0, "converter_noise_db": -100.0},
}


BOOTH = "name: booth\nsize_m: [4.2, 3.4, 2.5]\nsurfaces: {all: {absorption: 0.7}}\n"


def small_session(place: Path, pairs: int) -> SessionConfig:
    """Return a session that takes a second or two, in a dry room."""
    room = place / "booth.yaml"
    room.write_text(BOOTH)
    request = SessionRequest(str(room), str(pairs), seed=5, settings=SETTINGS)
    return plan_session(request)


def start(folder: SessionFolder, config: SessionConfig) -> int:
    """Run or resume a session in a child process and return its id."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        with Path(os.devnull).open("w") as nowhere:
            display = PlainDisplay(Console(file=nowhere), simulated=True)
            run_session(folder, None if folder.exists else config, display)
        code = 0
    finally:
        os._exit(code)


def undisturbed(folder: SessionFolder, config: SessionConfig) -> float:
    """Run a session to its end and return how long it took [s]."""
    begun = time.monotonic()
    _, status = os.waitpid(start(folder, config), 0)
    if status:
        raise SystemExit(f"the undisturbed session failed with status {status}")
    return time.monotonic() - begun


def finished_takes(folder: SessionFolder) -> dict[str, str]:
    """Return checksum by name of the takes the journal calls finished."""
    state = SessionState.of(read_journal(folder.journal_path).events)
    return {name: take.event["sha256"] for name, take in state.takes.items()}


def lost_after_kill(folder: SessionFolder) -> list[str]:
    """Return the finished takes whose files are not whole any more."""
    state = SessionState.of(read_journal(folder.journal_path).events)
    return [name for name, take in state.takes.items() if raw_problem(folder, take)]


def differences(one: Path, other: Path) -> list[str]:
    """Return in what two data sets differ, time stamps and names apart."""
    a, b = Dataset.open(one), Dataset.open(other)
    if len(a) != len(b):
        return [f"{len(a)} rows against {len(b)}"]
    wrong = []
    if not np.array_equal(a.responses[:], b.responses[:]):
        wrong.append("responses")
    if not np.array_equal(a.emitters.positions, b.emitters.positions):
        wrong.append("emitters")
    for name in sorted(set(a.table) - {"time_utc", "session"}):
        equal_nan = a.table[name].dtype.kind == "f"
        if not np.array_equal(a.table[name], b.table[name], equal_nan=equal_nan):
            wrong.append(name)
    return wrong


def kill_until_done(
    folder: SessionFolder,
    config: SessionConfig,
    length: float,
    rng: np.random.Generator,
    most: int,
) -> tuple[int, list[str]]:
    """Kill and resume one session until it ends; return kills and what went wrong."""
    kills, wrong, known = 0, [], {}
    while True:
        child = start(folder, config)
        if kills < most:
            time.sleep(rng.uniform(0.0, length))
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            kills += 1
        elif status:
            return kills, [*wrong, f"a resumed session failed with status {status}"]
        now = finished_takes(folder) if folder.exists else {}
        wrong += [f"{take} is lost" for take in known if now.get(take) != known[take]]
        wrong += [f"{take} is damaged" for take in lost_after_kill(folder)]
        known = now
        if not status and is_complete(folder):
            return kills, wrong


def main(argv: Sequence[str] | None = None) -> int:
    """Kill sessions, print the table, write the result."""
    parser = make_parser(__doc__, "kill_session", "4 kills")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(argv)
    wanted = 4 if options.quick else options.kills
    rng = np.random.default_rng(options.seed)
    kills, wrong, sessions = 0, [], 0
    with tempfile.TemporaryDirectory() as place:
        config = small_session(Path(place), options.pairs)
        whole = SessionFolder(Path(place) / "whole")
        length = undisturbed(whole, config)
        while kills < wanted:
            sessions += 1
            folder = SessionFolder(Path(place) / f"killed{sessions}")
            more, bad = kill_until_done(folder, config, length, rng, wanted - kills)
            kills += more
            bad += differences(whole.dataset_path, folder.dataset_path)
            wrong += [f"session {sessions}: {text}" for text in bad]
    result = {"kills": kills, "sessions": sessions, "session_s": length, "wrong": wrong}
    write_results(options.out, result)
    print(
        f"{kills} kills in {sessions} sessions of {length:.1f} s: {len(wrong)} faults"
    )
    print("\n".join(wrong) or "every data set equals the undisturbed one")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
