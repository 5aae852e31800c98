"""The effects a scene may call for, one file each.

The order of the table is the order in which effects are applied.
"""

from collections.abc import Iterator

from rir import Registry
from rooms.effects.air import AIR
from rooms.effects.diffraction import DIFFRACTION
from rooms.effects.direct import DIRECT
from rooms.effects.effect import Effect, Need, Tolerance
from rooms.effects.furniture import FURNITURE
from rooms.effects.hardware import HARDWARE
from rooms.effects.late import LATE
from rooms.effects.modes import MODES
from rooms.effects.panels import PANELS
from rooms.effects.patterns import PATTERNS
from rooms.effects.scattering import SCATTERING
from rooms.effects.seats import SEATS
from rooms.effects.specular import SPECULAR
from rooms.effects.transmission import TRANSMISSION
from rooms.effects.walls import WALLS

__all__ = ["EFFECTS", "Effect", "Need", "Tolerance"]

_ORDER = (
    FURNITURE,
    PATTERNS,
    WALLS,
    SCATTERING,
    SEATS,
    PANELS,
    AIR,
    DIRECT,
    SPECULAR,
    DIFFRACTION,
    TRANSMISSION,
    LATE,
    MODES,
    HARDWARE,
)


class EffectTable(Registry[Effect]):
    """The effects in the order in which they are applied.

    Ours stand as they were entered, those of other packages right after the effect
    that they name.
    """

    def __iter__(self) -> Iterator[str]:
        names = list(super().__iter__())
        order = [name for name in names if not self[name].after]
        waiting = [name for name in names if self[name].after]
        while waiting:
            # Where nothing of that name is, the end must do.
            near = [name for name in waiting if self[name].after in order] or waiting
            after = self[near[-1]].after
            place = order.index(after) + 1 if after in order else len(order)
            order.insert(place, near[-1])
            waiting.remove(near[-1])
        return iter(order)


EFFECTS = EffectTable("effect", "resounding.effects", Effect)
for _effect in _ORDER:
    EFFECTS.add(_effect.name)(_effect)
