"""Room-acoustic parameters per octave or third octave."""

import numpy as np
from numpy.typing import ArrayLike

from analysis.decay.answer import Answers
from analysis.parameters import AcousticParameters, as_responses, assemble, check_rate
from analysis.threads import share_rows
from rir.bands import bands_of

__all__ = ["band_parameters"]


def band_parameters(
    samples: ArrayLike,
    sample_rate: float,
    centers: ArrayLike,
    *,
    fraction: int | None = None,
    zero_phase: bool = False,
    threads: int = 1,
) -> AcousticParameters:
    """Estimate room-acoustic parameters per frequency band.

    The direct sound is found in the full band. Times come from each band's own
    curve; clarity, definition and DRR from gating first and filtering afterwards, so
    that a filter's ringing moves no energy across the split.

    Parameters
    ----------
    samples : array_like, shape (..., n_samples)
        Responses, time last.
    sample_rate : float
        Samples per second [Hz].
    centers : array_like, shape (n_bands,)
        Nominal band centres [Hz].
    fraction : {None, 1, 3}
        1 for octaves, 3 for third octaves; None: thirds if one centre is no octave's.
    zero_phase : bool
        Filter forward and backward: twice the attenuation of one pass. Bands have no
        delay either way.
    threads : int
        How many groups of responses are analysed at once; the answers do not depend
        on it.

    Returns
    -------
    found : dict
        As `acoustic_parameters`, with a last axis of bands; times are NaN where
        bandwidth times reverberation time is below 12.5 (below 16 they are flagged
        ``short_BT``), all is where the band does not fit.

    Raises
    ------
    SignalError
        As `acoustic_parameters`; or if a centre is no positive frequency.

    References
    ----------
    IEC 61260-1:2014, class 1; ISO 3382-1:2009, 7.3.

    Examples
    --------
    >>> wave = np.random.default_rng(0).standard_normal(96000)
    >>> decay = wave * 10 ** (-3 * np.arange(96000) / 48000 / 1.0)
    >>> found = band_parameters(decay, 48000, [500, 1000, 2000])
    >>> found["T30"].round(1)
    array([1., 1., 1.])
    """
    from analysis.band_rows import CHUNK, analyse_bands

    rate = check_rate(sample_rate)
    responses = as_responses(samples)
    bands = bands_of(centers, fraction, zero_phase=zero_phase)
    rows = responses.reshape(-1, responses.shape[-1])
    answers = Answers.empty(len(rows) * len(bands))

    def work(first: int, last: int) -> None:
        part = answers.part(first * len(bands), last * len(bands))
        analyse_bands(rows[first:last], rate, bands, part)

    share_rows(work, len(rows), threads, CHUNK)
    widths = np.array([band.width for band in bands])
    return assemble(answers, (*responses.shape[:-1], len(bands)), widths)
