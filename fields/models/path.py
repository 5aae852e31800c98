"""The path field: a room found in the responses, and what completes it.

What it holds is symmetric in the two ends, so it is reciprocal by construction. It is
found in `inverse`; a network is asked where neither walls nor rows explain the sound.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import NonNegativeInt

from fields.data import FieldData
from fields.field import paired_queries
from fields.frame import SceneFrame
from fields.joined import FieldWithNetwork, join_network
from fields.plan import TrainingPlan
from fields.settings import settings
from fields.stored import naming_missing_parts, read_arrays, write_arrays
from inverse.acoustics import Acoustics
from inverse.array_parts import part_of, prefixed
from inverse.find import find_room
from inverse.guard import needs_network
from inverse.plan.described import box_triangles
from inverse.plan.ground_plan import GroundPlan, plan_of
from inverse.plan.plan_plot import write_plan
from inverse.rows.reading import as_rows
from inverse.search import PriorKnowledge, SearchSettings
from rir import GainPattern, Pose, Poses

__all__ = ["PRESETS", "Config", "PathField", "fit", "load"]

MOST_ENDS = 2000  # places kept for the plan's drawing, where more would only overlap
Ends = Poses | Pose | np.ndarray


@settings
class Config(SearchSettings):
    """Sizes of the path field."""

    geometry: str = "auto"
    "auto: the room's mesh where it is known; blind; or a mesh, room file or scene"
    network_steps: NonNegativeInt = 400
    "steps of a network where nothing else explains the room; 0 asks none"


PRESETS = {"cpu": Config()}


@dataclass(eq=False)
class PathField:
    """Answer responses from fitted paths and what completes them."""

    acoustics: Acoustics
    frame: SceneFrame
    config: Config
    ends: np.ndarray = field(default_factory=lambda: np.empty((0, 6)))
    "places of rows for the plan, shape (rows, 6), metres"
    joined: FieldWithNetwork | None = None
    name: ClassVar[str] = "path"

    @property
    def alarms(self) -> list[str]:
        """What of the room is not explained, in words."""
        return self.acoustics.alarms

    @property
    def report(self) -> dict[str, Any]:
        """What was found, for a table or a log."""
        return self.acoustics.report()

    def predict(
        self, emitters: Ends, listeners: Ends, *, temperature_c: float | None = None
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32.

        For air of a temperature, degrees Celsius; by default the measured rows' mean.
        """
        exact = self.predict_exactly(emitters, listeners, temperature_c=temperature_c)
        return exact.astype(np.float32)

    def predict_exactly(
        self, emitters: Ends, listeners: Ends, *, temperature_c: float | None = None
    ) -> np.ndarray:
        """Return responses in double precision; see :meth:`predict`."""
        first, second = paired_queries(emitters, listeners)
        answer = self.acoustics.predict(first, second, self.frame.n_samples)
        if self.joined is not None:
            answer = self.joined.apply(answer, first, second)
        if temperature_c is not None:
            stated = self.frame.sample_rate, self.frame.speed_of_sound
            answer = self.acoustics.at_temperature(answer, temperature_c, *stated)
        return self.frame.scale * answer

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern as fitted, 1 on average over directions."""
        return self.acoustics.emitter_gain()

    def plan(self) -> GroundPlan:
        """Return the walls as found, seen from above, with what is sure of them."""
        shape, ends = self.frame.shape, (self.ends[:, :3], self.ends[:, 3:])
        known = box_triangles(self.frame.room) if shape is None else shape.triangles
        return plan_of(self.acoustics, *ends, known, self.frame.mark)

    def draw(self, folder: Path) -> list[Path]:
        """Write plan.png and plan.json into a folder."""
        return write_plan(self.plan(), folder) if len(self.ends) else []

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        arrays = {"ends": self.ends, **self.acoustics.as_arrays()}
        if self.joined is not None:
            arrays |= prefixed("joined", self.joined.as_arrays())
        return write_arrays(path, self.name, self.config, self.frame, arrays)


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> PathField:
    """Find the room in the rows and fit it.

    The plan's exchange and self-supervision change nothing: the field is reciprocal
    by construction. Its steps and budget limit the network that may be asked.
    """
    frame = data.frame
    known = frame.sample_rate, frame.speed_of_sound, data.recording
    rows = as_rows(data.responses, data.emitters, data.listeners, *known)
    surfaces = None if frame.shape is None else frame.shape.triangles
    gains = frame.emitter_gain, frame.listener_gain
    prior = PriorKnowledge.of(config.geometry, surfaces, *gains)
    acoustics, joined = find_room(rows, config, prior), None
    if config.network_steps and config.late and needs_network(acoustics, rows):
        alike = not prior.aimed and not (acoustics.blend and acoustics.blend.aimed)
        asked = rows, data, plan, config.network_steps
        joined, message = join_network(acoustics, *asked, alike=alike)
        acoustics.alarms.append(message)
    ends = data.endpoints[:: -(-len(data) // MOST_ENDS)]
    return PathField(acoustics, frame, config, ends, joined)


def load(path: Path) -> PathField:
    """Open a stored path field; TrainingError if it lacks a part or is too new."""
    stored = read_arrays(path)
    config = Config(**json.loads(str(stored["config"])))
    frame = SceneFrame.from_dict(json.loads(str(stored["frame"])))
    kept = part_of(stored, "joined")
    joined = FieldWithNetwork.from_arrays(kept) if kept else None
    with naming_missing_parts(path):
        acoustics = Acoustics.from_arrays(stored)
    ends = stored.get("ends", np.empty((0, 6)))
    return PathField(acoustics, frame, config, ends, joined)
