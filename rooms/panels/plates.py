"""Thin rigid plates, exactly: how much they mirror while they span few wavelengths.

The jump of pressure across a plate follows from a boundary integral that knows neither
mirror nor edge. Where the ends are enters only through the slope of their waves on the
plate, which a few nodes tell, so that what is solved once per plate serves all ends.
"""

from functools import lru_cache

import numpy as np

from rir.arrays import ComplexArray, FloatArray, IntArray

__all__ = ["plate_energy"]

_PLACES, _WEIGHTS = np.array([-1.0, 0.0, 1.0]) * np.sqrt(0.6), np.array([5, 8, 5]) / 18
"""Gauss's three frequencies of an octave: more move its level by 0.05 dB."""

_ELEMENTS = 8  # a wavelength: twice as many move levels by 0.1 dB
_FEWEST = 16  # elements along a side: the added mass comes out within 0.2 %
_FEWEST_PAIRS, _PAIRS = 4, 0.125
"""Pairs of nodes along a side, and how many more per wavenumber times side. Twice as
many move levels by 0.01 dB, 0.1 dB where ends are close."""

_BLOCK = 64  # reflections looked at in one go, so that all stays in the cache


def plate_energy(
    size: tuple[float, float], ends: tuple[FloatArray, FloatArray], wave: float
) -> FloatArray:
    """Return the energy that a thin rigid plate sends in an octave, shape (n,).

    Parameters
    ----------
    size : tuple of float
        Width and depth [m].
    ends : tuple of ndarray, shape (n, 3)
        Emitters and listeners, seen from the middle of the plate, along its sides and
        its normal [m]. Exchanging them changes nothing.
    wave : float
        Wavenumber at the middle of the octave [1/m]. The energy of a wave 1 m from
        its emitter is 1.

    References
    ----------
    A. Maue, Z. Phys. 126, 601 (1949): the boundary integral.
    """
    middle, apart = wave * 1.5 * np.sqrt(0.5), wave * 0.5 * np.sqrt(0.5) * _PLACES[-1]
    nodes = _nodes(wave * max(size))
    answers = [_answer(*size, k, nodes) for k in middle + apart * np.sign(_PLACES)]
    energy = np.empty(len(ends[0]))
    for first in range(0, len(energy), _BLOCK):
        rows = slice(first, first + _BLOCK)
        one, other = (_slopes(size, end[rows], middle, apart, nodes) for end in ends)
        sent = [
            np.einsum("cni,cni->n", a @ answer, b)
            for a, answer, b in zip(one, answers, other, strict=True)
        ]
        energy[rows] = _WEIGHTS @ np.abs(sent) ** 2
    return energy


def _nodes(width: float) -> int:
    """Return how many nodes tell a wave's slope along a side."""
    return 2 * int(np.ceil(_FEWEST_PAIRS + _PAIRS * width))


def _slopes(
    size: tuple[float, float],
    end: FloatArray,
    middle: float,
    apart: float,
    nodes: int,
) -> ComplexArray:
    """Return slopes across a plate of waves from ends, (3, 4, n, places).

    Three frequencies, in parts even and odd along both sides, on one quarter.
    """
    place = np.polynomial.legendre.leggauss(nodes)[0] / 2
    x, y = (end[:, s, None] - size[s] * place for s in (0, 1))
    height = np.abs(end[:, 2])[:, None, None]
    square = (x**2)[:, :, None] + (y**2 + height[:, 0] ** 2)[:, None]
    r = np.sqrt(square)
    fall = height / (square * r)
    mean, step = (_turn(k * r) for k in (middle, apart))
    mean *= fall
    tilt = 1j * r
    waves: ComplexArray = np.empty((3, *r.shape), dtype=np.complex128)
    waves[0] = (1 - (middle - apart) * tilt) * (mean * step.conj())
    waves[1] = (1 - middle * tilt) * mean
    waves[2] = (1 - (middle + apart) * tilt) * (mean * step)
    for axis in (2, 3):
        low, high = np.split(waves, 2, axis=axis)
        low = np.flip(low, axis=axis)
        waves = np.concatenate([high + low, high - low], axis=axis)
    quarter = nodes // 2
    waves = waves.reshape(3, len(end), 2, quarter, 2, quarter)
    return waves.transpose(0, 2, 4, 1, 3, 5).reshape(3, 4, len(end), -1) / 4


