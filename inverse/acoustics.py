"""A room as it was found: what predicts its responses, and what is sure of it."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from inverse.array_parts import part_of, prefixed
from inverse.bands.fitted_bands import bands_of
from inverse.blend.aligned import AlignedRows
from inverse.blend.blend import Blend
from inverse.blend.fallback import NearestRows
from inverse.objects.found_objects import FoundObjects
from inverse.paths.air import speed_at, stretched
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.shoebox import FittedRoom
from inverse.rows.fitset import FitSet
from inverse.stored import room_arrays, room_from
from rir import GainPattern, Poses
from rir.arrays import FloatArray
from rir.errors import DatasetError
from rir.physics import speed_of_sound
from rir.schema import Schema

__all__ = ["FOUND_ROOM", "Acoustics"]

FOUND_ROOM = Schema("found room", 1)


@dataclass(frozen=True, eq=False)
class Acoustics:
    """Hold a fitted room or, without one, rows to answer from.

    Parameters
    ----------
    fitted : FittedRoom, FittedMesh or None
        The room, a box or one of flat faces; a box without walls where only direct
        sounds are sure, None where not even they are.
    rows : NearestRows or None
        Held only where nothing is fitted.
    blend : Blend or None
        What fills in for the paths; None where they explain all.
    unexplained : float
        Part of the energy of the fitted rows that paths do not predict.
    alarms : list of str
        What a person should know.
    recording : dict
        What was found of recording blocks, the listener and the places of rows.
    """

    fitted: FittedRoom | FittedMesh | None
    rows: NearestRows | None
    blend: Blend | None
    unexplained: float
    alarms: list[str] = field(default_factory=list)
    recording: dict[str, Any] = field(default_factory=dict)

    def predict(self, emitters: Poses, listeners: Poses, n_samples: int) -> FloatArray:
        """Return responses, shape (queries, n_samples)."""
        if self.fitted is not None:
            early = self.fitted.predict(emitters, listeners, n_samples)
        elif self.rows is not None:
            early = self.rows.predict(emitters, listeners, n_samples)
        else:
            early = np.zeros((len(emitters), n_samples))
        if self.blend is None:
            return early
        return self.blend.apply(early, emitters, listeners)

    def left_out(self, rows: FitSet, among: FitSet) -> FloatArray:
        """Return answers to measured rows without those of the same emitter place.

        Parameters
        ----------
        rows : FitSet
            Rows asked for, shape of the result (rows, n_samples).
        among : FitSet
            All measured rows; interpolated where neither room nor rows are held.
        """
        if self.rows is not None:
            return self.rows.left_out(rows)
        if self.fitted is None or self.blend is None:
            return AlignedRows.of(among).left_out(rows)
        early = self.fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
        return self.blend.left_out(early, rows)

    def at_temperature(
        self,
        answer: FloatArray,
        temperature_c: float,
        sample_rate: float,
        stated_speed: float,
    ) -> FloatArray:
        """Return an answer as it arrives in colder or warmer air.

        Answers are for the mean of the logged temperatures; where none was, for the
        speed of sound as it was fitted, or without a room for the stated one.
        """
        speed, latency_s = stated_speed, 0.0
        if self.fitted is not None:
            room = self.fitted.room
            speed, latency_s = float(room.speed_of_sound), float(room.latency_s)
        if "temperature_c" in self.recording:
            speed = speed_of_sound(self.recording["temperature_c"])
        return stretched(
            answer, speed / speed_at(temperature_c), latency_s * sample_rate
        )

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern, with a mean gain of 1 over directions."""
        if self.fitted is None:
            return GainPattern.omni()
        row = self.fitted.room.emitting
        level = row[0] / np.sqrt(4 * np.pi)
        return GainPattern(row[None] / level, np.array([1000.0]))

    def report(self) -> dict[str, Any]:
        """Return what was found, in plain values."""
        report = {"alarms": list(self.alarms), "unexplained": float(self.unexplained)}
        report |= self.recording
        if self.blend is not None:
            report["held_out"] = self.blend.proof.scores
        if self.fitted is None:
            return report | {"walls": 0}
        if isinstance(self.fitted, FittedMesh):
            return report | self.fitted.report()
        room, spread = self.fitted.room, self.fitted.spreads()
        heard, found = room.box.found, FoundObjects.of(bands_of(self.fitted))
        return report | {
            "walls": int(heard.sum()),
            "planes": room.box.planes[heard].tolist(),
            "plane_sd_m": self.fitted.wall_sd()[heard].tolist(),
            "reflection": room.walls[heard].tolist(),
            "reflection_sd": spread[11:17][heard].tolist(),
            "speed_of_sound": float(room.speed_of_sound),
            "speed_of_sound_sd": float(spread[9]),
            "latency_s": float(room.latency_s),
            "sd": self.fitted.family_sd(),
            **({"furnishing": found.as_dict()} if found else {}),
        }

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        arrays: dict[str, np.ndarray] = {
            "unexplained": np.array(self.unexplained),
            "told": np.array(self.alarms, dtype=str),
            "recording": np.array(json.dumps(self.recording)),
        }
        if isinstance(self.fitted, FittedMesh):
            arrays |= prefixed("mesh", self.fitted.as_arrays())
        elif self.fitted is not None:
            arrays |= prefixed("room", room_arrays(self.fitted))
        if self.rows is not None:
            arrays |= prefixed("rows", vars(self.rows))
        if self.blend is not None:
            arrays |= prefixed("rest", self.blend.as_arrays())
        return {name: np.asarray(value) for name, value in arrays.items()}

    def save(self, path: Path) -> Path:
        """Write everything to a file that :meth:`load` opens; return its path."""
        arrays: dict[str, Any] = FOUND_ROOM.stamp | self.as_arrays()
        np.savez(path, **arrays)
        return path

    @classmethod
    def load(cls, path: str | Path) -> "Acoustics":
        """Open a room that :meth:`save` wrote.

        Raises
        ------
        DatasetError
            If the file is none, or of a newer program.
        """
        try:
            with np.load(path, allow_pickle=False) as stored:
                arrays = dict(stored)
        except (OSError, ValueError, AttributeError) as error:
            raise DatasetError(f"{path} is no {FOUND_ROOM.kind}: {error}") from error
        return cls.from_arrays(FOUND_ROOM.open(arrays, path))

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Acoustics":
        """Rebuild what :meth:`as_arrays` returned."""
        room, rows = part_of(arrays, "room"), part_of(arrays, "rows")
        blend = part_of(arrays, "rest")
        nearest = None
        if rows:
            rows["samples_a_metre"] = float(rows["samples_a_metre"])  # type: ignore
            rows["retimed"] = bool(rows.get("retimed", True))  # type: ignore
            nearest = NearestRows(**rows)  # type: ignore
        mesh = part_of(arrays, "mesh")
        fitted = room_from(room) if room else None
        return cls(
            FittedMesh.from_arrays(mesh) if mesh else fitted,
            nearest,
            Blend.from_arrays(blend) if blend else None,
            float(arrays["unexplained"]),
            [str(one) for one in arrays["told"]],
            json.loads(str(arrays.get("recording", "{}"))),
        )
