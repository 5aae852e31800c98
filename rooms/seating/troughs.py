"""Rows of seats as a plane that sound meets at the tops of their backs.

What lies between two backs is a trough, so many of them to the wavelength that they act
as one locally reacting plane. A trough gives way most where it is a quarter of a
wavelength deep; there, and for an octave or two above, sound that grazes the rows is
turned over by them and cancels itself. The free air below the seats does not count in
the depth: grazing sound runs along in it as it does above, and enters the troughs from
below.

References
----------
T. J. Schultz, B. G. Watters, JASA 36, 885 (1964); G. M. Sessler, J. E. West, JASA 36,
1725 (1964); J. S. Bradley, JASA 90, 324 (1991); W. J. Davies, Y. W. Lam, Appl. Acoust.
41, 1 (1994); D. Takahashi, J. Acoust. Soc. Jpn. (E) 18, 25 (1997).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rir.arrays import ComplexArray, FloatArray
from rir.walls import octave_frequencies, random_incidence
from rooms.walls import spherical_factor

__all__ = ["Troughs", "acting_depth", "over_rows", "troughs_of"]

_FROM_BELOW = 0.75
"""See `acting_depth`."""

_DRAGS = np.geomspace(1.0, 1e5, 161)
"""From hardly any loss to troughs that are solid [1/s], in steps of 7 %."""

_PER_OCTAVE = 12
"""Frequencies in an octave: 48 move the absorption of rows by less than 0.01."""


@dataclass(frozen=True)
class Troughs:
    """A wall of troughs with rigid bottoms, met at their tops."""

    depth: float
    """From top to bottom [m]."""
    centers: tuple[float, ...]
    """Frequencies [Hz] at which the drag is stated."""
    drag: tuple[float, ...]
    """Rate at which upholstery and people slow the air down [1/s]: flow resistivity
    over density. Interpolated over the logarithm of frequency."""
    speed_of_sound: float = 343.0

    @property
    def locally_reacting(self) -> bool:
        """Always: backs part the troughs."""
        return True

    def admittance(self, frequencies: FloatArray, cosines: FloatArray) -> ComplexArray:
        """Return the specific admittance at the tops; the angle does not matter."""
        f, _ = np.broadcast_arrays(np.maximum(frequencies, 1e-3), cosines)
        omega = 2 * np.pi * f
        drag = np.interp(np.log(f), np.log(self.centers), self.drag)
        slowed = np.sqrt(1 - 1j * drag / omega)
        k = omega / self.speed_of_sound
        return np.asarray(1j * np.tan(k * slowed * self.depth) / slowed)


def acting_depth(backs: float, under: float) -> float:
    """Return the depth of closed troughs that act as those between seats do [m].

    Entered from below as strongly as from above, troughs would act as closed in the
    middle; the sound below is weaker, and three quarters are between that and all. On
    a grid of the wave equation (benchmarks/seat_dip.py) dips follow it for 0.15 to
    0.4 m below seats of 0.5 to 0.7 m.

    Parameters
    ----------
    backs : float
        Height of the backs above the floor [m].
    under : float
        Free height below the seats [m]; 0 where nothing passes.
    """
    return _FROM_BELOW * (backs - under) if under > 0 else backs


@lru_cache(maxsize=64)
def troughs_of(
    depth: float,
    absorption: tuple[float, ...],
    centers: tuple[float, ...],
    speed_of_sound: float,
) -> Troughs:
    """Return troughs that absorb as stated of sound from everywhere.

    In each octave the drag is the least with which the stated share is lost; the one of
    the nearest share where none does (no locally reacting plane absorbs more than
    0.951).

    Parameters
    ----------
    depth : float
        Of the troughs [m].
    absorption, centers : tuple of float
        Random-incidence absorption per octave, and the octaves [Hz].
    speed_of_sound : float
        In m/s.
    """
    f = octave_frequencies(centers, _PER_OCTAVE)
    lost = np.array(
        [
            random_incidence(
                Troughs(depth, (1.0,), (float(drag),), speed_of_sound), f
            ).mean(axis=1)
            for drag in _DRAGS
        ]
    )
    enough = lost >= np.array(absorption)
    best = np.where(enough.any(axis=0), enough.argmax(axis=0), lost.argmax(axis=0))
    return Troughs(depth, centers, tuple(_DRAGS[best].tolist()), speed_of_sound)


def over_rows(
    troughs: Troughs,
    frequencies: FloatArray,
    heights: tuple[FloatArray, FloatArray],
    run: FloatArray,
) -> ComplexArray:
    """Return what the tops of rows send back, in units of the direct sound.

    Parameters
    ----------
    troughs : Troughs
        The rows.
    frequencies : ndarray, shape (f,)
        Frequencies [Hz].
    heights : tuple of ndarray, each of shape (n,)
        Of both ends above the tops [m].
    run : ndarray, shape (n,)
        Way between the ends along the tops [m].

    Returns
    -------
    ndarray of complex, shape (n, f)
        Add 1 for the pressure over that of free sound.
    """
    one, other = (np.maximum(height, 0.0) for height in heights)
    straight, mirrored = np.hypot(run, one - other), np.hypot(run, one + other)
    far = np.maximum(mirrored, 1e-9)
    c = troughs.speed_of_sound
    factor = spherical_factor(troughs, frequencies, (one + other) / far, far, c)
    later = 4 * one * other / np.maximum(straight + mirrored, 1e-9)
    turned = np.exp(-2j * np.pi * frequencies / c * later[:, None])
    return (straight / far)[:, None] * factor * turned
