"""Motion: when an emitter moves too fast to be taken as standing still.

The effect judges; what a moving emitter sounds like is rendered from a list of
poses by `rooms.motion.render_moving`.
"""

from rooms.effects.effect import Effect, Need, Tolerance
from rooms.scene import Scene
from rooms.sound import Budget, Sound

__all__ = ["MOTION"]


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by the way moved during a response against the shortest wave."""
    del tolerance
    speed = scene.emitter_speed
    if speed == 0:
        return Need(False, "the emitter stands still")
    way = 2 * speed * budget.duration
    wave = scene.speed_of_sound / (0.4 * budget.sample_rate)
    why = f"{1000 * way:.1f} mm within a response, waves from {1000 * wave:.1f} mm"
    return Need(way > wave / 8, f"{why}: render a list of poses")


def apply(scene: Scene, sound: Sound) -> None:
    """Do nothing to a single response: it is that of the instant of emission."""
    del scene, sound


MOTION = Effect("motion", "moving emitters (rooms.motion)", needed, apply)
