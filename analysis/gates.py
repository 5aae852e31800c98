"""Band energies on both sides of a split: cut first, filtered afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.decay.response import sample_at
from analysis.envelopes import EnvelopeLayout, band_envelopes, fast_length, transform
from rir.arrays import FloatArray
from rir.bands import Band, cached_weights

__all__ = ["RINGING", "Gates", "gated_energies"]

RINGING = 1.5
"""Room left around a response for the narrowest band to ring in [1/B]."""


@dataclass(frozen=True)
class Gates:
    """Band energies of responses cut at the splits first and filtered afterwards.

    Parameters
    ----------
    lengths : ndarray, shape (responses, splits)
        Where each response is cut [samples].
    reach : int
        The late energies end this many samples behind the cut.
    early, late : ndarray, shape (responses, splits, bands)
        Energy of what comes before the cut; of what comes from the cut on, as far as
        it sounds before the reach.
    """

    lengths: NDArray[np.int64]
    reach: int
    early: FloatArray
    late: FloatArray


def gated_energies(
    responses: Sequence[FloatArray],
    directs: Sequence[int],
    rate: float,
    bands: tuple[Band, ...],
) -> Gates:
    """Return the band energies on both sides of each split.

    Behind the reach the ringing of the early part is over, and the band's own decay
    curve goes on from there.
    """
    narrowest = min(band.width for band in bands)
    reach = int(RINGING / narrowest * rate) + 1
    fixed = [sample_at(0.05, rate), sample_at(0.08, rate)]
    lengths = np.array([[*fixed, direct] for direct in directs])
    size = fast_length(int(lengths.max()) + 2 * reach)
    shape = (len(responses), len(fixed) + 1)
    early = np.zeros((*shape, size), dtype=np.float32)
    late = np.zeros((*shape, fast_length(4 * reach)), dtype=np.float32)
    for row, samples in enumerate(responses):
        for split, cut in enumerate(lengths[row]):
            kept = samples[:cut]
            early[row, split, : len(kept)] = kept
            kept = samples[cut : cut + 2 * reach]
            late[row, split, reach : reach + len(kept)] = kept
    return Gates(
        lengths,
        reach,
        _energies_of(early, rate, bands),
        _energies_before(late, rate, bands, 2 * reach),
    )


def _energies_of(
    pieces: NDArray[np.float32], rate: float, bands: tuple[Band, ...]
) -> FloatArray:
    spectra = transform(pieces)
    power = spectra.real**2 + spectra.imag**2
    return power[..., 1:] @ cached_weights(bands, rate, pieces.shape[-1])


def _energies_before(
    pieces: NDArray[np.float32], rate: float, bands: tuple[Band, ...], stop: int
) -> FloatArray:
    rows, splits, size = pieces.shape
    spectra = transform(pieces).reshape(rows * splits, -1)
    energies = np.empty((rows * splits, len(bands)))
    layout = EnvelopeLayout(rate, 0, size)
    for number, band in enumerate(bands):
        envelopes = band_envelopes(spectra, band, layout)
        exact = stop * envelopes.shape[-1] / size
        last = int(exact)
        energies[:, number] = envelopes[:, :last].sum(axis=-1)
        energies[:, number] += (exact - last) * envelopes[:, last]
    return energies.reshape(rows, splits, len(bands))
