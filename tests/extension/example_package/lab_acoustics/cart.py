"""A rig: a cart that rolls slowly, simulated."""

from typing import Any, Literal

from rigs.kinds.settings import EnvelopeConfig
from rigs.kinds.simulated import SimulatedRig
from rigs.rig import RigKind, Surroundings
from rir.config import StrictModel


class Cart(SimulatedRig):
    """Roll to any pose inside an envelope."""

    def describe(self) -> dict[str, Any]:
        """Return the name, kind and speed."""
        return super().describe() | {"kind": "cart"}


class CartConfig(StrictModel):
    """The part of a rig file that describes a cart."""

    kind: Literal["cart"] = "cart"
    envelope: EnvelopeConfig
    speed_m_per_s: float = 0.1

    @property
    def simulated(self) -> bool:
        """Whether nothing real moves."""
        return True


def build(config: CartConfig, around: Surroundings) -> Cart:
    """Make the cart."""
    return Cart(
        around.on_pose,
        envelope=config.envelope.envelope(),
        clock=around.clock,
        speed=config.speed_m_per_s,
        name="cart",
    )


CART = RigKind("rolls a cart, slowly", CartConfig, build)
