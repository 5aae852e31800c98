"""Gain patterns in the wave equation: a monopole and a gradient.

A device whose far field is (a + b . u) e^(-ikr)/r in direction u is a monopole of
strength a and a dipole b / (ik): the gradient with respect to its place. So the
pressure between two devices is (a + b . grad / ik) (a' + b' . grad' / ik) of that
between two points, whatever the room. What higher orders of a pattern add fades
towards low frequencies and is left out there.
"""

from dataclasses import dataclass

import numpy as np

from rir import GainPattern
from rir.arrays import ComplexArray, FloatArray, IntArray
from rir.pose import rotate
from rooms.wave_grid import WaveGrid

__all__ = ["Moments", "ending", "transfer"]

_BLOCK = 256
"""Listeners heard in one march with all their gradients."""

_STEPS = 64
"""Time steps in a block of a Fourier sum: about as many as there are blocks."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Strengths of the monopole and of the gradient of devices over frequency."""

    constant: FloatArray
    """Gain that does not depend on direction. Shape (frequencies,)."""
    gradient: FloatArray
    """Vector whose product with a direction is the rest, in the room frame. Shape
    (devices, frequencies, 3)."""

    @staticmethod
    def of(
        pattern: GainPattern, orientations: FloatArray, frequencies: FloatArray
    ) -> "Moments":
        """Return the moments of devices of one pattern, turned by (N, 4) quaternions.

        Examples
        --------
        >>> looking_along_x = np.array([[0.0, 0, 0, 1]])
        >>> cardioid = GainPattern.cardioid()
        >>> parts = Moments.of(cardioid, looking_along_x, np.array([50.0]))
        >>> parts.constant.round(6).tolist(), parts.gradient.round(6).tolist()
        ([0.5], [[[0.5, 0.0, 0.0]]])
        """
        rows = pattern.at_bands(frequencies).coefficients
        device = np.zeros((len(frequencies), 3))
        if rows.shape[1] > 1:
            device = np.sqrt(3 / (4 * np.pi)) * rows[:, [3, 1, 2]]
        room = rotate(orientations[:, None], device)
        return Moments(rows[:, 0] / np.sqrt(4 * np.pi), room)

    @property
    def axes(self) -> list[int]:
        """Axes along which some device has a gradient."""
        most = np.abs(self.gradient).max(axis=(0, 1), initial=0.0)
        return [axis for axis in range(3) if most[axis] > 1e-12]


def transfer(
    grid: WaveGrid,
    places: tuple[FloatArray, FloatArray],
    moments: tuple[Moments, Moments],
    frequencies: FloatArray,
    duration: float,
    faded: FloatArray | None = None,
) -> ComplexArray:
    """Return transfer functions from one device to many, shape (L, frequencies).

    Parameters
    ----------
    grid : WaveGrid
        The room.
    places : tuple of ndarray, shape (3,), (L, 3)
        Where the emitter and the listeners are [m].
    moments : tuple of Moments
        Of the emitter (one device) and of the listeners.
    frequencies : ndarray, shape (frequencies,)
        Frequencies above 0 [Hz].
    duration : float
        Length of the responses [s].
    faded : ndarray, optional
        Second-order sections that responses pass through.

    Notes
    -----
    The last tenth is faded out: what is cut off sharply at the end of a response
    clicks in all octaves.
    """
    emitter, listeners = moments
    wave = 2 * np.pi * frequencies / grid.scene.speed_of_sound
    total = np.zeros((len(places[1]), len(frequencies)), complex)
    for axis in (None, *emitter.axes):
        strength: ComplexArray = emitter.constant.astype(complex)
        if axis is not None:
            strength = emitter.gradient[0, :, axis] / (1j * wave)
        if not np.any(strength):
            continue
        source = _cells(grid, places[0][None], axis)
        blurred = grid.blur(places[0][None], *source, frequencies, axis)
        strength = strength / blurred[0]
        for first in range(0, len(places[1]), _BLOCK):
            some = slice(first, first + _BLOCK)
            part = Moments(listeners.constant, listeners.gradient[some])
            heard = _heard(grid, source, places[1][some], part, wave, duration, faded)
            total[some] += strength * heard
    total *= grid.gain(frequencies)
    return total


def _cells(
    grid: WaveGrid, points: FloatArray, axis: int | None
) -> tuple[IntArray, FloatArray]:
    return grid.pressure(points) if axis is None else grid.slope(points, axis)


def _heard(
    grid: WaveGrid,
    source: tuple,
    points: FloatArray,
    listeners: Moments,
    wave: FloatArray,
    duration: float,
    faded: FloatArray | None,
) -> ComplexArray:
    """Return what listeners hear of one set of driven cells, (L, frequencies)."""
    from scipy.signal import sosfilt

    axes = [None, *listeners.axes]
    parts = [_cells(grid, points, axis) for axis in axes]
    widest = max(weights.shape[1] for _, weights in parts)
    # a cell of weight zero fills short rows
    cells = [np.pad(c, ((0, 0), (0, widest - c.shape[1]), (0, 0))) for c, _ in parts]
    weights = [np.pad(w, ((0, 0), (0, widest - w.shape[1]))) for _, w in parts]
    ears = np.concatenate(cells), np.concatenate(weights)
    low = grid.march(source[0][0], source[1][0], *ears, duration)
    if faded is not None:
        low = np.asarray(sosfilt(faded, low, axis=-1))
    low *= ending(low.shape[1])
    frequencies = wave * grid.scene.speed_of_sound / (2 * np.pi)
    turn = grid.turns(frequencies)
    spectra = _spectra(low, turn).reshape(len(axes), len(points), len(wave))
    spectra /= [
        grid.blur(points, *part, frequencies, axis)
        for axis, part in zip(axes, parts, strict=True)
    ]
    total = listeners.constant * spectra[0]
    for axis, spectrum in zip(axes[1:], spectra[1:], strict=True):
        total = total + listeners.gradient[:, :, axis] / (1j * wave) * spectrum
    return total


def _spectra(signals: FloatArray, turn: FloatArray) -> ComplexArray:
    """Return the sums of signals (n, steps) over exp(-i turn step), (n, turns).

    The exponentials of all steps are products of those within a block and between
    blocks, so only these are computed.
    """
    blocks = -(-signals.shape[1] // _STEPS)
    missing = blocks * _STEPS - signals.shape[1]
    parts = np.pad(signals, ((0, 0), (0, missing))).reshape(-1, _STEPS)
    within = np.outer(np.arange(_STEPS), turn)
    sums = parts @ np.cos(within) - 1j * (parts @ np.sin(within))
    between = np.exp(-1j * _STEPS * np.outer(np.arange(blocks), turn))
    return np.einsum("nbt,bt->nt", sums.reshape(-1, blocks, len(turn)), between)


def ending(count: int) -> FloatArray:
    """Return the factors that fade the last tenth of so many samples out."""
    left = np.arange(count, 0, -1) / max(1, count // 10)
    return np.sin(np.pi / 2 * np.minimum(left, 1)) ** 2
