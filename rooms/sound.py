"""What travels from an emitter to listeners, gathered until it is rendered.

Effects describe; nothing is computed sample by sample before `rooms.synthesis`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import GainPattern, Pose, Poses
from rir.arrays import FloatArray
from rooms.scene import Scene

__all__ = ["Arrivals", "Budget", "Lattice", "Sound", "Waves"]


@dataclass(frozen=True)
class Budget:
    """How much work may be spent, and how long the response is."""

    sample_rate: int
    """Samples per second [Hz]."""
    n_samples: int
    """Length of the response."""
    max_order: int | None = None
    """Highest reflection order; None follows every image inside the response."""
    rays: int | None = None
    """Rays per trace; None lets the planner choose."""
    seed: int = 0
    """Key of everything random: equal seeds give equal responses."""

    @property
    def duration(self) -> float:
        """Length of the response [s]."""
        return self.n_samples / self.sample_rate


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Wavefronts that reach the listeners, as a struct of arrays.

    Parameters
    ----------
    listener : ndarray, shape (n,)
        Number of the listener each one reaches.
    delay : ndarray, shape (n,)
        Time of flight [s].
    gain : ndarray, shape (n, bands)
        Amplitude, patterns and air left out.
    departure, arrival : ndarray, shape (n, 3)
        Unit vectors out of the emitter, and from the listener to where it comes from.
    order : ndarray, shape (n,)
        Number of reflections.
    """

    listener: NDArray[np.int64]
    delay: FloatArray
    gain: FloatArray
    departure: FloatArray
    arrival: FloatArray
    order: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Lattice:
    """All images of a shoebox up to an order and a time, without listing them."""

    size: FloatArray
    """Lengths of the box [m]. Shape (3,)."""
    reflection: FloatArray
    """Amplitude reflection factors of the walls. Shape (6, bands)."""
    max_order: int
    """Highest reflection order."""
    until: float
    """Latest arrival [s]."""

    @property
    def farthest(self) -> float:
        """Distance [m] that no image within the order exceeds."""
        return (self.max_order + 1) * float(self.size.max()) + float(self.size.sum())


@dataclass(frozen=True, eq=False)
class Waves:
    """Random plane waves that stand for what no path describes singly.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Arrival for an emitter and a listener in the middle of the room [s].
    one, other : ndarray, shape (n, 3)
        Directions: each wave leaves along `one` and arrives from `other`, and has
        a twin that leaves along `other` and arrives from `one`.
    sign : ndarray, shape (n,)
        +1 or -1.
    amplitude : ndarray, shape (1 or listeners, steps, bands)
        Amplitude of one wave as a function of its arrival.
    step : float
        Spacing of `amplitude` [s].
    center : ndarray, shape (3,)
        Middle of the room [m].
    """

    time: FloatArray
    one: FloatArray
    other: FloatArray
    sign: FloatArray
    amplitude: FloatArray
    step: float
    center: FloatArray


@dataclass(eq=False)
class Sound:
    """Everything between one emitter and its listeners.

    Effects fill it in; `rooms.synthesis.render` turns it into samples. Mirror paths
    up to `listed_order` are in it one by one (0 the direct sound, -1 none), so what
    is traced leaves those out.
    """

    scene: Scene
    emitter: Pose
    listeners: Poses
    budget: Budget
    patterns: tuple[GainPattern, GainPattern] | None = None
    scattering: FloatArray | None = None
    air_loss: FloatArray | None = None
    lattice: Lattice | None = None
    waves: Waves | None = None
    arrivals: list[Arrivals] = field(default_factory=list)
    listed_order: int = -1
    traced: Any = None
    finishers: list[Callable[[FloatArray], FloatArray]] = field(default_factory=list)

    @property
    def reflection(self) -> FloatArray:
        """Specular amplitude reflection per surface and band: what is left over.

        Energy splits at a bounce into absorbed, scattered and specular shares
        (ISO 17497-1): the specular share is (1 - absorption)(1 - scattering).
        """
        kept = 1.0 - self.scene.absorption
        if self.scattering is not None:
            kept = kept * (1.0 - self.scattering)
        return np.sqrt(kept)
