"""The synchronized exponential sweep that a session plays."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir.errors import SignalError

__all__ = ["Sweep", "synchronized_sweep"]

SHORTEST_FADE = 0.002  # s: a click of a sudden end is spread over 500 Hz


class Sweep(np.ndarray):
    """Samples of a synchronized exponential sweep that remember how they were made.

    A plain float64 array of shape (n,) in every computation; what is computed from
    it (a slice, a sum) is an ordinary array again.

    Attributes
    ----------
    f1, f2 : float
        First and last instantaneous frequency, Hz.
    rate : float
        Seconds in which the frequency grows by e (the L of the literature).
    period_count : int
        ``f1 * rate``, an integer: this makes the harmonics' phases come out right.
    duration : float
        Length, s.
    amplitude : float
        Peak value, 1 is full scale.
    band : tuple of float
        Frequencies between which no fade touches the sweep, Hz.
    sample_rate : float
        Sampling rate, Hz.
    """

    f1: float
    f2: float
    rate: float
    period_count: int
    duration: float
    amplitude: float
    band: tuple[float, float]
    sample_rate: float

    def __array_finalize__(self, obj: object) -> None:
        """Leave derived arrays without parameters; they are no sweeps any more."""

    def __array_wrap__(
        self,
        array: NDArray[Any],
        context: object = None,
        return_scalar: bool = False,
    ) -> Any:
        """Give back plain arrays and scalars from every computation."""
        return array[()] if return_scalar else np.asarray(array)

    def __getitem__(self, key: Any) -> Any:
        """Give back plain arrays and scalars from every index."""
        return np.asarray(self)[key]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the parameters together with the samples."""
        return _restore, (np.array(self), self.__dict__)

    def describe(self) -> dict[str, float | int | list[float]]:
        """Return the parameters as plain numbers, for files and journals."""
        return {
            "f1": self.f1,
            "f2": self.f2,
            "rate": self.rate,
            "period_count": self.period_count,
            "duration": self.duration,
            "amplitude": self.amplitude,
            "band": list(self.band),
            "sample_rate": self.sample_rate,
            "n_samples": self.size,
        }


def synchronized_sweep(
    f1: float,
    f2: float,
    duration: float,
    sample_rate: float,
    *,
    band: tuple[float, float] | None = None,
    amplitude: float = 0.5,
) -> Sweep:
    """Make a synchronized exponential sine sweep in float64.

    The duration is changed a little so that ``f1 * rate`` is an integer; only then
    have the harmonic responses of a distorting loudspeaker their true phases.

    Parameters
    ----------
    f1, f2 : float
        Swept range, Hz, ``0 < f1 < f2 <= sample_rate / 2``. Sweep wider than the
        band you want to measure: the fades need room outside it.
    duration : float
        Wanted length, s.
    sample_rate : float
        Sampling rate, Hz.
    band : tuple of float, optional
        The part (low, high) that stays untouched, Hz: the sweep fades in between
        `f1` and low and out between high and `f2`. Left out, the fades are short
        ones at the very ends.
    amplitude : float
        Peak value; the default leaves 6 dB for peaks between samples.

    Returns
    -------
    Sweep
        Array of shape (n,), usable as the signal itself.

    Raises
    ------
    SignalError
        If the range, the band, or the duration cannot be had.

    References
    ----------
    Novak, Lotton, Simon, JAES 63 (2015): ``x = sin(2 pi f1 L (exp(t/L) - 1))`` with
    ``f1 L`` an integer.

    Examples
    --------
    >>> sweep = synchronized_sweep(10, 22000, 3.0, 48000, band=(20, 20000))
    >>> sweep.period_count, round(sweep.duration, 3), sweep.dtype.name
    (4, 3.078, 'float64')
    """
    _check(f1, f2, duration, sample_rate, band)
    octaves = np.log(f2 / f1)
    count = max(1, round(f1 * duration / octaves))
    rate = count / f1
    length = rate * octaves
    times = np.arange(round(length * sample_rate)) / sample_rate
    samples = amplitude * np.sin(2 * np.pi * count * np.expm1(times / rate))
    low, high = band or (f1 * 2 ** (1 / 24), f2 * 2 ** (-1 / 48))
    _fade(samples, rate * np.log(low / f1), sample_rate)
    _fade(samples[::-1], length - rate * np.log(high / f1), sample_rate)
    return _restore(
        samples,
        {
            "f1": float(f1),
            "f2": float(f2),
            "rate": float(rate),
            "period_count": count,
            "duration": float(length),
            "amplitude": float(amplitude),
            "band": (float(low), float(high)),
            "sample_rate": float(sample_rate),
        },
    )


def _restore(samples: NDArray[np.float64], parameters: Mapping[str, Any]) -> Sweep:
    sweep = samples.view(Sweep)
    for name, value in parameters.items():
        setattr(sweep, name, value)
    return sweep


def _fade(samples: NDArray[np.float64], seconds: float, sample_rate: float) -> None:
    count = round(max(seconds, SHORTEST_FADE) * sample_rate)
    count = min(count, samples.size // 2)
    samples[:count] *= np.sin(np.pi / 2 * np.arange(count) / count) ** 2


def _check(
    f1: float,
    f2: float,
    duration: float,
    sample_rate: float,
    band: tuple[float, float] | None,
) -> None:
    if not 0 < f1 < f2 <= sample_rate / 2:
        raise SignalError(
            f"a sweep from {f1:g} to {f2:g} Hz at {sample_rate:g} Hz cannot be made; "
            f"ask for 0 < f1 < f2 <= {sample_rate / 2:g} Hz"
        )
    if not (np.isfinite(duration) and duration * sample_rate >= 64):
        raise SignalError(
            f"a sweep of {duration:g} s has fewer than 64 samples; make it longer"
        )
    if band is not None and not f1 <= band[0] < band[1] <= f2:
        raise SignalError(
            f"the flat band {band[0]:g}-{band[1]:g} Hz lies not inside the sweep "
            f"{f1:g}-{f2:g} Hz; widen the sweep or narrow the band"
        )
