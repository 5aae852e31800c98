"""The program's end of the line to the audio process, with its watchdog."""

import os
import pickle
import secrets
import subprocess
import sys
import time
from collections.abc import Callable
from multiprocessing.connection import Connection, Listener
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import InterfaceError

__all__ = ["AudioProcess"]

START_S = 20.0  # half a second (decision 0017); far more on a loaded machine
ANSWER_S = 15.0  # drivers may scan their hardware; a dead server never answers
STALL_S = 3.0  # 60 pulses of the worker without a sample: the server is dead


class AudioProcess:
    """A process that speaks to PortAudio and is killed when it stops answering.

    Parameters
    ----------
    stall_s : float
        Longest time without a new sample before a take is given up [s].
    on_progress : callable, optional
        Told how many samples of a take are recorded.
    """

    def __init__(
        self,
        *,
        stall_s: float = STALL_S,
        on_progress: Callable[[int], None] | None = None,
    ) -> None:
        self._stall_s = stall_s
        self._on_progress = on_progress
        key = secrets.token_bytes(32)
        with Listener(None, authkey=key) as listener:
            address = pickle.dumps(listener.address).hex()
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "capture.interfaces.worker", address],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                text=True,
            )
            self._connection = self._accept(listener, key)

    def _accept(self, listener: Listener, key: bytes) -> Connection:
        if self._process.stdin is not None:
            self._process.stdin.write(key.hex() + "\n")
            self._process.stdin.close()
        socket = getattr(getattr(listener, "_listener", None), "_socket", None)
        if socket is not None:
            socket.settimeout(START_S)
        try:
            return listener.accept()
        except OSError as error:
            self.kill()
            raise InterfaceError(
                f"the audio process did not start within {START_S:g} s; try again"
            ) from error

    def ask(self, *request: Any) -> Any:
        """Send a request and return the answer.

        Raises
        ------
        InterfaceError
            If the answer is an error, or none comes in time.
        """
        self._send(request)
        return self._answer(ANSWER_S)

    def take(
        self, signal: NDArray[np.float64], n_samples: int, output: int
    ) -> tuple[NDArray[np.float64], list[str], dict[str, Any]]:
        """Play and record; return samples, flags and detail.

        Raises
        ------
        InterfaceError
            If the stream stops or its process dies; the process is then gone.
        """
        self._send(("take", signal.astype(np.float32), n_samples, output))
        shape, flags, detail = self._answer(self._stall_s)
        data = np.frombuffer(self._receive_bytes(), dtype=np.float32)
        return data.reshape(shape).astype(np.float64), flags, detail

    def _send(self, request: tuple[Any, ...]) -> None:
        try:
            self._connection.send(request)
        except OSError as error:
            raise self._gone() from error

    def _answer(self, patience: float) -> Any:
        """Wait for an answer as long as samples keep coming."""
        frames, last = -1, time.monotonic()
        while time.monotonic() - last < patience:
            message = self._receive(patience)
            if message is None:
                break
            if message[0] == "done":
                return message[1]
            if message[0] == "error":
                raise pickle.loads(message[1])
            if message[1] != frames:
                frames, last = message[1], time.monotonic()
                if self._on_progress is not None:
                    self._on_progress(message[2])
        self.kill()
        raise InterfaceError(
            f"the audio stream stopped: no sample for {patience:g} s; "
            "check the device, its cable and its server"
        )

    def _receive(self, seconds: float) -> Any:
        try:
            return self._connection.recv() if self._connection.poll(seconds) else None
        except (EOFError, OSError) as error:
            raise self._gone() from error

    def _receive_bytes(self) -> bytes:
        try:
            return self._connection.recv_bytes()
        except (EOFError, OSError) as error:
            raise self._gone() from error

    def _gone(self) -> InterfaceError:
        self.kill()
        return InterfaceError(
            "the audio process ended by itself; the device or its driver has gone"
        )

    def close(self) -> None:
        """End the process: politely for two seconds, then by force."""
        try:
            self._connection.send(("close",))
            self._process.wait(2.0)
        except (OSError, subprocess.TimeoutExpired):
            pass
        self.kill()

    def kill(self) -> None:
        """End the process at once; a second call does nothing."""
        self._process.kill()
        self._process.wait()
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.close()
