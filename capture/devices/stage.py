"""Set the stage of a session: rigs, interface, sensor and clock in one world."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from capture.config import SessionConfig, SimulationConfig
from capture.devices.movers import Mover, Person, RigPair
from capture.devices.operator import Operator
from capture.devices.placement import PlacedWorld
from capture.devices.sensors import (
    AirSensor,
    AskedAir,
    FileSensor,
    NoSensor,
    SimulatedAir,
)
from capture.interfaces import INTERFACES, AudioInterface, InterfaceSurroundings
from rigs import (
    Carriers,
    Clock,
    Envelope,
    KeepOut,
    SimulatedRig,
    SystemClock,
    VirtualClock,
    load_rig,
)
from rir import ConfigError, Dataset, Environment, GainPattern, Pose, RoomSpec

__all__ = ["Stage", "build_mover", "set_stage"]


@dataclass
class Stage:
    """Everything a session works with."""

    mover: Mover
    open_interface: Callable[[], AudioInterface]
    sensor: AirSensor
    clock: Clock
    world: PlacedWorld | None = None
    """The simulated room, if there is one."""


def room_envelope(room: RoomSpec) -> Envelope:
    """Return the free air of a room as the reach of a rig."""
    boxes = tuple(
        KeepOut(box.name, np.array(box.low), np.array(box.high))
        for box in room.furniture
    )
    return Envelope(np.zeros(3), np.array(room.size_m), boxes)


def _unheard(text: str) -> None:
    del text


def set_stage(
    config: SessionConfig,
    *,
    operator: Operator | None = None,
    note: Callable[[str], None] = _unheard,
    on_progress: Callable[[int], None] | None = None,
) -> Stage:
    """Build the devices of a session.

    Parameters
    ----------
    config : SessionConfig
        What the session is.
    operator : Operator, optional
        Who can be asked; needed when a person moves the stands.
    note : callable
        Takes the operator's notes.
    on_progress : callable, optional
        Told how many samples of a take are recorded, where that takes time.
    """
    world = None
    if config.interface == "simulated":
        world = PlacedWorld(build_world(config), config)
    clock = VirtualClock() if config.rig == "simulated" else SystemClock()
    around = InterfaceSurroundings(world, on_progress)
    mover = build_mover(config, world=world, clock=clock, operator=operator, note=note)
    if mover.simulated:
        clock = VirtualClock()
    return Stage(
        mover,
        lambda: INTERFACES[config.interface].open(config, around),
        build_sensor(config, world, operator),
        clock,
        world,
    )


def build_sensor(
    config: SessionConfig, world: PlacedWorld | None, operator: Operator | None
) -> AirSensor:
    """Return what reads the air: a file, the operator, the simulation, or nobody."""
    tell = operator.say if operator else _unheard
    if config.thermometer == "ask" and operator is not None:
        return AskedAir(operator.ask)
    if config.thermometer not in (None, "ask"):
        return FileSensor(Path(str(config.thermometer)), tell)
    if world is None or config.simulation is None:
        return NoSensor()
    sigma = config.simulation.temperature_sigma_c
    return SimulatedAir(world, _air(config.room), sigma_c=sigma, seed=config.seed)


def build_mover(
    config: SessionConfig,
    *,
    world: PlacedWorld | None = None,
    clock: Clock | None = None,
    operator: Operator | None = None,
    note: Callable[[str], None] = _unheard,
) -> Mover:
    """Return what moves the devices; without a world it only checks.

    Raises
    ------
    ConfigError
        If a person is to move the stands and nobody can be asked.
    """
    on_emitter = on_listener = None
    if world is not None:
        on_emitter, on_listener = world.place_emitter, world.place_listener
    if config.rig == "manual":
        return _person(
            config, clock or SystemClock(), operator, note, on_emitter, on_listener
        )
    if config.rig == "simulated":
        return RigPair(_simulated_rigs(config, on_emitter, on_listener, clock))
    consent = None if operator is None else lambda text: _yes(operator.ask(text))
    carriers = load_rig(
        rig_file(config.rig),
        on_emitter=on_emitter,
        on_listener=on_listener,
        ask=consent,
        tell=operator.say if operator else None,
    )
    return RigPair(carriers, ask=consent, homing=True, note=note)


def rig_file(name: str) -> Path:
    """Return the path of a rig file, or of one that comes with the program.

    Examples
    --------
    >>> rig_file("kitchen-simulated").name
    'kitchen-simulated.yaml'
    """
    preset = Path(str(files("rigs"))) / "presets" / f"{name}.yaml"
    return preset if preset.exists() else Path(name)


def _yes(answer: str) -> bool:
    return answer.strip().lower() in {"y", "yes"}


def _person(
    config: SessionConfig,
    clock: Clock,
    operator: Operator | None,
    note: Callable[[str], None],
    on_emitter: Callable[[Pose], None] | None,
    on_listener: Callable[[Pose], None] | None,
) -> Mover:
    if operator is None:
        raise ConfigError(
            "a person must be asked to move the stands; run on a terminal, "
            "or choose another --rig"
        )
    placed = [call for call in (on_emitter, on_listener) if call is not None]
    return Person(
        config.room,
        ask=operator.ask,
        tell=operator.say,
        note=note,
        clock=clock,
        placed=placed,
    )


def _simulated_rigs(
    config: SessionConfig,
    on_emitter: Callable[[Pose], None] | None,
    on_listener: Callable[[Pose], None] | None,
    clock: Clock | None,
) -> Carriers:
    envelope = room_envelope(config.room)
    speaker, microphone = (
        SimulatedRig(call, envelope=envelope, clock=clock, name=name)
        for name, call in (("loudspeaker", on_emitter), ("microphone", on_listener))
    )
    return Carriers(speaker, microphone)


def build_world(config: SessionConfig) -> Any:
    """Return the simulated world: a room model, or responses measured before."""
    simulation = config.simulation or SimulationConfig()
    if simulation.measured is not None:
        from rooms.world import MeasuredWorld

        return MeasuredWorld(Dataset.open(simulation.measured))
    from rooms.world import World

    omni, cardioid = GainPattern.omni(), GainPattern.cardioid()
    return World(
        config.room,
        sample_rate=config.sample_rate,
        duration=config.response_s,
        emitter_gain=cardioid if simulation.loudspeaker == "cardioid" else omni,
        listener_gain=omni,
        seed=config.seed,
    )


def _air(room: RoomSpec) -> Environment:
    air = room.air
    return Environment(air.temperature_c, air.humidity_percent, air.pressure_kpa)
