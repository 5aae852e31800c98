"""How close the two directions of a pair are, and how close they could be."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from capture.signal.stretch import apply_stretch, estimate_stretch, low_passed
from rir.arrays import FloatArray
from rir.bands import octave_centers, octave_energies
from rir.onset import find_onset
from rir.physics import STRETCH_PER_KELVIN, speed_of_sound

__all__ = ["OneWay", "judge_pair", "octave_distances", "predicted_floor"]

SAME_PLACE_MS = 0.1  # 3.4 cm of sound: more than any careful placing errs
SAME_START = 0.9  # millimetres of placing leave more; a moved stand leaves less
EARLY_S = 0.05  # first reflections of a room: what a wrong stand changes
EARLY_HZ = 1000.0  # half a wavelength is 17 cm: millimetres do not matter
DIRECT_S = 0.002  # 2 ms before the onset to 6 ms after: little but direct sound
FINENESS = 16  # of a sample: 1.3 µs at 48 kHz, a hundredth of the limit
OCTAVE_SHARES = np.linspace(0.75, 1.35, 5)
"""Frequencies of an octave over its centre, evenly spread like white noise."""


@dataclass(frozen=True, eq=False)
class OneWay:
    """One direction of a pair."""

    response: FloatArray
    """Samples from the emission on. Shape (n,)."""
    temperature_c: float
    """Air temperature [°C], NaN if nobody measured it."""
    noise: FloatArray
    """Noise energy of the response over its signal energy, per octave. Shape
    (octaves,)."""


def bands(sample_rate: int, lowest: float, highest: float) -> FloatArray:
    """Return the octave centres that lie inside a session's band [Hz]."""
    centers = octave_centers(31.5, 16000.0)
    top = min(highest, 0.5 * sample_rate)
    inside = (centers / np.sqrt(2) >= lowest) & (centers * np.sqrt(2) <= top * 1.01)
    return centers[inside]


