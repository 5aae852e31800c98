"""Sound strength G: how much louder the room makes a source than 10 m of free field."""

import numpy as np
from numpy.typing import ArrayLike

from analysis.decay.response import sample_at
from analysis.parameters import acoustic_parameters, as_responses, check_rate
from rir.arrays import FloatArray
from rir.bands import Band, bands_of, cached_weights
from rir.errors import SignalError

__all__ = ["reference_energy", "strength"]

REFERENCE_DISTANCE = 10.0
"""Distance of the reference in the free field, m."""
LEAD = 0.005
"""Energy is counted from this long before the direct sound, s."""


def _energy(samples: FloatArray, rate: float, bands: tuple[Band, ...]) -> FloatArray:
    """Return the energy of one response, shape (), or of its bands, shape (bands,)."""
    if not bands:
        return np.asarray(samples @ samples)
    power = np.abs(np.fft.rfft(samples)) ** 2
    return power[1:] @ cached_weights(bands, rate, len(samples)).astype(np.float64)


def _bands(centers: ArrayLike | None) -> tuple[Band, ...]:
    if centers is None:
        return ()
    return bands_of(centers, None, zero_phase=False)


def reference_energy(
    samples: ArrayLike,
    sample_rate: float,
    distance: float,
    centers: ArrayLike | None = None,
) -> FloatArray:
    """Return the energy a source has at 10 m in the free field.

    Parameters
    ----------
    samples : array_like, shape (n_samples,) or (angles, n_samples)
        Free-field responses of the same source, chain and gains, reflections cut off;
        several around the source are averaged in energy.
    sample_rate : float
        Samples per second [Hz].
    distance : float
        Distance of the microphone then [m]; 3 m or more, by the standard.
    centers : array_like, shape (n_bands,), optional
        Nominal band centres [Hz]; the full band without.

    Returns
    -------
    energy : ndarray, shape () or (n_bands,)

    Raises
    ------
    SignalError
        If there is no sound in it, or the distance is not positive.

    References
    ----------
    ISO 3382-1:2009, A.2.1, equations A.1 to A.3.

    Examples
    --------
    >>> pulse = np.zeros(4800)
    >>> pulse[419] = 1 / 3
    >>> round(float(reference_energy(pulse, 48000, 3.0)), 6)
    0.01
    """
    rate = check_rate(sample_rate)
    rows = as_responses(samples)
    if not 0.0 < distance < np.inf:
        raise SignalError(f"the reference's distance must be positive, not {distance}")
    bands = _bands(centers)
    rows = rows.reshape(-1, rows.shape[-1])
    energy = np.mean([_energy(row, rate, bands) for row in rows], axis=0)
    if not np.all(np.isfinite(energy) & (energy > 0.0)):
        raise SignalError("the free-field reference holds no sound in some band")
    return energy * (distance / REFERENCE_DISTANCE) ** 2


def strength(
    samples: ArrayLike,
    sample_rate: float,
    reference: ArrayLike,
    centers: ArrayLike | None = None,
) -> FloatArray:
    """Return the sound strength G of responses.

    Energy is counted from the direct sound to where decay and noise meet; the noise
    below it is taken off.

    Parameters
    ----------
    samples : array_like, shape (..., n_samples)
        Responses of the calibrated chain, time last.
    sample_rate : float
        Samples per second [Hz].
    reference : array_like, shape () or (n_bands,)
        Answer of `reference_energy` for the same centres.
    centers : array_like, shape (n_bands,), optional
        Nominal band centres [Hz]; the full band without.

    Returns
    -------
    strength : ndarray, shape (...) or (..., n_bands)
        G [dB]; NaN where the response has no decay that can be told from its noise.

    Raises
    ------
    SignalError
        As `acoustic_parameters`; or if the reference does not fit the centres.

    References
    ----------
    ISO 3382-1:2009, A.2.1, equation A.1.

    Examples
    --------
    >>> sign = np.random.default_rng(0).choice([-1, 1], 48000)
    >>> decay = 0.1 * sign * 10 ** (-3 * np.arange(48000) / 48000 / 0.5)
    >>> round(float(strength(decay, 48000, 0.01)), 1)
    32.4
    """
    rate = check_rate(sample_rate)
    responses = as_responses(samples)
    bands = _bands(centers)
    level = np.asarray(reference, dtype=np.float64)
    shape = (len(bands),) if bands else ()
    if level.shape != shape or not np.all(level > 0.0):
        raise SignalError(
            f"the reference must be {shape or 'one number'} and positive, as "
            f"reference_energy gives it for the same centres; not {level.tolist()}"
        )
    found = acoustic_parameters(responses, rate)
    answers = np.full((*responses.shape[:-1], *shape), np.nan)
    for index in np.ndindex(*responses.shape[:-1]):
        onset, length = float(found.onset[index]), float(found.crossing[index])
        if np.isfinite(onset + length):
            energy = _net_energy(responses[index], rate, onset, length, bands)
            with np.errstate(divide="ignore", invalid="ignore"):
                answers[index] = 10.0 * np.log10(energy / level)
    return np.where(np.isfinite(answers), answers, np.nan)


def _net_energy(
    samples: FloatArray,
    rate: float,
    onset: float,
    length: float,
    bands: tuple[Band, ...],
) -> FloatArray:
    """Return the energy of the decay with that of the noise below it taken off."""
    first = sample_at(max(0.0, onset - LEAD), rate)
    last = min(len(samples), sample_at(onset + length, rate))
    energy = _energy(samples[first:last], rate, bands)
    behind = samples[last:]
    if len(behind) < last - first:
        return energy
    noise = _energy(behind, rate, bands) / len(behind)
    net = energy - noise * (last - first)
    return np.where(net > 0.0, net, np.nan)
