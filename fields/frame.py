"""What a field must know of the room it was trained in."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fields.shape import Shape
from rir import GainPattern, RoomSpec


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """Hold the box, the time axis and the scale a field lives in.

    Parameters
    ----------
    low, high : numpy.ndarray
        Corners of the box that holds both ends of every training row, shape
        (3,), metres.
    sample_rate : float
        Hertz.
    n_samples : int
        Length of one response; sample 0 is the instant of emission.
    speed_of_sound : float
        Metres per second.
    scale : float
        Stored responses are divided by it in training and multiplied in
        ``predict``, so that a direct sound is about 1/distance inside.
    surface_points : numpy.ndarray
        Points on the surfaces of the scene, shape (points, 3), metres.
    simulated : bool
        Whether the training responses came from a simulation.
    room : RoomSpec or None
        The room's description when the data set carries one.
    emitter_gain, listener_gain : GainPattern or None
        Known patterns of the devices, None when unknown.
    shape : Shape or None
        Surfaces of the room where they are known and it is no box.
    """

    low: np.ndarray
    high: np.ndarray
    sample_rate: float
    n_samples: int
    speed_of_sound: float
    scale: float
    surface_points: np.ndarray
    simulated: bool
    room: RoomSpec | None = None
    emitter_gain: GainPattern | None = None
    listener_gain: GainPattern | None = None
    shape: Shape | None = None

    @property
    def center(self) -> np.ndarray:
        """Middle of the box, shape (3,), metres."""
        return 0.5 * (self.low + self.high)

    @property
    def reach(self) -> float:
        """Half of the box's longest edge, metres; never zero."""
        return max(0.5 * float(np.max(self.high - self.low)), 0.1)

    @property
    def mark(self) -> str:
        """SIMULATED or MEASURED."""
        return "SIMULATED" if self.simulated else "MEASURED"

    def as_dict(self) -> dict[str, Any]:
        """Return plain lists and numbers, for a file."""
        return {
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "sample_rate": float(self.sample_rate),
            "n_samples": int(self.n_samples),
            "speed_of_sound": float(self.speed_of_sound),
            "scale": float(self.scale),
            "surface_points": self.surface_points.tolist(),
            "simulated": bool(self.simulated),
            "room": self.room.model_dump(mode="json") if self.room else None,
            "emitter_gain": _pattern_dict(self.emitter_gain),
            "listener_gain": _pattern_dict(self.listener_gain),
            "shape": self.shape.as_dict() if self.shape else None,
        }

    @classmethod
    def from_dict(cls, plain: dict[str, Any]) -> "SceneFrame":
        """Rebuild a frame from what :meth:`as_dict` wrote."""
        room = plain["room"]
        return cls(
            low=np.array(plain["low"], dtype=np.float64),
            high=np.array(plain["high"], dtype=np.float64),
            sample_rate=plain["sample_rate"],
            n_samples=plain["n_samples"],
            speed_of_sound=plain["speed_of_sound"],
            scale=plain["scale"],
            surface_points=np.array(plain["surface_points"], dtype=np.float64),
            simulated=plain["simulated"],
            room=RoomSpec.model_validate(room) if room else None,
            emitter_gain=_pattern(plain["emitter_gain"]),
            listener_gain=_pattern(plain["listener_gain"]),
            shape=Shape.from_dict(plain.get("shape")),
        )


def _pattern_dict(pattern: GainPattern | None) -> dict[str, Any] | None:
    if pattern is None:
        return None
    return {
        "coefficients": np.asarray(pattern.coefficients).tolist(),
        "bands": np.asarray(pattern.bands).tolist(),
    }


def _pattern(plain: dict[str, Any] | None) -> GainPattern | None:
    if plain is None:
        return None
    return GainPattern(np.array(plain["coefficients"]), np.array(plain["bands"]))
