"""The words every other package speaks: poses, responses, rooms, data sets.

Names are loaded on first use, so that commands start fast.
"""

from typing import TYPE_CHECKING

from rir.lazy import lazy_names

if TYPE_CHECKING:
    from rir.dataset import Dataset
    from rir.dataset_writer import DatasetWriter
    from rir.errors import (
        ConfigError,
        DatasetError,
        ExtensionError,
        InterfaceError,
        MissingPartError,
        OutOfReachError,
        ResoundingError,
        RigError,
        SceneError,
        SessionError,
        SignalError,
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

__all__ = [
    "Air",
    "Box",
    "ConfigError",
    "Dataset",
    "DatasetError",
    "DatasetWriter",
    "Environment",
    "ExtensionError",
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
    "TrainingError",
    "UnknownNameError",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "rir.dataset": "Dataset",
        "rir.dataset_writer": "DatasetWriter",
        "rir.errors": (
            "ConfigError "
            "DatasetError "
            "ExtensionError "
            "InterfaceError "
            "MissingPartError "
            "OutOfReachError "
            "ResoundingError "
            "RigError "
            "SceneError "
            "SessionError "
            "SignalError "
            "TrainingError "
            "UnknownNameError "
        ),
        "rir.gain": "GainPattern",
        "rir.pose": "Pose Poses",
        "rir.records": "Environment Measurement PairRecord Provenance",
        "rir.registry": "Registry",
        "rir.response": "ImpulseResponse",
        "rir.room": "Air Box RoomSpec Surface",
        "rir.rows": "PairRows",
    },
)
