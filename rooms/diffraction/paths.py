"""Paths that bend around one or two edges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import ComplexArray, FloatArray, IntArray
from rir.errors import SceneError
from rooms.diffraction.bender import Bender
from rooms.diffraction.edges import Edges, edges_of
from rooms.diffraction.single import bent_once
from rooms.mesh import MeshGeometry

__all__ = ["DiffractedPaths", "diffracted_paths"]


@dataclass(frozen=True, eq=False)
class DiffractedPaths:
    """Diffracted paths from one emitter to listeners, as a struct of arrays.

    Parameters
    ----------
    listener : ndarray, shape (n,)
        Index of the listener.
    length : ndarray, shape (n,)
        Length of the way around the edges [m].
    departure, arrival : ndarray, shape (n, 3)
        Unit vectors out of the emitter, and from the listener to where it comes from.
    order : ndarray, shape (n,)
        Number of edges: 1 or 2.
    gain : ndarray of complex, shape (n, bands)
        Pressure where the free field is 1/d, without the delay of the length.
    edges : ndarray, shape (n, 2)
        Edges in order of travel, then -1.
    mirrors : ndarray, shape (n,)
        Number of mirrors on the way: 0 or 1.
    """

    listener: IntArray
    length: FloatArray
    departure: FloatArray
    arrival: FloatArray
    order: IntArray
    gain: ComplexArray
    edges: IntArray
    mirrors: IntArray

    def __len__(self) -> int:
        return len(self.listener)


def diffracted_paths(
    geometry: MeshGeometry,
    emitter: ArrayLike,
    listeners: ArrayLike,
    *,
    bands: ArrayLike,
    speed_of_sound: float,
    max_order: int = 2,
    max_mirrors: int = 1,
    reflection: ArrayLike | None = None,
    edges: Edges | None = None,
    fading_mirrors: bool = False,
) -> DiffractedPaths:
    """Find the ways around one and two edges, with their UTD gains.

    Two edges matter only where the ends do not see each other, and are left out
    elsewhere, as are pairs with an edge that opens less than 200 degrees.

    In the light of the emitter the diffracted sound makes up for the steps where
    mirror paths end; in its shadow it is all there is. Ways around one edge may be
    mirrored once, before or after it: they are those of an image, where the mirror
    is seen from the device and from the edge. Ways around two edges go straight
    between them. Exchanging the ends gives the same lengths and gains.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    emitter : array_like, shape (3,)
        Position [m].
    listeners : array_like, shape (L, 3)
        Positions [m].
    bands : array_like, shape (bands,)
        Frequencies [Hz].
    speed_of_sound : float
        Speed of sound [m/s].
    max_order : int
        Most edges on a way, 1 or 2.
    max_mirrors : int
        Most mirrors on a way around one edge, 0 or 1.
    reflection : array_like, shape (surfaces, bands), optional
        Amplitude reflection factors; rigid when left out.
    edges : Edges, optional
        Edges to use, when they have been found already.
    fading_mirrors : bool
        Whether mirrors fade towards the rims of faces by themselves
        (`rooms.panels`): ways around a rim of the face that shows one end to the
        other, which make up for its end, are then left out.

    Raises
    ------
    SceneError
        If the order is not 0, 1 or 2.

    References
    ----------
    R. Kouyoumjian, P. Pathak, Proc. IEEE 62, 1448 (1974).

    Examples
    --------
    >>> floor = [(0, 0), (6, 0), (6, 2.5), (3, 2.5), (3, 5), (0, 5)]
    >>> room = MeshGeometry.extruded(floor, 3)
    >>> ways = diffracted_paths(
    ...     room, [1, 4.5, 1], [[5.5, 1, 1]], bands=[500.0], speed_of_sound=343.2
    ... )
    >>> int((ways.mirrors == 0).sum()), int((ways.mirrors == 1).sum())
    (1, 8)
    """
    if max_order not in (0, 1, 2):
        raise SceneError(f"1 or 2 edges can be bent around, not {max_order}")
    if max_mirrors not in (0, 1):
        raise SceneError(f"a bent way can be mirrored 0 or 1 times, not {max_mirrors}")
    edges = edges_of(geometry) if edges is None else edges
    wave = 2 * np.pi * np.asarray(bands, dtype=float) / speed_of_sound
    factors = np.ones((geometry.surfaces, len(wave)))
    if reflection is not None:
        factors = np.asarray(reflection, dtype=float)
    start = geometry.localised(emitter)[0]
    ends = geometry.localised(listeners)
    bender = Bender(geometry, edges, wave, factors, fading_mirrors)
    found: list[tuple] = []
    if len(edges) and max_order and len(ends):
        found = bent_once(bender, start, ends, max_mirrors)
        hidden = ~geometry.sees(start, ends) if max_order == 2 else np.zeros(0, bool)
        for index in np.nonzero(hidden)[0]:
            found += bender.twice(int(index), start, ends[index])
    if not found:
        none, flat = np.zeros((0, 3)), np.zeros(0)
        whole, pairs = np.zeros(0, np.int64), np.zeros((0, 2), np.int64)
        gain = np.zeros((0, len(wave)), complex)
        return DiffractedPaths(whole, flat, none, none, whole, gain, pairs, whole)
    found.sort(key=lambda row: (row[0], row[1]))
    return DiffractedPaths(*(np.array(part) for part in zip(*found, strict=True)))
