"""Rigs whose axes belong to several controllers: a gantry with a turntable on it."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rigs.controller import Controller
from rigs.kinds.grbl import GrblPart
from rigs.kinds.marlin import MarlinPart
from rigs.kinds.part import Truth
from rigs.kinds.settings import MachineConfig
from rigs.kinds.turntable import TurntablePart
from rigs.machine import MachineRig
from rigs.rig import RIGS, RigKind, Surroundings

AnyPart = Annotated[GrblPart | MarlinPart | TurntablePart, Field(discriminator="kind")]


class CompositeConfig(MachineConfig):
    """The part of a rig file that describes a rig of several controllers."""

    kind: Literal["composite"] = "composite"
    parts: tuple[AnyPart, ...] = Field(min_length=1)

    @property
    def simulated(self) -> bool:
        """Whether all parts are simulated."""
        return all(part.simulated for part in self.parts)

    @model_validator(mode="after")
    def _axes_once(self) -> "CompositeConfig":
        axes = [axis for part in self.parts for axis in part.axes]
        twice = sorted({axis for axis in axes if axes.count(axis) > 1})
        if twice:
            raise ValueError(f"two parts move {', '.join(twice)}; each axis once")
        return self


def _build(config: CompositeConfig, around: Surroundings) -> MachineRig:
    drivers: list[Controller] = []
    truths: list[Truth] = []
    for part in config.parts:
        driver, truth = part.controller(around)
        drivers.append(driver)
        truths += [truth] if truth else []

    def all_truth() -> dict[str, float]:
        return {axis: value for truth in truths for axis, value in truth().items()}

    envelope = config.envelope.envelope()
    told = all_truth if len(truths) == len(drivers) else None
    return MachineRig(
        config.name, "composite", drivers, envelope, config.mount(), around, told
    )


RIGS.add("composite")(
    RigKind("axes of several controllers as one", CompositeConfig, _build)
)
