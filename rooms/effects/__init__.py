"""The effects a scene may call for, one file each.

The order of the table is the order in which effects are applied.
"""

from rir import Registry
from rooms.effects.air import AIR
from rooms.effects.direct import DIRECT
from rooms.effects.effect import Effect, Tolerance, Verdict
from rooms.effects.late import LATE
from rooms.effects.patterns import PATTERNS
from rooms.effects.scattering import SCATTERING
from rooms.effects.specular import SPECULAR

__all__ = ["EFFECTS", "Effect", "Tolerance", "Verdict"]

EFFECTS: Registry[Effect] = Registry("effect")
for _effect in (PATTERNS, SCATTERING, AIR, DIRECT, SPECULAR, LATE):
    EFFECTS.add(_effect.name)(_effect)
