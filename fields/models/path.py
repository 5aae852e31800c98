"""The path field: walls found in the responses, mirror images and a late part.

No mesh, no start value, no network: a few seconds on one core. Everything it
holds is symmetric in the two ends with their patterns, so it is reciprocal by
construction.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fields.data import FieldData
from fields.field import paired_queries
from fields.frame import SceneFrame
from fields.path.acoustics import Acoustics, hear_room
from fields.path.fitset import FitSet
from fields.path.polyhedron import Polyhedron
from fields.plan import TrainingPlan
from rir import GainPattern, Pose, Poses

__all__ = ["PRESETS", "Config", "PathField", "fit", "load"]


@dataclass(frozen=True)
class Config:
    """Sizes of the path field."""

    scan_rows: int = 120
    "responses the walls are looked for in"
    reach_s: float = 0.12
    "longest path, seconds; beyond it the late field speaks alone"
    late: bool = True
    "complete the paths with a late field"
    geometry: str = "auto"
    "auto: the room's mesh where it is known; blind; or a mesh, room file or scene"


PRESETS = {"cpu": Config()}


class PathField:
    """Answer responses from fitted paths and what completes them."""

    name = "path"

    def __init__(self, acoustics: Acoustics, frame: SceneFrame, config: Config) -> None:
        self.acoustics = acoustics
        self.frame = frame
        self.config = config

    @property
    def alarms(self) -> list[str]:
        """What of the room is not explained, in words."""
        return self.acoustics.alarms

    @property
    def report(self) -> dict[str, Any]:
        """What was found, for a table or a log."""
        return self.acoustics.report()

    def predict(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32."""
        return self.predict_exactly(emitters, listeners).astype(np.float32)

    def predict_exactly(
        self, emitters: Poses | Pose | np.ndarray, listeners: Poses | Pose | np.ndarray
    ) -> np.ndarray:
        """Return responses in double precision."""
        first, second = paired_queries(emitters, listeners)
        answer = self.acoustics.predict(first, second, self.frame.n_samples)
        return self.frame.scale * answer

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern as fitted, 1 on average over directions."""
        return self.acoustics.emitter_gain()

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        target = Path(path).with_suffix(".npz")
        arrays: dict[str, Any] = {
            "model": np.array(self.name),
            "config": np.array(json.dumps(asdict(self.config))),
            "frame": np.array(json.dumps(self.frame.as_dict())),
            **self.acoustics.as_arrays(),
        }
        np.savez(target, **arrays)
        return target


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> PathField:
    """Find the room in the rows and fit it.

    The plan's steps, exchange and self-supervision say nothing here: the field
    is reciprocal by construction and is fitted, not trained.
    """
    del plan
    sizes = asdict(config)
    shape = drawn_shape(sizes.pop("geometry"), data.frame)
    acoustics = hear_room(
        FitSet.of(data),
        **sizes,
        listening=data.frame.listener_gain,
        shape=shape,
    )
    return PathField(acoustics, data.frame, config)


def drawn_shape(geometry: str, frame: SceneFrame) -> Polyhedron | None:
    """Return the room as drawn, None where it is to be found blind.

    Parameters
    ----------
    geometry : str
        "auto" takes the mesh the data set knows; "blind" takes none; anything
        else names a mesh, a room file or a built-in scene.
    frame : SceneFrame
        What the data set knows.
    """
    if geometry == "blind":
        return None
    if geometry == "auto":
        known = frame.shape
        return None if known is None else Polyhedron.of_triangles(known.triangles)
    from rooms.builtin import load_scene

    scene = load_scene(geometry)
    return Polyhedron.of_scene(scene)


def load(path: Path) -> PathField:
    """Open a stored path field."""
    with np.load(path, allow_pickle=False) as stored:
        config = Config(**json.loads(str(stored["config"])))
        frame = SceneFrame.from_dict(json.loads(str(stored["frame"])))
        arrays = {
            name: stored[name]
            for name in stored.files
            if name not in ("model", "config", "frame")
        }
    return PathField(Acoustics.from_arrays(arrays), frame, config)
