"""``capture-pairs check``: before a session, find the loopback and the level."""

from dataclasses import dataclass
from pathlib import Path

from capture.commands.options import SessionOptions, option
from rir.command import make_console

__all__ = ["CheckOptions", "check_devices"]


@dataclass(frozen=True)
class CheckOptions:
    """What is at hand for the check."""

    calibrator_db: float | None = option(
        "Level of a 1 kHz calibrator on the first microphone [dB re 20 µPa]."
    )


def check_devices(session: SessionOptions, checking: CheckOptions) -> None:
    """Find loopback, level, noise and distortion; nothing moves.

    What was found is written to checked.yaml, to measure with --config checked.yaml.
    """
    from capture.devices.stage import set_stage
    from capture.plan import build_plan
    from capture.session.folder import write_text
    from capture.session.preflight import Preflight, lock_settings
    from rir import InterfaceError
    from rir.config import dump_yaml

    console = make_console()
    config = session.plan()
    stage = set_stage(config.model_copy(update={"rig": "simulated"}))
    stage.mover.place(build_plan(config).moves[0])
    interface = stage.open_interface()
    try:
        found = Preflight.of(interface, config, checking.calibrator_db)
    finally:
        interface.close()
    for line in found.lines:
        console.out(line)
    if found.problems:
        raise InterfaceError("; ".join(found.problems))
    path = Path("checked.yaml")
    write_text(path, dump_yaml(lock_settings(config, found)))
    console.out(f"settings locked in {path}: measure with --config {path}")
