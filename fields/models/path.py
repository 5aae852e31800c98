"""The path field: a room found in the responses, and what completes it.

No mesh, no start value: a few seconds on one core. Everything it holds is symmetric in
the two ends with their patterns, so it is reciprocal by construction. A network is
asked only where neither walls nor rows explain the sound. What it computes is found
in `inverse`; here it becomes a field.
"""

import json
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import NonNegativeFloat, NonNegativeInt

from fields.data import FieldData
from fields.field import paired_queries
from fields.frame import SceneFrame
from fields.joined import FieldWithNetwork, join_network
from fields.plan import TrainingPlan
from fields.settings import Count, settings
from fields.stored import FIELD, read_arrays
from inverse.acoustics import Acoustics
from inverse.array_parts import part_of, prefixed
from inverse.find import find_room
from inverse.guard import needs_network
from inverse.paths.air import speed_at, stretched
from inverse.paths.polyhedron import Polyhedron
from inverse.plan.described import box_triangles
from inverse.plan.ground_plan import GroundPlan, plan_of
from inverse.rows.reading import as_rows
from rir import GainPattern, Pose, Poses, TrainingError

__all__ = ["PRESETS", "Config", "PathField", "fit", "load"]

MOST_ENDS = 2000  # places kept for the plan's drawing, where more would only overlap


@settings
class Config:
    """Sizes of the path field."""

    scan_rows: Count = 120
    "responses the walls are looked for in"
    reach_s: NonNegativeFloat = 0.12
    "longest path, seconds; beyond it the late field speaks alone"
    late: bool = True
    "complete the paths with a late field"
    pose_sd_m: NonNegativeFloat = 0.003
    "standard deviation of each stated coordinate of fitted rows, metres; 0: exact"
    geometry: str = "auto"
    "auto: the room's mesh where it is known; blind; or a mesh, room file or scene"
    network_steps: NonNegativeInt = 400
    "steps of a network where nothing else explains the room; 0 asks none"


PRESETS = {"cpu": Config()}


