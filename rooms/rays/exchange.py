"""What places exchange by way of scattering surfaces.

Energy that is scattered at least once arrives by mirrors at the last surface that
scatters it on its way to a place. So a patch hands on the energy that met it on any
way from one place, times what would meet it from the other by mirrors only:
scattered (1 - absorption) / (pi area) times both, delays added. Every ray of one
place thus meets every ray of the other.

With m and s for what came by mirrors and by scattering, the mean of both ways is
m m' + (s m' + m s') / 2: the real part of (m + s/2 + j s/2) (m' + s'/2 + j s'/2). So
one complex transform over time serves both.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rir.arrays import FloatArray
from rooms.rays.rows import WIDTH, add, meet, pour
from rooms.rays.transform import find_order, find_turns, transform

__all__ = ["Exchange", "FluxLayout"]

_WRAP = 1e-6
"""What is left of the end of a transform where it meets the beginning."""

_COARSE = 8
"""Blocks of time over which errors are told apart: more, and errors that neighbours
have in common would be taken for independent."""


@dataclass(frozen=True)
class FluxLayout:
    """How the flux of a place lies in memory.

    Bands fill rows of eight, or share a row with other patches if they are few.

    Parameters
    ----------
    patches, bins, bands : int
        Counts.
    """

    patches: int
    bins: int
    bands: int

    @property
    def wide(self) -> int:
        """Room for the bands of a patch."""
        few = 1 << (self.bands - 1).bit_length()
        return few if few <= WIDTH else -(-self.bands // WIDTH) * WIDTH

    @property
    def group(self) -> int:
        """Patches that share a row."""
        return max(WIDTH // self.wide, 1)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Groups, bins, and numbers per group and bin."""
        return -(-self.patches // self.group), self.bins, self.group * self.wide

    @property
    def bases(self) -> NDArray[np.int64]:
        """Where each patch begins."""
        group, place = np.divmod(np.arange(self.patches), self.group)
        return group * self.bins * self.shape[2] + place * self.wide

    def laid_out(self, table: FloatArray) -> FloatArray:
        """Return numbers per patch and band, one row per group."""
        groups, _, span = self.shape
        full = np.zeros((groups * self.group, self.wide))
        full[: len(table), : self.bands] = table
        return full.reshape(groups, span)

    def gathered(self, table: FloatArray) -> FloatArray:
        """Return numbers per band, last axis, from sums over groups."""
        split = table.reshape(*table.shape[:-1], self.group, self.wide)
        return split.sum(axis=-2)[..., : self.bands]


class Exchange:
    """Multiplies the flux of places, patch by patch.

    Parameters
    ----------
    layout : FluxLayout
        The arrays of flux.
    share : ndarray, shape (patches, bands)
        What a patch hands on.
    scales : tuple of float
        Energy of a ray that follows mirrors only, and of one that is scattered, if
        the rays of one batch were all.
    """

    def __init__(
        self, layout: FluxLayout, share: FloatArray, scales: tuple[float, float]
    ) -> None:
        self.layout, self.scales = layout, np.array(scales)
        self.roots = layout.laid_out(np.sqrt(share))
        length = 1 << (layout.bins - 1).bit_length()
        self.block = max(length // _COARSE, 1)
        self.turns = find_turns(length), find_turns(length // self.block)
        self.damping = [_WRAP ** (np.arange(len(t)) / len(t)) for t in self.turns]
        self.order = [find_order(len(t)) for t in self.turns]

    def between(
        self, here: NDArray[np.float32], there: NDArray[np.float32]
    ) -> tuple[FloatArray, FloatArray]:
        """Return what places exchange, and what it varies with the batches.

        Exchanging `here` and `there` changes nothing, to the last bit.

        Parameters
        ----------
        here, there : ndarray, shape (H or T, batches, 2, groups, bins, numbers)
            Flux of rays that follow mirrors only and of those that are scattered.

        Returns
        -------
        mean : ndarray, shape (H, T, bins, bands)
        rows : ndarray, shape (H, T, batches, blocks, bands)
            Sums over blocks of time steps, of which the mean is twice that of `mean`,
            one for each batch, which meets all of the other place.
        """
        span, batches = self.layout.shape[2], here.shape[1]
        pair = (len(here), len(there), span // WIDTH)
        fine, coarse = (len(t) for t in self.turns)
        mean = np.zeros((*pair, fine, 2, WIDTH))
        parts = np.zeros((2, *pair, batches, coarse, 2, WIDTH))
        _exchange(
            here,
            there,
            self.roots,
            self.scales,
            self.turns[0],
            self.turns[1],
            self.damping[0],
            self.damping[1],
            self.block,
            mean,
            parts,
        )
        # batches before time, rows of eight last
        rows = np.moveaxis(parts[0] + parts[1], 2, -4)
        whole = self._over_time(np.moveaxis(mean, 2, -4), 0)[:, :, : self.layout.bins]
        return whole, self._over_time(rows, 1)

    def _over_time(self, product: FloatArray, scale: int) -> FloatArray:
        """Transform (..., rows, frequencies, 2, 8) to (..., time, bands)."""
        spectrum = np.empty((*product.shape[:-2], WIDTH), dtype=complex)
        spectrum[..., self.order[scale], :] = (
            product[..., 0, :] + 1j * product[..., 1, :]
        )
        energy = np.fft.ifft(spectrum, axis=-2).real / self.damping[scale][:, None]
        energy = np.moveaxis(energy, -3, -2)
        return self.layout.gathered(energy.reshape(*energy.shape[:-2], -1))


@njit(cache=True, nogil=True)
def _exchange(
    here,
    there,
    roots,
    scales,
    turns,
    coarse_turns,
    damping,
    coarse_damping,
    block,
    mean,
    parts,
):
    """Add the products of all pairs of places to `mean` and `parts`, transformed."""
    places, others = len(here), len(there)
    batches = here.shape[1]
    rows = roots.shape[1] // WIDTH
    steps, blocks = len(turns), len(coarse_turns)
    fine = np.empty((places + others, steps, 2, WIDTH))
    coarse = np.empty((places + others, batches + 1, blocks, 2, WIDTH))
    for g in range(len(roots)):
        for row in range(rows):
            dark = True
            for lane in range(WIDTH):
                dark &= roots[g, WIDTH * row + lane] == 0.0
            if dark:
                continue
            for p in range(places + others):
                flux = here[p] if p < places else there[p - places]
                _gather(
                    flux,
                    g,
                    row,
                    roots,
                    scales,
                    damping,
                    coarse_damping,
                    block,
                    fine[p],
                    coarse[p],
                )
                transform(fine[p], turns)
                for k in range(batches + 1):
                    transform(coarse[p, k], coarse_turns)
            for i in range(places):
                for j in range(others):
                    one, other = fine[i], fine[places + j]
                    total = mean[i, j, row]
                    for f in range(steps):
                        meet(total, f, one, f, other, f, 1.0)
                    whole_one, whole = coarse[i, batches], coarse[places + j, batches]
                    for k in range(batches):
                        one, other = coarse[i, k], coarse[places + j, k]
                        first, second = parts[0, i, j, row, k], parts[1, i, j, row, k]
                        for f in range(blocks):
                            meet(first, f, one, f, whole, f, 1.0)
                            meet(second, f, whole_one, f, other, f, 1.0)


@njit(cache=True, nogil=True)
def _gather(
    flux, group, row, roots, scales, damping, coarse_damping, block, fine, coarse
):
    """Write one row of eight of a flux, ready to be transformed.

    `fine` gets the mean of all batches, `coarse` that of each and, last, of all.
    """
    batches, _, groups, bins, span = flux.shape
    rows = span // WIDTH
    fine[:] = 0.0
    coarse[:] = 0.0
    each, mean = coarse[:batches], coarse[batches]
    blocks = len(mean)
    place, kind = group * rows + row, groups * bins * rows
    for t in range(bins):
        at, c = (group * bins + t) * rows + row, t // block
        for k in range(batches):
            first = 2 * k * kind + at
            pour(
                fine,
                t,
                each,
                k * blocks + c,
                flux,
                first,
                first + kind,
                roots,
                place,
                scales[0],
                scales[1] / 2,
                damping[t] / batches,
                coarse_damping[c],
            )
    for k in range(batches):
        for t in range(2 * blocks):
            add(mean, t, each, k * 2 * blocks + t, 1.0 / batches)
