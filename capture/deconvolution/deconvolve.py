"""From recording and excitation to impulse responses with a finding."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks.finding import Finding, TakeLimits
from capture.deconvolution.takes import combine
from capture.signal.arrangement import arrange, as_float
from capture.signal.excitation import Excitation
from capture.signal.reference import SweepReference, refer
from rir.errors import SignalError

__all__ = ["Deconvolution", "deconvolve"]

Array = NDArray[np.float64]

DEFAULT_LENGTH_S = 0.1  # where the recording ends with the sweep: the early sound


@dataclass(frozen=True, eq=False)
class Deconvolution:
    """Responses and what was found on the way to them.

    Attributes
    ----------
    response : ndarray, shape (..., pre + length)
        Impulse responses; sample `pre` is the emission. Unit: recorded over looped
        back, or recorded over played without a loopback. Never normalised.
    sample_rate : float
        Sampling rate, Hz, of the player's clock.
    pre : int
        Samples before the emission.
    latency : float
        Samples from the recording's first sample to the emission, as the loopback
        tells it; NaN without one.
    drift_ppm : float
        How much faster the recording runs through the excitation than it was
        played, in parts per million; the response is corrected for it. NaN without
        a loopback.
    findings : tuple of Finding
        All that the checks found.
    figures : dict
        Every number the checks found, ready for JSON.
    takes : tuple of Deconvolution
        The single takes, when several were handed in.
    accepted : tuple of bool
        Which takes are in the response.
    """

    response: Array
    sample_rate: float
    pre: int
    latency: float = np.nan
    drift_ppm: float = np.nan
    findings: tuple[Finding, ...] = ()
    figures: dict[str, Any] = field(default_factory=dict)
    takes: tuple["Deconvolution", ...] = ()
    accepted: tuple[bool, ...] = ()

    @property
    def flags(self) -> tuple[str, ...]:
        """Words of hard faults: do not trust this response, take it again."""
        return _words(finding for finding in self.findings if finding.hard)

    @property
    def marks(self) -> tuple[str, ...]:
        """Words of what was noticed and does no harm, or was corrected."""
        return _words(finding for finding in self.findings if not finding.hard)

    @property
    def reasons(self) -> tuple[str, ...]:
        """One sentence for each finding, with its figure."""
        return tuple(finding.text for finding in self.findings)


def _words(findings: Iterable[Finding]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(finding.word for finding in findings))


def deconvolve(
    recording: NDArray[Any],
    excitation: NDArray[Any],
    sample_rate: float,
    *,
    loopback: NDArray[Any] | None = None,
    band: tuple[float, float] | None = None,
    length: int | None = None,
    pre: int = 0,
    golden: NDArray[Any] | None = None,
    direct_delay: NDArray[Any] | float | None = None,
    limits: TakeLimits | None = None,
    checks: bool = True,
) -> Deconvolution:
    """Recover impulse responses from a recorded sweep, and judge the take.

    With a loopback the response is what the microphones heard over what the cable
    heard: latency, its fraction, the converters and a drift of the clocks are gone,
    and the noise of the loopback does not enter. Without one, sample 0 of the
    recording counts as the emission.

    Parameters
    ----------
    recording : ndarray, shape (..., n) or (takes, channels, n)
        What was recorded; integers are scaled to full scale 1. Three axes mean
        takes of the same channels, which are combined without the bad ones.
    excitation : ndarray, shape (m,)
        What was played.
    sample_rate : float
        Sampling rate of both, Hz.
    loopback : ndarray, shape (n,) or (takes, n), optional
        What came back by cable on an input of the same device.
    band : tuple of float, optional
        (low, high), Hz: flat inside, rolled off outside. Left out: what the
        excitation covers.
    length : int, optional
        Samples to keep from the emission on. Left out: as many as the recording
        holds after the excitation.
    pre : int
        Samples to keep before the emission.
    golden : ndarray, shape (n,), optional
        The first good loopback of the session, to compare this one with.
    direct_delay : float or ndarray, optional
        When the direct sound should come, s, per channel.
    limits : TakeLimits, optional
        What is tolerated.
    checks : bool
        Whether the take is judged. Without, flags, marks and figures stay empty, and
        a large array takes about half the time.

    Returns
    -------
    Deconvolution
        Responses, latency, drift, flags, marks, reasons and figures.

    Raises
    ------
    SignalError
        If a shape, rate, band or length cannot be meant.

    Examples
    --------
    >>> from capture import synchronized_sweep
    >>> sweep = synchronized_sweep(50, 20000, 0.5, 48000)
    >>> played = np.concatenate((sweep, np.zeros(4800)))
    >>> heard = 0.5 * np.roll(played, 240) + 0.2 * np.roll(played, 700)
    >>> result = deconvolve(heard, sweep, 48000, loopback=played, length=2400, pre=480)
    >>> int(np.argmax(result.response))
    720
    """
    # Imported here because the checks are heavier than what most callers of this
    # module's types need.
    from capture.checks.run import check_take, divide_only

    arranged = arrange(recording, loopback)
    played = as_float(np.asarray(excitation)).ravel()
    n = arranged.takes.shape[-1]
    _check_lengths(sample_rate, length, pre)
    grid = Excitation(
        played,
        sample_rate,
        n,
        length=_default_length(n, played.size, sample_rate)
        if length is None
        else length,
        pre=pre,
        band=band,
    )
    gold = None if golden is None else refer(grid, _fit(golden, n))
    delays = None if direct_delay is None else np.asarray(direct_delay, dtype=float)
    results = [
        check_take(take, refer(grid, looped), gold, delays, limits or TakeLimits())
        if checks
        else divide_only(take, refer(grid, looped))
        for take, looped in zip(arranged.takes, arranged.loopbacks, strict=True)
    ]
    single = [
        _result(found.response, found.reference, found.findings, found.figures, pre)
        for found in results
    ]
    if arranged.several and len(single) > 1:
        return _combined(single)
    first = single[0]
    takes = (first,) if arranged.several else ()
    return Deconvolution(
        first.response.reshape(*arranged.shape, -1),
        first.sample_rate,
        pre,
        first.latency,
        first.drift_ppm,
        first.findings,
        first.figures,
        takes,
        (not first.flags,) if arranged.several else (),
    )


def _result(
    response: Array,
    reference: SweepReference,
    findings: tuple[Finding, ...],
    figures: dict[str, Any],
    pre: int,
) -> Deconvolution:
    clock = reference.clock
    known = np.isfinite(clock.latency)
    return Deconvolution(
        response,
        reference.excitation.sample_rate,
        pre,
        float(clock.latency),
        1e6 * clock.drift if known else np.nan,
        findings,
        figures,
    )


def _combined(takes: list[Deconvolution]) -> Deconvolution:
    result = combine(
        np.stack([take.response for take in takes]),
        [bool(take.flags) for take in takes],
    )
    findings = list(result.findings)
    for number, take in enumerate(takes):
        if result.accepted[number] or not result.any_clean:
            findings += take.findings
        else:
            findings += [finding for finding in take.findings if finding.hard]
    kept = [take for take, used in zip(takes, result.accepted, strict=True) if used]
    figures = {
        **kept[0].figures,
        "take_distance_db": result.distances_db,
        "takes_used": sum(result.accepted),
    }
    return Deconvolution(
        result.response,
        takes[0].sample_rate,
        takes[0].pre,
        float(np.median([take.latency for take in kept])),
        float(np.median([take.drift_ppm for take in kept])),
        tuple(findings),
        figures,
        tuple(takes),
        result.accepted,
    )


def _check_lengths(sample_rate: float, length: int | None, pre: int) -> None:
    if not (np.isfinite(sample_rate) and sample_rate > 0):
        raise SignalError(f"a sample rate of {sample_rate} Hz cannot be; it is above 0")
    if pre < 0 or (length is not None and length < 1):
        raise SignalError(
            f"length {length} and pre {pre} samples cannot be kept; ask for length "
            "of at least 1 and pre of at least 0"
        )


def _default_length(n: int, m: int, sample_rate: float) -> int:
    return max(n - m, round(DEFAULT_LENGTH_S * sample_rate))


def _fit(golden: NDArray[Any], n: int) -> Array:
    row = as_float(golden).ravel()
    fitted = np.zeros(n)
    fitted[: min(n, row.size)] = row[:n]
    return fitted
