"""The words every other package speaks: poses, responses, rooms, data sets.

Names are loaded on first use, so that commands start fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rir.dataset import Dataset
    from rir.dataset_writer import DatasetWriter
    from rir.errors import (
        ConfigError,
        DatasetError,
        InterfaceError,
        MissingPartError,
        OutOfReachError,
        ResoundingError,
        RigError,
        SceneError,
        SessionError,
        SignalError,
        TakeSpoiledError,
        TrainingError,
        UnknownNameError,
    )
    from rir.gain import GainPattern
    from rir.pose import Pose, Poses
    from rir.records import Environment, Measurement, PairRecord, Provenance
    from rir.registry import Registry
    from rir.response import ImpulseResponse
    from rir.room import Air, Box, RoomSpec, Surface
    from rir.rows import PairRows

_HOMES = {
    "rir.dataset": "Dataset",
    "rir.dataset_writer": "DatasetWriter",
    "rir.errors": (
        "ConfigError DatasetError InterfaceError MissingPartError OutOfReachError"
        " ResoundingError RigError SceneError SessionError SignalError"
        " TakeSpoiledError TrainingError UnknownNameError"
    ),
    "rir.gain": "GainPattern",
    "rir.pose": "Pose Poses",
    "rir.records": "Environment Measurement PairRecord Provenance",
    "rir.registry": "Registry",
    "rir.response": "ImpulseResponse",
    "rir.room": "Air Box RoomSpec Surface",
    "rir.rows": "PairRows",
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names.split()}

__all__ = [
    "Air",
    "Box",
    "ConfigError",
    "Dataset",
    "DatasetError",
    "DatasetWriter",
    "Environment",
    "GainPattern",
    "ImpulseResponse",
    "InterfaceError",
    "Measurement",
    "MissingPartError",
    "OutOfReachError",
    "PairRecord",
    "PairRows",
    "Pose",
    "Poses",
    "Provenance",
    "Registry",
    "ResoundingError",
    "RigError",
    "RoomSpec",
    "SceneError",
    "SessionError",
    "SignalError",
    "Surface",
    "TakeSpoiledError",
    "TrainingError",
    "UnknownNameError",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rir' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
