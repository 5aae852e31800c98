"""The process that holds the audio stream, so that it can be killed."""

import os
import pickle
import sys
import time
from multiprocessing.connection import Client, Connection
from typing import Any

import numpy as np

from capture.interfaces.stream import DuplexStream, StreamSettings, list_devices
from rir import ResoundingError

__all__ = ["serve"]

PULSE_S = 0.05
"""How often the worker tells that the stream is alive."""


def serve(connection: Connection) -> None:
    """Answer requests until the other side goes away.

    A request is a tuple: ``("list",)``, ``("open", settings)``, ``("take", signal,
    n_samples, output)`` or ``("close",)``. Answers are ``("done", …)``, ``("error",
    text)`` and, while a take runs, ``("alive", frames)``.

    Parameters
    ----------
    connection : Connection
        The line to the program.
    """
    stream: DuplexStream | None = None
    while True:
        request = connection.recv()
        try:
            if request[0] == "list":
                connection.send(("done", list_devices()))
            elif request[0] == "open":
                stream = DuplexStream(StreamSettings(**request[1]))
                connection.send(("done", stream.device))
            elif request[0] == "take" and stream is not None:
                _take(connection, stream, *request[1:])
            else:
                if stream is not None:
                    stream.close()
                connection.send(("done", None))
                return
        except ResoundingError as error:
            connection.send(("error", pickle.dumps(error)))


def _take(
    connection: Connection,
    stream: DuplexStream,
    signal: Any,
    n_samples: int,
    output: int,
) -> None:
    stream.begin(np.atleast_2d(signal).astype(np.float32), n_samples, output)
    while (result := stream.result()) is None:
        time.sleep(PULSE_S)
        connection.send(("alive", stream.frames, stream.taken))
    samples, flags, detail = result
    connection.send(("done", (samples.shape, flags, detail)))
    connection.send_bytes(np.ascontiguousarray(samples).data.cast("B"))


def main() -> None:
    """Connect to the program that started this process, and serve it."""
    address = pickle.loads(bytes.fromhex(sys.argv[1]))
    with Client(address, authkey=bytes.fromhex(sys.stdin.readline())) as connection:
        try:
            serve(connection)
        except (EOFError, ConnectionError):
            pass
        finally:
            # PortAudio's own clean-up at exit can hang when the server has died.
            os._exit(0)


if __name__ == "__main__":
    main()
