"""The plan of a simulated data set: which emitters, which listeners, which patterns."""

from dataclasses import dataclass, replace

import numpy as np

from rir import GainPattern, Poses
from rir.errors import ConfigError
from rooms.batches import Batch, batches
from rooms.places import grid_places, random_places
from rooms.scene import Scene

__all__ = ["Layout", "paper_layout", "with_gains"]


@dataclass(frozen=True, eq=False)
class Layout:
    """Emitters, listeners and patterns of a data set.

    Parameters
    ----------
    emitters, listeners : Poses
        Every emitter sounds to every listener.
    training : int
        So many emitters come first and are for training; the rest are unseen.
    emitter_gain, listener_gain : GainPattern
        Patterns of the devices.
    """

    emitters: Poses
    listeners: Poses
    training: int
    emitter_gain: GainPattern
    listener_gain: GainPattern

    def __len__(self) -> int:
        return len(self.emitters) * len(self.listeners)

    def blocks(self) -> list[Batch]:
        """Return the work, in the parts that are computed, stored and resumed."""
        return batches(len(self.emitters), len(self.listeners))


def paper_layout(
    scene: Scene,
    *,
    emitters: int = 5,
    unseen: int = 10,
    listeners: int = 5000,
    gains: str = "same",
    fewer: int = 1,
    seed: int = 0,
) -> Layout:
    """Return the layout of the reference paper for a scene.

    Parameters
    ----------
    scene : Scene
        The room.
    emitters, unseen : int
        Emitters for training, and further ones for testing only.
    listeners : int
        Listeners on a grid 1.2 m above the floor, about so many.
    gains : {"same", "diff"}
        Both devices omnidirectional; or a cardioid emitter and an omnidirectional
        listener.
    fewer : int
        Keep every so-many-th listener: 10 for the small variant. Emitters stay.
    seed : int
        Key of the emitters' places.

    Raises
    ------
    ConfigError
        If a count is not positive or the kind of gains is unknown.
    """
    if fewer < 1:
        raise ConfigError(
            f"every n-th listener can be kept from n = 1 on, not n = {fewer}"
        )
    if min(emitters + unseen, listeners) < 1 or min(emitters, unseen) < 0:
        raise ConfigError("a data set needs at least one emitter and one listener")
    if gains not in ("same", "diff"):
        raise ConfigError(f"gains are 'same' or 'diff', not {gains!r}")
    rng = np.random.default_rng(seed)
    places = random_places(scene, emitters + unseen, rng)
    grid = grid_places(scene, listeners)
    omni = GainPattern.omni()
    emitting = GainPattern.cardioid() if gains == "diff" else omni
    return Layout(places, grid[::fewer], emitters, emitting, omni)


def with_gains(scene: Scene, layout: Layout) -> Scene:
    """Return the scene with the layout's patterns."""
    return replace(
        scene, emitter_gain=layout.emitter_gain, listener_gain=layout.listener_gain
    )