def octave_distances(
    first: FloatArray, second: FloatArray, sample_rate: int, centers: FloatArray
) -> FloatArray:
    """Return the relative waveform difference per octave [dB], shape (octaves,).

    The energy of the difference over the mean energy of the two.
    """
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * len(first), real=True)
    one, other = fft.rfft(first, n), fft.rfft(second, n)
    difference = octave_energies(np.abs(one - other) ** 2, n, sample_rate, centers)
    energy = octave_energies(
        (np.abs(one) ** 2 + np.abs(other) ** 2) / 2, n, sample_rate, centers
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        return 10 * np.log10(difference / energy)


def noise_share(
    silence: FloatArray,
    reference: FloatArray,
    response: FloatArray,
    sample_rate: int,
    centers: FloatArray,
) -> FloatArray:
    """Return the noise energy in a response over its signal energy, per octave.

    Parameters
    ----------
    silence : ndarray, shape (n,)
        What the microphone heard before the sweep.
    reference : ndarray, shape (m,)
        The sweep, or its loopback: what the response was divided by.
    response : ndarray, shape (k,)
        The response.
    sample_rate : int
        Rate [Hz].
    centers : ndarray, shape (octaves,)
        Octave centres [Hz].
    """
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(max(len(reference), 2 * len(response)), real=True)
    divisor = np.abs(fft.rfft(reference, n)) ** 2
    heard = np.abs(fft.rfft(silence[:n], n)) ** 2 * len(response) / len(silence[:n])
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.where(divisor > 0, heard / divisor, 0.0)
    signal = np.abs(fft.rfft(response, n)) ** 2
    return octave_energies(noise, n, sample_rate, centers) / octave_energies(
        signal, n, sample_rate, centers
    )


def predicted_floor(
    response: FloatArray,
    sample_rate: int,
    centers: FloatArray,
    *,
    noise: FloatArray,
    position_sigma_m: float,
    temperature_change_c: float,
    temperature_c: float = 20.0,
) -> FloatArray:
    """Return how close two directions can be expected to be, per octave [dB].

    Parameters
    ----------
    response : ndarray, shape (n,)
        One of the two; its energy over time weighs what temperature does.
    sample_rate : int
        Rate [Hz].
    centers : ndarray, shape (octaves,)
        Octave centres [Hz].
    noise : ndarray, shape (octaves,)
        Noise over signal energy of both directions together.
    position_sigma_m : float
        Standard deviation of a device's place per axis [m].
    temperature_change_c : float
        Difference of air temperature between the directions [K].
    temperature_c : float
        Air temperature [°C].

    Notes
    -----
    Each of the four placements shifts the phase of a path by ``2 π f σ / c`` rms,
    so that the squared difference of two unit phasors is on average
    ``2 (1 - exp(-2 (2 π f σ / c)²))``. A change of temperature turns the phase at
    time t by ``2 π f t ΔT / (2 T)``. The three are independent and add up.
    """
    energy = response**2 / np.sum(response**2)
    times = np.arange(len(response)) / sample_rate
    lag = STRETCH_PER_KELVIN * temperature_change_c * times
    rest = np.zeros(len(centers))
    for share in OCTAVE_SHARES:
        frequencies = centers * share
        wave_number = 2 * np.pi * frequencies / speed_of_sound(temperature_c)
        rest += 2 * (1 - np.exp(-2 * (wave_number * position_sigma_m) ** 2))
        if temperature_change_c:
            turns = np.cos(2 * np.pi * np.outer(frequencies, lag))
            rest += 2 * (1 - turns) @ energy
    total = noise + rest / len(OCTAVE_SHARES)
    with np.errstate(divide="ignore"):
        return 10 * np.log10(np.minimum(total, 2.0))


def judge_pair(
    forward: OneWay,
    reverse: OneWay,
    sample_rate: int,
    *,
    band_hz: tuple[float, float],
    position_sigma_m: float = 0.0,
) -> dict[str, Any]:
    """Compare the two directions of a pair.

    Parameters
    ----------
    forward, reverse : OneWay
        The directions.
    sample_rate : int
        Rate [Hz].
    band_hz : tuple of float
        The session's band.
    position_sigma_m : float
        Standard deviation of a device's place per axis [m].

    Returns
    -------
    dict
        Octaves [Hz]; measured, stretch-compensated and predicted difference and
        level difference per octave [dB]; stretch [ppm]; difference of the direct
        sound's arrival [ms]; correlation of the first 50 ms; temperature change
        [K]; and ``doubts``, a list of what looks wrong.
    """
    centers = bands(sample_rate, *band_hz)
    one, other = forward.response, reverse.response
    stretch, shift = estimate_stretch(one, other, sample_rate)
    laid_over = apply_stretch(one, stretch, shift)
    change = reverse.temperature_c - forward.temperature_c
    figures: dict[str, Any] = {
        "octaves_hz": centers,
        "measured_db": octave_distances(one, other, sample_rate, centers),
        "compensated_db": octave_distances(laid_over, other, sample_rate, centers),
        "predicted_db": predicted_floor(
            one,
            sample_rate,
            centers,
            noise=forward.noise + reverse.noise,
            position_sigma_m=position_sigma_m,
            temperature_change_c=np.nan_to_num(change),
        ),
        "level_db": _levels(one, other, sample_rate, centers),
        "stretch_ppm": 1e6 * stretch,
        "arrival_ms": 1e3 * arrival_difference(one, other, sample_rate),
        "early_correlation": early_correlation(one, other, sample_rate),
        "temperature_change_c": change,
    }
    return {**figures, "doubts": _doubts(figures)}


def _levels(
    one: FloatArray, other: FloatArray, sample_rate: int, centers: FloatArray
) -> FloatArray:
    fft: Any = import_module("scipy.fft")
    n = fft.next_fast_len(2 * len(one), real=True)
    energies = [
        octave_energies(np.abs(fft.rfft(h, n)) ** 2, n, sample_rate, centers)
        for h in (one, other)
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        return 10 * np.log10(energies[1] / energies[0])


def arrival_difference(one: FloatArray, other: FloatArray, sample_rate: int) -> float:
    """Return how much later the direct sound arrives in the second response [s].

    Found by correlating the first milliseconds, to a fraction of a sample.
    """
    fft: Any = import_module("scipy.fft")
    begin = max(
        0, int(min(find_onset(one), find_onset(other))) - round(DIRECT_S * sample_rate)
    )
    part = slice(begin, begin + round(4 * DIRECT_S * sample_rate))
    a, b = one[part], other[part]
    n = 2 * len(a)
    product = fft.rfft(b, n) * np.conj(fft.rfft(a, n))
    fine = fft.irfft(product, n * FINENESS)
    lag = int(np.argmax(fine))
    lag -= n * FINENESS if lag > n * FINENESS // 2 else 0
    return lag / FINENESS / sample_rate


def early_correlation(one: FloatArray, other: FloatArray, sample_rate: int) -> float:
    """Return the correlation of the first 50 ms after the first arrival.

    Below 1 kHz only: there, millimetres of placing error cannot spoil it.
    """
    start = int(min(find_onset(one), find_onset(other)))
    part = slice(start, start + round(EARLY_S * sample_rate))
    a, b = (low_passed(h, EARLY_HZ, sample_rate)[part] for h in (one, other))
    return float(a @ b / np.sqrt((a @ a) * (b @ b)))


def _doubts(figures: dict[str, Any]) -> list[str]:
    doubts = []
    if abs(figures["arrival_ms"]) > SAME_PLACE_MS:
        doubts.append(
            f"direct sound arrives {figures['arrival_ms']:+.2f} ms apart in the two "
            f"directions (limit {SAME_PLACE_MS:g} ms): was the wrong stand moved?"
        )
    if figures["early_correlation"] < SAME_START:
        doubts.append(
            f"first 50 ms correlate {figures['early_correlation']:.2f} "
            f"(limit {SAME_START:g}): are the stands at the right places? Loudspeaker "
            "and microphone of unlike patterns sound unlike both ways, too"
        )
    return doubts
