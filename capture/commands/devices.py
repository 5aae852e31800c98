"""``capture-pairs devices``: the audio devices of this machine."""

from rir.command import make_console

__all__ = ["list_devices"]


def list_devices() -> None:
    """List the audio devices that PortAudio sees."""
    from rich.table import Table

    from capture.interfaces.portaudio import find_devices

    console = make_console()
    rows = find_devices()
    if not rows:
        console.out(
            "PortAudio sees no audio device: plug one in, or start the JACK server, "
            "and list again"
        )
        return
    table = Table("device", "host API", "in", "out", "rate [Hz]", box=None)
    for row in rows:
        counts = (str(row.inputs), str(row.outputs))
        table.add_row(row.name, row.host_api, *counts, f"{row.default_rate:g}")
    console.print(table)
