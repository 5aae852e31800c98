"""How much a flat face of limited size mirrors.

Kirchhoff's integral over a rectangle is, near enough, the product of two Fresnel
integrals, one along each side, and a sum over the corners where the way runs along
neither. A face is not a hole in a screen, however: near an edge where sound can pass,
the pressure on the face evens out with that behind it, so that narrow faces, and faces
met at flat angles, mirror much less than Kirchhoff's integral says. What the waves from
single edges do to it is known exactly (the half-plane); what two edges do to each other
is that of the rigid strip. Thin plates of few wavelengths are solved as a whole.
"""

from dataclasses import dataclass

import numpy as np

from rir.arrays import ComplexArray, FloatArray, IntArray
from rooms.panels.fresnel import beyond, over_rectangle, turn
from rooms.panels.plates import plate_energy
from rooms.panels.strips import first_order, strip_table

__all__ = ["Faces", "mirror_strength"]

_NODES = 5
"""Frequencies per octave: energy of an octave changes by 0.1 dB with more."""

_JOINT = 1.27
"""Power that joins what both sides of a rectangle lose. It sets the limit of low
frequencies: a square plate moves 0.58 and one of 1 x 2 0.76 of the air that an infinite
strip as wide does (D. Meyerhoff, J. Ship Res. 14, 100, 1970: 0.579 and 0.757)."""

_COUPLED = 0.3
"""Mutual influence of two edges, as a share of the mirrored pressure, from which the
strip in a plane wave tells more than its edges seen from where the ends are. From 0.2
to 0.6 levels of plates fit boundary elements alike, within 0.04 dB on average."""

_FREE = 0.9
"""Passage around edges that open more than 327 degrees: rims of thin plates."""

_LARGEST = 24.0
"""Wavenumber times longer side up to which thin plates are solved exactly. Beyond, the
edges' form is off by 0.4 dB rms. What it misses shrinks with the wavelength: against
plates of up to four times that width 0.28 dB are left so, 0.30 with the square root of
the wavelength, 0.31 with its square."""

_MOST = np.log(2.0)  # more is no trend: a minimum of interference has moved
_CLOSE = 0.05
"""Height over longer side up to which nodes do not tell how waves meet a plate; from
twice as high on they do, within 0.3 dB."""

_ALONG = 1e-3  # correlation of both sides, and angle to a right one, not to be heard
_SLIGHTEST = 1e-6  # cosines below it would divide by zero


@dataclass(frozen=True, eq=False)
class Faces:
    """Reflections on rectangles, each in a frame along its two sides and its normal.

    Parameters
    ----------
    way : ndarray, shape (n, 3)
        Unit vector of the sound that arrives; its third component is negative.
    before, after : ndarray, shape (n,)
        Lengths of the way to the point of reflection and from it [m].
    low, high : ndarray, shape (n, 2)
        From the point of reflection to the ends along both sides [m]; infinite where
        a face goes on.
    bend : ndarray, shape (n, 2, 2)
        Angle by which what follows at each end (low, high) of each side stands off
        the plane [rad]; from a right angle on, nothing follows.
    passage : ndarray, shape (n, 2, 2)
        How freely sound passes around each end, 0…1: 1 around the rim of a thin plate.
    gap : ndarray, shape (n, 2, 2)
        Width of the gap behind each end after which another face goes on in the same
        plane [m]; infinite where none does.
    """

    way: FloatArray
    before: FloatArray
    after: FloatArray
    low: FloatArray
    high: FloatArray
    bend: FloatArray
    passage: FloatArray
    gap: FloatArray

    def __len__(self) -> int:
        return len(self.before)


def mirror_strength(faces: Faces, bands: FloatArray, speed: float) -> FloatArray:
    """Return the mirrored energy per octave against that of an endless face.

    It can exceed 1: a face as large as the first Fresnel zone mirrors up to four
    times as much to the middle of its beam, and less beside it.

    Parameters
    ----------
    faces : Faces
        The n reflections.
    bands : ndarray, shape (bands,)
        Middle frequencies of octaves [Hz].
    speed : float
        Speed of sound [m/s].

    Returns
    -------
    ndarray, shape (n, bands)
        The same when both ends are exchanged.

    References
    ----------
    J. H. Rindel, Appl. Acoust. 34, 7 (1991): Fresnel integrals along both sides.
    A. Sommerfeld, Math. Ann. 47, 317 (1896): the half-plane; R. Kouyoumjian,
    P. Pathak, Proc. IEEE 62, 1448 (1974), for ends at limited distances.
    """
    strength = _from_edges(faces, bands, speed)
    wave = 2 * np.pi / speed * np.asarray(bands, dtype=float)
    sides = faces.high - faces.low
    free = np.all(faces.passage >= _FREE, axis=(1, 2)) & np.isfinite(sides).all(axis=1)
    rows = np.nonzero(free)[0]
    sizes, kind = np.unique(np.round(sides[rows], 3), axis=0, return_inverse=True)
    for number, size in enumerate(sizes.tolist()):
        some = rows[kind.ravel() == number]
        strength[some] = _exact(faces, some, tuple(size), strength[some], wave)
    return strength


