"""The effects a scene may call for, one file each.

The order of the table is the order in which effects are applied.
"""

from rir import Registry
from rooms.effects.air import AIR
from rooms.effects.diffraction import DIFFRACTION
from rooms.effects.direct import DIRECT
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.effects.hardware import HARDWARE
from rooms.effects.late import LATE
from rooms.effects.modes import MODES
from rooms.effects.motion import MOTION
from rooms.effects.patterns import PATTERNS
from rooms.effects.scattering import SCATTERING
from rooms.effects.specular import SPECULAR
from rooms.effects.transmission import TRANSMISSION

__all__ = ["EFFECTS", "Effect", "Tolerance", "Verdict"]

_ORDER = (
    PATTERNS,
    SCATTERING,
    AIR,
    DIRECT,
    SPECULAR,
    DIFFRACTION,
    TRANSMISSION,
    LATE,
    MODES,
    MOTION,
    HARDWARE,
)

EFFECTS: Registry[Effect] = Registry("effect")
for _effect in _ORDER:
    EFFECTS.add(_effect.name)(_effect)
