"""How far one realisation of a decay scatters: the uncertainty beside each value."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rir.arrays import FloatArray

__all__ = ["uncertainties"]

TIME_SCATTER = {"EDT": 1.72, "T20": 0.96, "T30": 0.60}
"""s(T)/T times sqrt(B T): T20 and T30 by ISO 3382-2 annex A, EDT by simulation."""


def uncertainties(
    values: Mapping[str, Any], bandwidth: float | FloatArray
) -> dict[str, FloatArray]:
    """Return the standard deviation of each value from one realisation to the next.

    s(T20)/T = 0.88 sqrt((1 + 1.9/10)/(B T)), s(T30)/T = 0.55 sqrt((1 + 1.52/10)/(B T))
    (ISO 3382-2:2008, annex A, impulse responses). C50, C80 and D50 follow from the
    scatter of the early and the late energy of a white exponential decay.

    Parameters
    ----------
    values : mapping of str to ndarray
        Parameters as `acoustic_parameters` returns them.
    bandwidth : float or ndarray
        Noise bandwidth of the responses [Hz]; half the sample rate says what a white
        response would scatter, the least possible.

    Returns
    -------
    dict of str to ndarray
        In the unit of each value; NaN where the value is.

    Examples
    --------
    >>> octave = uncertainties({"T30": np.array(1.0), "T20": np.array(1.0),
    ...     "EDT": np.array(1.0), "C50": np.array(0.0)}, 0.71 * 125)
    >>> round(float(octave["T30"]), 3), round(float(octave["C50"]), 1)
    (0.064, 2.4)
    """
    result = {
        name: share * np.sqrt(np.asarray(values[name]) / bandwidth)
        for name, share in TIME_SCATTER.items()
    }
    time = np.where(np.isnan(values["T20"]), values["EDT"], values["T20"])
    for name, split in (("C50", 0.05), ("C80", 0.08)):
        if name in values:
            relative = _split_scatter(time, split, bandwidth)
            result[name] = np.where(np.isnan(values[name]), np.nan, relative)
    if "D50" in values:
        share = np.asarray(values["D50"])
        neper = result["C50"] * np.log(10.0) / 10.0
        result["D50"] = share * (1.0 - share) * neper
    return result


def _split_scatter(
    time: FloatArray, split: float, bandwidth: float | FloatArray
) -> FloatArray:
    """Return the standard deviation of 10 lg(early/late) [dB]."""
    rate = 6.0 * np.log(10.0) / time
    left = np.exp(-rate * split)
    late = 0.5 * rate / bandwidth
    early = late * (1.0 + left) / (1.0 - left)
    return np.asarray(10.0 / np.log(10.0) * np.sqrt(early + late))