class PathField:
    """Answer responses from fitted paths and what completes them."""

    name = "path"

    def __init__(
        self,
        acoustics: Acoustics,
        frame: SceneFrame,
        config: Config,
        ends: np.ndarray | None = None,
        joined: FieldWithNetwork | None = None,
    ) -> None:
        self.acoustics = acoustics
        self.joined = joined
        self.frame = frame
        self.config = config
        self.ends = np.empty((0, 6)) if ends is None else ends

    @property
    def alarms(self) -> list[str]:
        """What of the room is not explained, in words."""
        return self.acoustics.alarms

    @property
    def report(self) -> dict[str, Any]:
        """What was found, for a table or a log."""
        return self.acoustics.report()

    def predict(
        self,
        emitters: Poses | Pose | np.ndarray,
        listeners: Poses | Pose | np.ndarray,
        *,
        temperature_c: float | None = None,
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32.

        Parameters
        ----------
        emitters, listeners : Poses, Pose or ndarray
            Both ends.
        temperature_c : float, optional
            Of the air, degrees Celsius; the mean of the measured rows by default.

        Raises
        ------
        SignalError
            If the temperature is no temperature of a room.
        """
        exact = self.predict_exactly(emitters, listeners, temperature_c=temperature_c)
        return exact.astype(np.float32)

    def predict_exactly(
        self,
        emitters: Poses | Pose | np.ndarray,
        listeners: Poses | Pose | np.ndarray,
        *,
        temperature_c: float | None = None,
    ) -> np.ndarray:
        """Return responses in double precision; see :meth:`predict`."""
        first, second = paired_queries(emitters, listeners)
        answer = self.acoustics.predict(first, second, self.frame.n_samples)
        if self.joined is not None:
            answer = self.joined.apply(answer, first, second)
        if temperature_c is not None:
            speed = self.acoustics.mean_speed(self.frame.speed_of_sound)
            later = speed / speed_at(temperature_c)
            latency = self.acoustics.latency_s * self.frame.sample_rate
            answer = stretched(answer, later, latency)
        return self.frame.scale * answer

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern as fitted, 1 on average over directions."""
        return self.acoustics.emitter_gain()

    def plan(self) -> GroundPlan:
        """Return the walls as found, seen from above, with what is sure of them."""
        shape, room = self.frame.shape, self.frame.room
        return plan_of(
            self.acoustics.fitted,
            self.ends[:, :3],
            self.ends[:, 3:],
            box_triangles(room) if shape is None else shape.triangles,
            unexplained=self.acoustics.unexplained,
            mark=self.frame.mark,
            alarms=self.alarms,
        )

    def draw(self, folder: Path) -> list[Path]:
        """Write plan.png and plan.json into a folder."""
        return self.plan().write(folder) if len(self.ends) else []

    def save(self, path: str | Path) -> Path:
        """Write the field to ``path`` with the ending .npz."""
        target = Path(path).with_suffix(".npz")
        arrays: dict[str, Any] = {
            **FIELD.stamp,
            "model": np.array(self.name),
            "config": np.array(json.dumps(asdict(self.config))),
            "frame": np.array(json.dumps(self.frame.as_dict())),
            "ends": self.ends,
            **self.acoustics.as_arrays(),
        }
        joined = {} if self.joined is None else self.joined.as_arrays()
        np.savez(target, **arrays, **prefixed("joined", joined))
        return target


def fit(data: FieldData, config: Config, plan: TrainingPlan) -> PathField:
    """Find the room in the rows and fit it.

    The plan's exchange and self-supervision change nothing: the field is reciprocal
    by construction and is fitted, not trained. Its steps and budget limit the
    network that is asked where nothing else explains the room.
    """
    frame = data.frame
    known = frame.speed_of_sound, data.recording
    rows = as_rows(
        data.responses, data.emitters, data.listeners, frame.sample_rate, *known
    )
    gains = frame.emitter_gain, frame.listener_gain
    aimed = None if None in gains else gains[0] != gains[1]
    acoustics = find_room(
        rows,
        scan_rows=config.scan_rows,
        reach_s=config.reach_s,
        late=config.late,
        pose_sd_m=config.pose_sd_m,
        emitting=frame.emitter_gain,
        listening=frame.listener_gain,
        aimed=aimed,
        shape=_shape(config.geometry, frame),
    )
    joined, steps = None, config.network_steps
    if steps > 0 and config.late and needs_network(acoustics, rows):
        alike = not aimed and not (acoustics.blend and acoustics.blend.aimed)
        answers = partial(acoustics.left_out, among=rows)
        joined, message = join_network(answers, rows, data, plan, steps, alike=alike)
        acoustics.alarms.append(message)
    ends = data.endpoints[:: -(-len(data) // MOST_ENDS)]
    return PathField(acoustics, frame, config, ends, joined)


def _shape(geometry: str, frame: SceneFrame) -> Polyhedron | None:
    """Return the room as drawn, None where it is to be found blind."""
    if geometry == "auto":
        known = frame.shape
        return None if known is None else Polyhedron.of_triangles(known.triangles)
    return None if geometry == "blind" else Polyhedron.load(geometry)


def load(path: Path) -> PathField:
    """Open a stored path field.

    Raises
    ------
    TrainingError
        If the file lacks a part, as those of older programs do, or was written by
        a newer one.
    """
    stored = read_arrays(path)
    config = Config(**json.loads(str(stored["config"])))
    frame = SceneFrame.from_dict(json.loads(str(stored["frame"])))
    kept = part_of(stored, "joined")
    joined = FieldWithNetwork.from_arrays(kept) if kept else None
    try:
        acoustics = Acoustics.from_arrays(stored)
    except KeyError as missing:
        raise TrainingError(
            f"{path} holds no {missing} of a path field: an older program wrote it; "
            "train the field again"
        ) from missing
    return PathField(acoustics, frame, config, stored.get("ends"), joined)