def _turn(phase: FloatArray) -> ComplexArray:
    """Return phases as complex numbers, in a third of the time of `exp`."""
    turn = np.empty((*phase.shape, 2))
    np.cos(phase, out=turn[..., 0])
    np.sin(phase, out=turn[..., 1])
    return turn.view(np.complex128)[..., 0]


@lru_cache(maxsize=4096)  # 0.04 to 0.15 MB each, about ten for a plate
def _answer(width: float, depth: float, wave: float, nodes: int) -> ComplexArray:
    """Return what a plate answers to slopes at nodes, (4, places, places)."""
    size = width, depth
    count = [
        2 * max(_FEWEST // 2, int(np.ceil(_ELEMENTS * side * wave / (4 * np.pi))))
        for side in size
    ]
    # elements end a quarter of their length inside the edges, as doublets on thin
    # wings do (R. James, Comput. Methods Appl. Mech. Eng. 1, 59, 1972)
    step = [side / (n + 0.5) for side, n in zip(size, count, strict=True)]
    kernel = _kernel(count, step, wave)
    offsets = [_offsets(n // 2) for n in count]
    (near, beside), (above, far) = (
        [kernel[along[:, None, :, None], across[:, None]] for across in offsets[1]]
        for along in offsets[0]
    )
    spread = [_spread(n // 2, 1 / (n + 0.5), nodes) for n in count]
    answers: list[ComplexArray] = []
    for along, turn in enumerate((1, -1)):
        for across, flip in enumerate((1, -1)):
            whole = near + flip * beside + turn * (above + flip * far)
            reach = np.kron(spread[0][along], spread[1][across])
            whole = whole.reshape(len(reach), len(reach))
            answers.append(reach.T @ np.linalg.solve(whole, reach))
    return -step[0] * step[1] / np.pi * np.array(answers)


def _offsets(count: int) -> tuple[IntArray, IntArray]:
    """Return offsets between elements of one half, and to those of the other."""
    i = np.arange(count)
    return np.abs(i[:, None] - i), i[:, None] + i + 1


def _spread(count: int, step: float, nodes: int) -> tuple[FloatArray, FloatArray]:
    """Return how values at nodes of one half spread to elements: even, and odd."""
    legendre = np.polynomial.legendre
    places = 2 * step * (np.arange(count) + 0.5)
    known, wanted = (
        legendre.legvander(x, nodes - 1) for x in (legendre.leggauss(nodes)[0], places)
    )
    each = np.linalg.solve(known.T, wanted.T).T
    low, high = each[:, : nodes // 2][:, ::-1], each[:, nodes // 2 :]
    return high + low, high - low


def _kernel(count: list[int], step: list[float], wave: float) -> ComplexArray:
    """Return the influence of an element on others, by their offsets from zero."""
    x, y = np.meshgrid(
        *(np.arange(n) * d for n, d in zip(count, step, strict=True)), indexing="ij"
    )
    area = step[0] * step[1]
    still, near = np.zeros_like(x), np.zeros_like(x)
    for u, sign in ((x - step[0] / 2, -1), (x + step[0] / 2, 1)):
        for v, turn in ((y - step[1] / 2, -1), (y + step[1] / 2, 1)):
            still -= sign * turn * np.hypot(u, v) / (u * v)
            near += (
                sign
                * turn
                * (u * np.arcsinh(v / np.abs(u)) + v * np.arcsinh(u / np.abs(v)))
            )
    r = np.hypot(x, y)
    r[0, 0] = 1.0
    turn = 1j * wave * r
    rest = (np.exp(turn) * (1 - turn) - 1 + turn**2 / 2) / r**3
    rest[0, 0] = 1j * wave**3 / 3
    return (still + wave**2 / 2 * near + rest * area) / (4 * np.pi)
