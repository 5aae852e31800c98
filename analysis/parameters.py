"""Room-acoustic parameters of responses by ISO 3382, noise handled, NaN if unknown."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.decay.answer import FACTS, VALUES, Answers
from analysis.decay.words import REASONS, flag_words
from analysis.scatter import uncertainties
from analysis.threads import share_rows
from rir.arrays import FloatArray
from rir.errors import SignalError

__all__ = [
    "AcousticParameters",
    "acoustic_parameters",
    "as_responses",
    "assemble",
    "check_rate",
]


class AcousticParameters(dict[str, Any]):
    """Parameters by name, with flags, reasons, and how far to trust them.

    A plain dict of ``EDT``, ``T20``, ``T30``, ``TS`` [s], ``C50``, ``C80``, ``DRR``
    [dB] and ``D50`` [1], arrays of the responses' leading shape with NaN where a
    value cannot be known; ``flags``, a list of words for one response, nested lists
    for several; ``reasons``, a dict (nested lists of dicts) from the name of each
    NaN value to why.

    Attributes
    ----------
    uncertainty : dict of str to ndarray
        Standard deviation of one realisation, in the unit of the value.
    range_available : ndarray
        Fall of the decay curve before it meets the noise or the end [dB].
    noise_floor : ndarray
        Mean square of the noise re the square of the response's peak [dB].
    inr : ndarray
        Impulse-to-noise ratio, the negative of it [dB] (ISO 3382-1, 3.5).
    nonlinearity : dict of str to ndarray
        1000 (1 - r^2) of the lines of T20 and T30 [permille], ISO 3382-2 B.2.
    curvature : ndarray
        100 (T30/T20 - 1) [%], ISO 3382-2 B.3; suspicious above 10.
    onset : ndarray
        Time of the direct sound [s].
    crossing : ndarray
        Time from the direct sound to where decay and noise meet, or the end [s].
    late_time : ndarray
        Reverberation time of the last 25 dB above the noise [s].
    """

    uncertainty: dict[str, FloatArray]
    range_available: FloatArray
    noise_floor: FloatArray
    inr: FloatArray
    nonlinearity: dict[str, FloatArray]
    curvature: FloatArray
    onset: FloatArray
    crossing: FloatArray
    late_time: FloatArray


def as_responses(samples: ArrayLike) -> FloatArray:
    """Return responses as float64 of shape (..., n); masked samples become NaN.

    Raises
    ------
    SignalError
        If there are no samples, they are not real numbers, or time is not last.
    """
    array = _read_numbers(samples)
    if array.dtype.kind not in "fiub":
        raise SignalError(f"responses must be real numbers, not {array.dtype}")
    if array.ndim == 0 or array.size == 0:
        raise SignalError(f"responses need samples; got shape {array.shape}")
    if array.ndim > 1 and array.shape[-1] <= 16 and array.shape[-2] >= 256:
        raise SignalError(
            f"time goes last, but shape {array.shape} looks time first; transpose it"
        )
    if array.dtype.kind == "u":
        middle = 2.0 ** (8 * array.dtype.itemsize - 1)
        return array.astype(np.float64) - middle
    return _to_float64(array)


def _read_numbers(samples: ArrayLike) -> NDArray[Any]:
    """Return any array-like as an array of numbers.

    Raises
    ------
    SignalError
        If it is ragged or holds something else.
    """
    try:
        if isinstance(samples, np.ma.MaskedArray):
            return np.ma.filled(samples.astype(np.float64), np.nan)
        array = np.asarray(samples)
        return array.astype(np.float64) if array.dtype == object else array
    except (TypeError, ValueError) as error:
        raise SignalError(f"responses must be real numbers: {error}") from error


def check_rate(sample_rate: float) -> float:
    """Return a sample rate, whole or not [Hz].

    Raises
    ------
    SignalError
        If it is no positive number.

    Examples
    --------
    >>> check_rate(22050.5)
    22050.5
    """
    try:
        rate = float(sample_rate)
    except (TypeError, ValueError):
        rate = float("nan")
    if not 1.0 <= rate < np.inf or isinstance(sample_rate, str | bool):
        raise SignalError(f"sample rate must be a positive number, not {sample_rate!r}")
    return rate


def _to_float64(array: NDArray[Any]) -> FloatArray:
    if array.dtype.itemsize > 8:
        largest = np.max(np.abs(array))
        if 0 < largest < np.inf:
            array = array / largest
    return np.ascontiguousarray(array, dtype=np.float64)


def acoustic_parameters(
    samples: ArrayLike, sample_rate: float, *, threads: int = 1
) -> AcousticParameters:
    """Estimate EDT, T20, T30, C50, C80, DRR, D50 and centre time of responses.

    Each response is handled alone: offset removed, direct sound found 20 dB under
    the peak (higher where noise reaches that), decay and noise fitted, the decay
    curve freed from the noise and closed behind the crossing, lines fitted to it. A
    time is given only if curve and noise meet 3 dB below the end of its range.

    Parameters
    ----------
    samples : array_like, shape (..., n_samples)
        Responses, time last, in any real number type and at any scale.
    sample_rate : float
        Samples per second [Hz].
    threads : int
        How many responses are analysed at once; the answers do not depend on it.

    Returns
    -------
    found : dict
        A dict of arrays of shape (...): ``EDT``, ``T20``, ``T30``, ``TS`` [s],
        ``C50``, ``C80``, ``DRR`` [dB], ``D50``; NaN where it cannot be known, with
        ``flags`` and ``reasons``; more in its attributes.

    Raises
    ------
    SignalError
        If there are no samples, they are not real numbers, time is not the last
        axis, or the rate is not a positive number.

    References
    ----------
    ISO 3382-1:2009, 5.3.3 and annex A; ISO 3382-2:2008, annexes A and B.
    DRR: direct sound up to 2.5 ms after its peak (Zahorik, JASA 112, 2002).

    Examples
    --------
    >>> sign = np.random.default_rng(0).choice([-1, 1], 48000)
    >>> decay = sign * 10 ** (-3 * np.arange(48000) / 48000 / 0.5)
    >>> found = acoustic_parameters(decay, 48000)
    >>> round(float(found["T30"]), 3), round(float(found["C80"]), 2)
    (0.5, 9.1)
    >>> acoustic_parameters(np.zeros(48000), 48000)["flags"]
    ['silent']
    """
    from analysis.decay.response import analyse_responses

    rate = check_rate(sample_rate)
    responses = as_responses(samples)
    rows = responses.reshape(-1, responses.shape[-1])
    answers = Answers.empty(len(rows))

    def work(first: int, last: int) -> None:
        analyse_responses(rows[first:last], rate, answers.part(first, last))

    share_rows(work, len(rows), threads)
    return assemble(answers, responses.shape[:-1], 0.5 * rate)


def assemble(
    answers: Answers, shape: tuple[int, ...], bandwidth: float | FloatArray
) -> AcousticParameters:
    """Return the parameters of filled answers in the responses' shape."""
    result = AcousticParameters()
    for place, name in enumerate(VALUES):
        result[name] = answers.values[:, place].reshape(shape)
    result["flags"] = nest([flag_words(int(bits)) for bits in answers.flags], shape)
    result["reasons"] = nest([_reasons(row) for row in answers.reasons], shape)
    _describe(result, answers.facts, shape)
    result.uncertainty = uncertainties(result, bandwidth)
    return result


def _reasons(codes: NDArray[np.int64]) -> dict[str, str]:
    pairs = zip(VALUES, codes, strict=True)
    return {name: REASONS[code] for name, code in pairs if code}


def _describe(
    result: AcousticParameters, facts: FloatArray, shape: tuple[int, ...]
) -> None:
    columns = {name: facts[:, place].reshape(shape) for place, name in enumerate(FACTS)}
    result.range_available = columns["range"]
    result.noise_floor = _decibels(columns["noise"])
    result.inr = -result.noise_floor
    result.curvature = columns["curvature"]
    result.nonlinearity = {"T20": columns["xi20"], "T30": columns["xi30"]}
    result.onset = columns["onset"]
    result.crossing = columns["crossing"]
    result.late_time = columns["late"]


def _decibels(square: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return 10.0 * np.log10(square)


def nest(items: Sequence[Any], shape: tuple[int, ...]) -> Any:
    """Return items as nested lists of a shape; the item itself for shape ()."""
    if not shape:
        return items[0]
    step = len(items) // shape[0] if shape[0] else 0
    return [nest(items[k * step : (k + 1) * step], shape[1:]) for k in range(shape[0])]
