"""The one room that simulated rigs and simulated interfaces are views of."""

from dataclasses import replace
from typing import Any

import numpy as np

from rir import GainPattern, Pose, Poses, RoomSpec
from rir.arrays import FloatArray
from rir.errors import DatasetError, SceneError
from rooms.plan import plan_effects
from rooms.request import make_budget
from rooms.scene import Scene
from rooms.simulation import exchanged, run_plan
from rooms.sound import Sound

__all__ = ["MeasuredWorld", "World"]


_EFFECTS = ("patterns", "scattering", "air", "direct", "specular", "late")
"""A box needs these and no others; none is left off, however small."""


class _Places:
    """Where the devices of a world stand."""

    def __init__(self) -> None:
        self.emitter: Pose | None = None
        self.listeners: list[Pose] = []

    def place_emitter(self, pose: Pose) -> None:
        """Put the emitter at a pose."""
        self.emitter = pose

    def place_listener(self, pose: Pose, index: int = 0) -> None:
        """Put one listener at a pose; a new index adds a listener."""
        if index > len(self.listeners):
            raise SceneError(
                f"listener {index} cannot be placed before listener"
                f" {len(self.listeners)}"
            )
        self.listeners[index : index + 1] = [pose]

    def _ends(self, emitter: Pose | None, listener: Pose | None) -> tuple[Pose, Pose]:
        emitter = emitter or self.emitter
        listener = listener or (self.listeners[0] if self.listeners else None)
        if emitter is None or listener is None:
            raise SceneError("place an emitter and a listener first")
        return emitter, listener


