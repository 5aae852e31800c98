"""Walls of layers in front of a rigid backing, by transfer matrices.

A wave of lateral wavenumber k sin θ crosses each layer; from the backing to the front,
each layer turns the admittance behind it into the one before it (J. Allard, N. Atalla,
Propagation of Sound in Porous Media, 2nd ed. 2009, chapter 2; T. Cox, P. D'Antonio,
Acoustic Absorbers and Diffusers, 3rd ed. 2017, chapters 6 and 7).
"""

from typing import Annotated, Literal, Protocol, Self

import numpy as np
from pydantic import Field, model_validator

from rir.arrays import ComplexArray, FloatArray
from rir.config import StrictModel
from rir.physics import (
    AIR_DENSITY,
    AIR_VISCOSITY,
    REFERENCE_TEMPERATURE_C,
    speed_of_sound,
)

__all__ = ["AirGap", "Layer", "LayeredWall", "Panel", "Perforated", "Porous"]

_SPEED = speed_of_sound(REFERENCE_TEMPERATURE_C)
_CHARACTERISTIC = AIR_DENSITY * _SPEED

_Thickness = Annotated[float, Field(gt=0.0, le=10.0)]


class Layer(Protocol):
    """One layer of a wall."""

    def admittance_before(
        self, behind: ComplexArray, frequencies: FloatArray, sine: FloatArray
    ) -> ComplexArray:
        """Return the specific admittance in front of the layer.

        Parameters
        ----------
        behind : ndarray
            Specific admittance behind it.
        frequencies : ndarray
            Frequencies [Hz].
        sine : ndarray
            Sine of the angle of incidence in the air.
        """
        ...


def _through_fluid(
    behind: ComplexArray,
    medium: tuple[ComplexArray, ComplexArray],
    thickness: float,
    wave: tuple[FloatArray, FloatArray],
) -> ComplexArray:
    """Return the admittance before a fluid of given impedance and wavenumber."""
    impedance, ratio = medium
    frequencies, sine = wave
    across = np.sqrt(ratio**2 - sine**2 + 0j)
    # of both roots the one that dies out in depth
    across = np.where(np.imag(across) > 0, -across, across)
    own = np.where(np.abs(across) > 0, across, 1e-12) / (ratio * impedance)
    turn = np.tan(2 * np.pi * frequencies / _SPEED * across * thickness)
    return own * (behind + 1j * own * turn) / (own + 1j * behind * turn)


