"""Keeps rays alike: the strong are divided, of the weak some end for the others.

Where one wall absorbs far more than the others, most rays have met it after a while,
and the few that have not carry all that is left. So at some distances as many rays as
wanted are drawn anew, each as often as its share of the energy says (systematic
resampling), and what they carry is evened out. The mean of no sum changes.

H. Kahn, T. Harris, Nat. Bur. Stand. Appl. Math. Ser. 12, 27 (1951): splitting and
roulette; J. Carpenter, P. Clifford, P. Fearnhead, IEE Proc. Radar 146, 2 (1999).
"""

import numpy as np
from numba import njit

__all__ = ["resampled"]

_APART = np.uint64(0xD1B54A32D192ED03)
"""Copies of a ray go on with random numbers that lie so far apart: odd, any other."""


@njit(cache=True, nogil=True)
def resampled(travellers, count, target, chance):
    """Return rays drawn from the first `count` of some, by their share of the energy.

    Parameters
    ----------
    travellers : tuple of ndarray
        Places and ways (n, 6), marks (n, 4) of which the second is the number that
        decides on the first scattering, states of chance (n,), energies and odds (n,
        bands).
    count, target : int
        How many there are, and about how many are wanted.
    chance : float
        A number in 0…1.
    """
    places, marks, states, energies, odds = travellers
    bands = energies.shape[1]
    share = np.zeros(count)
    for band in range(bands):
        whole = 0.0
        for r in range(count):
            whole += energies[r, band]
        if whole > 0.0:
            for r in range(count):
                share[r] += energies[r, band] / whole
    whole = share.sum()
    share *= target / whole if whole > 0.0 else 0.0
    chosen, copy = np.empty(target + 1, np.int64), np.empty(target + 1, np.int64)
    drawn, level = 0, chance
    for r in range(count):
        level += share[r]
        again = 0
        while level >= 1.0 and drawn <= target:
            chosen[drawn], copy[drawn] = r, again
            level -= 1.0
            again += 1
            drawn += 1
    out = (
        np.empty((drawn, 6)),
        np.empty((drawn, 4)),
        np.empty(drawn, np.uint64),
        np.empty((drawn, bands)),
        np.empty((drawn, bands)),
    )
    for i in range(drawn):
        r = chosen[i]
        out[0][i], out[1][i], out[4][i] = places[r], marks[r], odds[r]
        out[2][i] = states[r] + np.uint64(copy[i]) * _APART
        for band in range(bands):
            out[3][i, band] = energies[r, band] / share[r]
        if copy[i] > 0:
            # copies that have followed mirrors so far must not scatter together
            out[1][i, 1] = (marks[r, 1] + copy[i] * 0.6180339887498949) % 1.0
    return out