class World(_Places):
    """A simulated room with one emitter and any number of listeners in it.

    Parameters
    ----------
    room : RoomSpec
        Size, surfaces and air. Devices keep out of its furniture, which is not
        simulated: a world answers pair by pair, and its walls stand for all.
    sample_rate : int
        Samples per second [Hz].
    duration : float
        Length of the responses [s].
    emitter_gain, listener_gain : GainPattern, optional
        Omnidirectional when left out.
    temperature_c : float, optional
        Air temperature [°C]; the room's own when left out.
    seed : int
        Key of the late tail: equal seeds give equal responses.

    Notes
    -----
    Exchanging the two ends, patterns included, gives the same samples to the last
    bit: the response is always computed for the pair in one fixed order.

    Examples
    --------
    >>> walls = {"all": {"absorption": 1}}
    >>> room = RoomSpec(name="box", size_m=(6, 5, 3), surfaces=walls)
    >>> world = World(room, sample_rate=8000, duration=0.05)
    >>> world.place_emitter(Pose.at(1, 1, 1)), world.place_listener(Pose.at(4, 4, 1))
    (None, None)
    >>> world.response().shape
    (400,)
    """

    simulated = True

    def __init__(
        self,
        room: RoomSpec,
        *,
        sample_rate: int,
        duration: float,
        emitter_gain: GainPattern | None = None,
        listener_gain: GainPattern | None = None,
        temperature_c: float | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__()
        self.room = room
        self.budget = make_budget(sample_rate, duration, None, None, seed)
        self.scene = Scene.from_room(
            room,
            emitter_gain=emitter_gain or GainPattern.omni(),
            listener_gain=listener_gain or GainPattern.omni(),
        )
        self.set_air(temperature_c=temperature_c)
        self.plan = plan_effects(
            self.scene, sample_rate=sample_rate, duration=duration, only=_EFFECTS
        )

    @property
    def sample_rate(self) -> int:
        """Samples per second [Hz]."""
        return self.budget.sample_rate

    @property
    def n_samples(self) -> int:
        """Length of the responses."""
        return self.budget.n_samples

    @property
    def emitter_gain(self) -> GainPattern:
        """Pattern of the emitter."""
        return self.scene.emitter_gain

    @property
    def listener_gain(self) -> GainPattern:
        """Pattern of the listeners."""
        return self.scene.listener_gain

    @property
    def temperature_c(self) -> float:
        """Air temperature [°C]."""
        return self.scene.air.temperature_c

    @property
    def humidity_percent(self) -> float:
        """Relative humidity [%]."""
        return self.scene.air.humidity_percent

    def set_air(
        self, temperature_c: float | None = None, humidity_percent: float | None = None
    ) -> None:
        """Change the air; what is left out stays as it is."""
        air = self.scene.air.model_dump()
        if temperature_c is not None:
            air["temperature_c"] = temperature_c
        if humidity_percent is not None:
            air["humidity_percent"] = humidity_percent
        changed = type(self.scene.air)(**air)
        if changed != self.scene.air:
            self.scene = replace(self.scene, air=changed)

    def response(
        self, emitter: Pose | None = None, listener: Pose | None = None
    ) -> FloatArray:
        """Return the response between two poses, shape (n_samples,).

        Parameters
        ----------
        emitter, listener : Pose, optional
            Where the ends are; where they were placed when left out.

        Raises
        ------
        SceneError
            If a pose is missing or outside the room.
        """
        ends = self._ends(emitter, listener)
        for what, pose in zip(("emitter", "listener"), ends, strict=True):
            self.scene.check_inside(what, pose.position)
        scene = self.plan.stage(self.scene)
        if _rank(ends[1], scene.listener_gain) < _rank(ends[0], scene.emitter_gain):
            ends = ends[::-1]
            scene = exchanged(scene)
        sound = Sound(scene, ends[0], Poses.of(ends[1]), self.budget)
        return run_plan(scene, self.plan, sound)[0]

    def responses(self) -> FloatArray:
        """Return the responses at all listeners, shape (listeners, n_samples)."""
        if not self.listeners:
            raise SceneError("place a listener first")
        return np.stack([self.response(listener=pose) for pose in self.listeners])


def _rank(pose: Pose, gain: GainPattern) -> tuple[float, ...]:
    """Return a key that puts the two ends of a pair in a fixed order."""
    place = (*pose.position, *pose.orientation)
    return (*map(float, place), *map(float, gain.coefficients.ravel()))


class MeasuredWorld(_Places):
    """A room known from stored responses: what was measured is played back.

    Parameters
    ----------
    dataset : Dataset
        Stored responses with their poses.
    tolerance : float
        Largest distance [m] of each end from a stored pair.

    Raises
    ------
    DatasetError
        When asked for a pair that is not stored.
    """

    def __init__(self, dataset: Any, *, tolerance: float = 0.01) -> None:
        super().__init__()
        self.dataset = dataset
        self.tolerance = tolerance
        self.simulated = bool(dataset.simulated)
        self.sample_rate = int(dataset.sample_rate)
        self.n_samples = int(dataset.n_samples)

    def response(
        self, emitter: Pose | None = None, listener: Pose | None = None
    ) -> FloatArray:
        """Return the stored response of the nearest pair, shape (n_samples,)."""
        row = self._row(*self._ends(emitter, listener))
        return np.asarray(self.dataset.responses[row : row + 1], dtype=float)[0]

    def responses(self) -> FloatArray:
        """Return the responses at all listeners, shape (listeners, n_samples)."""
        if not self.listeners:
            raise SceneError("place a listener first")
        return np.stack([self.response(listener=pose) for pose in self.listeners])

    def _row(self, emitter: Pose, listener: Pose) -> int:
        stored = self.dataset.emitters.positions, self.dataset.listeners.positions
        away = np.maximum(
            np.linalg.norm(stored[0] - emitter.position, axis=1),
            np.linalg.norm(stored[1] - listener.position, axis=1),
        )
        row = int(np.argmin(away))
        if not away[row] <= self.tolerance:
            raise DatasetError(
                f"no stored response from {emitter} to {listener}: the nearest pair is"
                f" {1000 * away[row]:.0f} mm away, {1000 * self.tolerance:.0f} mm are"
                " allowed"
            )
        return row