class Porous(StrictModel):
    """A porous absorber: a fluid of complex impedance and wavenumber.

    Miki's law, or that of Delany and Bazley, which were fitted to fibrous materials
    where frequency over flow resistivity is .01 to 1 m³/kg; Miki's remains physical
    below.

    References
    ----------
    Y. Miki, J. Acoust. Soc. Jpn. (E) 11, 19 (1990), equations 29 to 32; M. E. Delany,
    E. N. Bazley, Appl. Acoust. 3, 105 (1970).
    """

    thickness_m: _Thickness
    flow_resistivity_pa_s_m2: Annotated[float, Field(ge=100.0, le=1e7)]
    law: Literal["miki", "delany_bazley"] = "miki"

    def medium(self, frequencies: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return impedance and wavenumber, both relative to those of air."""
        # at 0 Hz the laws have no limit
        x = np.maximum(frequencies, 1.0) / self.flow_resistivity_pa_s_m2
        if self.law == "miki":
            impedance = 1 + (0.070 - 0.107j) * x**-0.632
            ratio = 1 + (0.109 - 0.160j) * x**-0.618
        else:
            impedance = 1 + 0.0497 * x**-0.754 - 0.0758j * x**-0.732
            ratio = 1 + 0.0858 * x**-0.700 - 0.169j * x**-0.595
        return np.asarray(impedance, complex), np.asarray(ratio, complex)

    def admittance_before(
        self, behind: ComplexArray, frequencies: FloatArray, sine: FloatArray
    ) -> ComplexArray:
        """Return the admittance in front of the layer."""
        wave = frequencies, sine
        return _through_fluid(behind, self.medium(frequencies), self.thickness_m, wave)


class AirGap(StrictModel):
    """A gap of air."""

    thickness_m: _Thickness

    def admittance_before(
        self, behind: ComplexArray, frequencies: FloatArray, sine: FloatArray
    ) -> ComplexArray:
        """Return the admittance in front of the gap."""
        one = np.ones(np.shape(frequencies), complex)
        wave = frequencies, sine
        return _through_fluid(behind, (one, one), self.thickness_m, wave)


class Panel(StrictModel):
    """A limp panel or membrane: a mass, and what its edges and inside lose.

    Over a gap, mass and air make a resonance. Bending waves are left out: they matter
    above the coincidence frequency, where such panels absorb little.
    """

    mass_kg_m2: Annotated[float, Field(gt=0.0, le=1000.0)]
    resistance_pa_s_m: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0

    def admittance_before(
        self, behind: ComplexArray, frequencies: FloatArray, sine: FloatArray
    ) -> ComplexArray:
        """Return the admittance in front of the panel."""
        del sine
        own = self.resistance_pa_s_m + 2j * np.pi * frequencies * self.mass_kg_m2
        return behind / (1 + behind * own / _CHARACTERISTIC)


class Perforated(StrictModel):
    """A sheet with round holes, wide or micro-perforated.

    Air in a hole rubs at its wall and at both mouths, and moves with more air before
    them, less where neighbouring holes share it.

    References
    ----------
    D.-Y. Maa, JASA 104, 2861 (1998), equations 3 to 5, with the exact Bessel form;
    mutual mass of holes: Cox & D'Antonio, 1 - 1.47 √s + .47 √s³.
    """

    thickness_m: Annotated[float, Field(gt=0.0, le=0.5)]
    hole_diameter_m: Annotated[float, Field(gt=0.0, le=0.2)]
    open_share: Annotated[float, Field(gt=0.0, lt=0.9)]

    def impedance(self, frequencies: FloatArray) -> ComplexArray:
        """Return the specific impedance of the sheet alone."""
        from scipy.special import jve

        turn = 2 * np.pi * np.maximum(frequencies, 1e-3)
        width = self.hole_diameter_m
        # radius over the thickness of the viscous layer
        x = np.sqrt(-1j * turn * AIR_DENSITY / AIR_VISCOSITY) * width / 2
        slip = 2 * jve(1, x) / (x * jve(0, x))
        inside = 1j * turn * AIR_DENSITY * self.thickness_m / (1 - slip)
        rubbed = np.sqrt(2 * turn * AIR_DENSITY * AIR_VISCOSITY) / 2
        root = np.sqrt(self.open_share)
        shared = 1 - 1.47 * root + 0.47 * root**3
        mouths = 1j * turn * AIR_DENSITY * 8 / (3 * np.pi) * width * shared
        return (inside + rubbed + mouths) / (self.open_share * _CHARACTERISTIC)

    def admittance_before(
        self, behind: ComplexArray, frequencies: FloatArray, sine: FloatArray
    ) -> ComplexArray:
        """Return the admittance in front of the sheet."""
        del sine
        return behind / (1 + behind * self.impedance(frequencies))


class OneLayer(StrictModel):
    """A layer in a list, under the name of its kind: ``{air_gap: {…}}``."""

    porous: Porous | None = None
    air_gap: AirGap | None = None
    panel: Panel | None = None
    perforated: Perforated | None = None

    @model_validator(mode="after")
    def _single(self) -> Self:
        if len(self._given) != 1:
            known = ", ".join(OneLayer.model_fields)
            raise ValueError(f"a layer is one of {known}; got {len(self._given)}")
        return self

    @property
    def _given(self) -> list[Layer]:
        parts = (self.porous, self.air_gap, self.panel, self.perforated)
        return [part for part in parts if part is not None]

    @property
    def layer(self) -> Layer:
        """The layer itself."""
        return self._given[0]


class LayeredWall(StrictModel):
    """Layers from the room to the backing.

    Where `locally_reacting`, sound crosses the layers straight at any angle, as it does
    between the cells of a honeycomb; otherwise it goes on sideways (bulk reaction).
    Behind a backing of "air" lies another room, and what enters it is lost.

    Examples
    --------
    >>> wool = {"porous": {"thickness_m": 0.05, "flow_resistivity_pa_s_m2": 10000}}
    >>> wall = LayeredWall(layers=[wool, {"air_gap": {"thickness_m": 0.1}}])
    >>> wall.admittance(np.array([500.0]), np.array([1.0])).round(2).tolist()
    [(0.92+0.07j)]
    """

    layers: Annotated[tuple[OneLayer, ...], Field(min_length=1)]
    locally_reacting: bool = False
    backing: Literal["rigid", "air"] = "rigid"

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the admittance at frequencies [Hz] and cosines of incidence."""
        shape = np.broadcast_shapes(np.shape(frequencies), np.shape(cosines))
        sine = np.sqrt(np.maximum(1 - cosines**2, 0.0))
        if self.locally_reacting:
            sine = np.zeros_like(sine)
        found = np.zeros(np.shape(sine), complex)
        if self.backing == "air":
            found += np.sqrt(1 - sine**2)
        # 0 Hz is a limit that no layer reaches
        f = np.maximum(frequencies, 1e-3)
        for one in reversed(self.layers):
            found = one.layer.admittance_before(found, f, sine)
        found = np.broadcast_to(found, shape)
        # rounding may leave a hair of a source
        return np.maximum(np.real(found), 0.0) + 1j * np.imag(found)
