import ctypes.util
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

JACK_TOOLS = ("jackd", "jack_lsp", "jack_connect", "jconvolver")


class JackServer:
    """A JACK server without a sound card, under a name of its own."""

    def __init__(self, folder: Path, *, channels: int, ports: int) -> None:
        # One name for all: JACK's registry frees a killed server's place only when
        # the same name comes again, and it has eight places.
        self.name = f"resounding-tests-{os.environ.get('PYTEST_XDIST_WORKER', '0')}"
        self.folder = folder
        self.env = {
            **os.environ,
            "JACK_NO_AUDIO_RESERVATION": "1",
            "JACK_NO_START_SERVER": "1",
            "JACK_DEFAULT_SERVER": self.name,
        }
        count = str(channels)
        options = ["-n", self.name, "-S", "-p", str(ports), "-d", "dummy"]
        options += ["-r", "48000", "-p", "1024", "-C", count, "-P", count, "-m"]
        self.processes = [self._start("jackd", *options)]
        try:
            self.wait_for("system:")
        except TimeoutError:
            self.stop()
            raise

    def _start(self, *command: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            command,
            env=self.env,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def ports(self) -> list[str]:
        """Return the names of all ports."""
        done = subprocess.run(
            ["jack_lsp", "-s", self.name], env=self.env, capture_output=True, text=True
        )
        return done.stdout.splitlines()

    def wait_for(self, prefix: str) -> None:
        """Wait until a client's ports are there."""
        for _ in range(200):
            if any(port.startswith(prefix) for port in self.ports()):
                return
            time.sleep(0.05)
        raise TimeoutError(f"no JACK port {prefix}*")

    def start_room(self, lines: list[str], inputs: int, outputs: int) -> None:
        """Start a convolver called ``room`` with impulse lines of its own language."""
        text = ["/jack/client room", f"/convolver/new {inputs} {outputs} 1024 131072"]
        text += [f"/input/name {n + 1} spk{n + 1}" for n in range(inputs)]
        text += [f"/output/name {n + 1} mic{n + 1}" for n in range(outputs)]
        path = self.folder / "room.conf"
        path.write_text("\n".join([*text, *lines]) + "\n")
        self.processes.append(self._start("jconvolver", "-s", self.name, str(path)))
        self.wait_for("room:mic")

    @property
    def room(self) -> subprocess.Popen[bytes]:
        """The convolver."""
        return self.processes[1]

    @property
    def server(self) -> subprocess.Popen[bytes]:
        """The JACK server."""
        return self.processes[0]

    def disconnect(self, one: str, other: str) -> None:
        """Pull a cable."""
        command = ["jack_disconnect", "-s", self.name, one, other]
        subprocess.run(command, env=self.env, check=True, capture_output=True)

    def stop(self) -> None:
        """End clients, then the server, and clear away what a kill left."""
        for process in reversed(self.processes):
            process.send_signal(signal.SIGCONT)
            process.terminate()
            try:
                process.wait(3.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for path in Path("/dev/shm").glob(f"jack*{self.name}*"):
            path.unlink(missing_ok=True)


@pytest.fixture
def start_jack(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., JackServer]]:
    """Return what starts a JACK server; it ends with the test."""
    missing = [tool for tool in JACK_TOOLS if shutil.which(tool) is None]
    if missing or not ctypes.util.find_library("portaudio"):
        pytest.skip(
            "needs apt packages libportaudio2 jackd2 jconvolver (missing: "
            f"{', '.join(missing) or 'libportaudio2'})"
        )
    servers: list[JackServer] = []

    def start(*, channels: int = 8, ports: int = 256) -> JackServer:
        servers.append(JackServer(tmp_path, channels=channels, ports=ports))
        for name in ("JACK_NO_START_SERVER", "JACK_DEFAULT_SERVER"):
            monkeypatch.setenv(name, servers[-1].env[name])
        return servers[-1]

    yield start
    for server in servers:
        server.stop()