def _exact(
    faces: Faces,
    rows: IntArray,
    size: tuple[float, float],
    edges: FloatArray,
    wave: FloatArray,
) -> FloatArray:
    """Return the strength of equal thin plates, exact where they are small."""
    small = np.nonzero(wave * max(size) <= _LARGEST)[0]
    close = np.minimum(faces.before, faces.after)[rows] * -faces.way[rows, 2]
    share = np.clip(close / max(size) / _CLOSE - 1, 0.0, 1.0)[:, None]
    if not len(small) or not share.any():
        return edges
    middle = np.column_stack([(faces.low + faces.high)[rows] / 2, np.zeros(len(rows))])
    here, there = (end[rows] - middle for end in _ends(faces))
    whole = (faces.before + faces.after)[rows] ** 2
    exact = edges.copy()
    for band in small:
        exact[:, band] = whole * plate_energy(size, (here, there), float(wave[band]))
    # what the edges' form misses goes on to shorter waves
    last = small[np.argmax(wave[small])]
    missed = np.log(exact[:, last] / np.maximum(edges[:, last], 1e-300))
    missed = np.clip(missed, -_MOST, _MOST)[:, None]
    large = wave * max(size) > _LARGEST
    exact[:, large] *= np.exp(missed * wave[last] / wave[large])
    return edges + share * (exact - edges)


def _from_edges(faces: Faces, bands: FloatArray, speed: float) -> FloatArray:
    """Return what single edges and infinite strips leave of Fresnel's integrals."""
    share = (np.arange(_NODES) + 0.5) / _NODES
    spread = np.sqrt(0.5) * (1 - share) + np.sqrt(2.0) * share
    wave = 2 * np.pi / speed * np.outer(bands, spread).ravel().astype(float)
    cell = 2 * np.pi / speed * np.repeat(bands, _NODES) * np.sqrt(0.5) / _NODES
    pressure, loss = np.ones((2, len(faces), len(wave)), dtype=complex)
    for side in (0, 1):
        mirrored, kept = _along(faces, side, wave, cell)
        pressure *= mirrored
        # a sum over both sides, less what was counted twice
        loss += kept**-_JOINT - 1
    slanting, cross = _slanting(faces)
    pressure[slanting] = over_rectangle(
        _detours(faces)[slanting], cross[slanting], wave, cell
    )
    energy = np.abs(pressure) ** 2 * np.abs(loss) ** (-2 / _JOINT)
    return energy.reshape(len(faces), len(bands), _NODES).mean(axis=2)


def _slanting(faces: Faces) -> tuple[IntArray, FloatArray]:
    """Return which rectangles nothing continues are met along neither side.

    With them the correlation that the slant makes between both sides.
    """
    sines = np.minimum(faces.way[:, :2] ** 2, 1 - _SLIGHTEST)
    cross = np.prod(faces.way[:, :2], axis=1) / np.sqrt(np.prod(1 - sines, axis=1))
    ended = np.isfinite(faces.high - faces.low) & (faces.low < 0) & (faces.high > 0)
    ended = ended & np.all(np.isinf(faces.gap), axis=2)
    ended &= np.all(faces.bend > np.pi / 2 - _ALONG, axis=2)
    slanting = np.all(ended, axis=1) & (np.abs(cross) > _ALONG)
    return np.nonzero(slanting)[0], cross


def _detours(faces: Faces) -> FloatArray:
    """Return how much longer ways over the ends of both sides are, (n, 2, 2) [m]."""
    ends = _ends(faces)
    ways = faces.before, faces.after
    return np.stack(
        [
            np.stack(
                [
                    _detour(*ways, *ends, side, reach[:, side])
                    for reach in (faces.low, faces.high)
                ],
                axis=1,
            )
            for side in (0, 1)
        ],
        axis=1,
    )


