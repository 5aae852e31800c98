"""Faults a rig file asks of its simulated boards."""

from collections.abc import Callable

import numpy as np

from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.firmware.marlin import MarlinFirmware
from rigs.kinds.settings import FaultConfig

SimulatedBoard = GrblFirmware | MarlinFirmware


def suffer(chip: SimulatedBoard, fault: FaultConfig, move: int) -> None:
    """Let a simulated board suffer a fault if this is its move."""
    if move == fault.at_move:
        chip.schedule(fault.after_s, _deed(chip, fault), lasting=True)


def _deed(chip: SimulatedBoard, fault: FaultConfig) -> Callable[[], None]:
    deeds: dict[str, Callable[[], None]] = {
        "brown-out": chip.power_cycle,
        "lost-steps": lambda: chip.slip(np.array(fault.millimetres)),
        "garbage": chip.babble,
        "mute": lambda: chip.mute(fault.seconds),
        "delay": lambda: chip.delay(fault.seconds),
        "unplug": lambda: chip.unplug(fault.seconds),
    }
    return deeds[fault.kind]