def _along(
    faces: Faces, side: int, wave: FloatArray, cell: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return Fresnel's integral along one side, and what edges leave of it."""
    other = 1 - side
    here, there = _ends(faces)
    low, high = faces.low[:, side], faces.high[:, side]
    sines = [_mean_sine(faces, s, here, there) for s in (side, other)]
    mirrored = np.ones((len(faces), len(wave)), dtype=complex)
    edges = []
    for end, reach in enumerate((low, high)):
        lost, turned = _edge(faces, side, end, here, there, wave, cell)
        mirrored -= lost
        edges.append(np.where(np.isfinite(reach)[:, None], turned, 0.0))
    small = np.abs(mirrored) < 1e-9  # no sound, nothing to lose
    whole = np.where(small, 1.0, mirrored)
    edges = [-edge / whole for edge in edges]
    flat = np.sqrt(np.maximum(1 - sines[1] ** 2, _SLIGHTEST))
    width = np.where(np.isfinite(high - low), high - low, 1.0) * flat
    sine = np.minimum(sines[0] / flat, 1 - _SLIGHTEST)
    free = faces.passage[:, side]
    both = np.sqrt(free[:, 0] * free[:, 1])[:, None]
    kept = 1 + (free[:, :1] - both) * edges[0] + (free[:, 1:] - both) * edges[1]
    near = np.any(both > 0, axis=1)
    if near.any():
        strip = _strip(
            1 + edges[0][near] + edges[1][near], np.outer(width[near], wave), sine[near]
        )
        kept[near] += both[near] * (strip - 1)
    return mirrored, kept


def _strip(alone: ComplexArray, width: FloatArray, sine: FloatArray) -> ComplexArray:
    """Return what two edges leave: those of single ones, and their mutual influence."""
    sine = np.broadcast_to(sine[:, None], width.shape)
    mean = strip_table()(width, sine)
    mutual = mean - first_order(width, sine)
    coupled = (np.abs(mutual) / _COUPLED) ** 4
    part = coupled / (1 + coupled)
    return (1 - part) * (alone + mutual) + part * mean


def _ends(faces: Faces) -> tuple[FloatArray, FloatArray]:
    """Return both ends of the ways seen from the points of reflection, (n, 3) each."""
    here = -faces.before[:, None] * faces.way
    there = faces.after[:, None] * faces.way * [1, 1, -1]
    return here, there


def _mean_sine(
    faces: Faces, side: int, here: FloatArray, there: FloatArray
) -> FloatArray:
    """Return the mean sine of incidence along a side, over its width and both ends."""
    low, high = faces.low[:, side], faces.high[:, side]
    whole = np.isfinite(high - low)
    low, high = np.where(whole, low, -1.0), np.where(whole, high, 1.0)
    gaps = [
        _length(end, side, high)[0] - _length(end, side, low)[0]
        for end in (here, there)
    ]
    mean = np.abs(gaps[0] - gaps[1]) / (2 * (high - low))
    return np.where(whole, mean, np.abs(faces.way[:, side]))


def _length(
    end: FloatArray, side: int, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the distance of an end from the foot on an edge, and across the edge."""
    across = np.hypot(end[:, side] - reach, end[:, 2])
    return np.hypot(across, end[:, 1 - side]), across


def _edge(
    faces: Faces,
    side: int,
    end: int,
    here: FloatArray,
    there: FloatArray,
    wave: FloatArray,
    cell: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Return what an edge takes from Fresnel's integral, and what it sends besides."""
    reach = (faces.low, faces.high)[end][:, side]
    outward = -1.0 if end == 0 else 1.0
    reach = np.where(np.isfinite(reach), reach, outward)
    cosine = np.maximum(-faces.way[:, 2], _SLIGHTEST)
    sines = np.minimum(faces.way[:, :2] ** 2, 1 - _SLIGHTEST)
    skew = cosine / np.sqrt(np.prod(1 - sines, axis=1))
    detour = _detour(faces.before, faces.after, here, there, side, reach) * skew
    edge = np.sqrt(np.outer(detour, wave))
    phase = turn(detour, wave, cell)
    # what follows at an angle goes on with the integral, at a phase that runs ahead
    curve = skew * (1 - sines[:, side]) * (1 / faces.before + 1 / faces.after) / 2
    bend = np.minimum(faces.bend[:, side, end], np.pi / 2 - _SLIGHTEST)
    ahead = np.sqrt(wave) * (cosine * np.tan(bend) / np.sqrt(curve))[:, None]
    lost = phase * (beyond(edge) - beyond(edge + ahead))
    # and what goes astray at a slight bend goes where the neighbour mirrors it
    lost *= np.sin(bend)[:, None] ** 2
    # seen from beyond an edge all is lost but what the face still sends there
    inside = (outward * reach >= 0)[:, None]
    lost = np.where(inside, lost, 1 - phase * beyond(edge))
    more = np.nonzero(np.isfinite(faces.gap[:, side, end]))[0]
    if len(more):
        resumed = reach[more] + outward * faces.gap[more, side, end]
        parts = faces.before[more], faces.after[more]
        far = _detour(*parts, here[more], there[more], side, resumed) * skew[more]
        again = turn(far, wave, cell) * beyond(np.sqrt(np.outer(far, wave)))
        lost[more] -= again
    return lost, phase * _sent(here, there, side, reach, outward, wave)


def _detour(
    before: FloatArray,
    after: FloatArray,
    here: FloatArray,
    there: FloatArray,
    side: int,
    reach: FloatArray,
) -> FloatArray:
    """Return how much longer the way over the foot on an edge is [m]."""
    way = sum(_length(end, side, reach)[0] for end in (here, there))
    return np.maximum(way - before - after, 0.0)


def _sent(
    here: FloatArray,
    there: FloatArray,
    side: int,
    reach: FloatArray,
    outward: float,
    wave: FloatArray,
) -> ComplexArray:
    """Return what an edge sends besides: the direct term of the half-plane."""
    (one, across), (two, past) = (_length(p, side, reach) for p in (here, there))
    angles = [
        np.arctan2(p[:, 2], -outward * (p[:, side] - reach)) for p in (here, there)
    ]
    spread = across * past / (one + two)
    light = np.sqrt(2 * np.outer(spread, wave))
    return beyond(light * np.cos((angles[0] - angles[1]) / 2)[:, None])
