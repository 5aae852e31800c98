"""Name what is wrong with a pair, by the size of what was fitted."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.likeness.fit import SwapFit
from rir.arrays import FloatArray

__all__ = ["FaultLimits", "PairFault", "Typical", "name_faults", "position_error"]


@dataclass(frozen=True)
class Typical:
    """What most pairs of a room share.

    Parameters
    ----------
    gain_db, temperature_k : float
        Median over pairs; zero with fewer than five.
    position_mm : float
        Median displacement that explains what the fits leave.
    """

    gain_db: float = 0.0
    temperature_k: float = 0.0
    position_mm: float = 0.0

    @staticmethod
    def of(fits: Sequence[SwapFit]) -> "Typical":
        """Return the medians of a room."""
        if len(fits) < 5:
            return Typical()
        places = np.array([position_error(fit) for fit in fits])
        return Typical(
            float(np.median([fit.gain_db for fit in fits])),
            float(np.median([fit.temperature_change for fit in fits])),
            float(1000 * np.nanmedian(places)) if np.isfinite(places).any() else 0.0,
        )


@dataclass(frozen=True)
class FaultLimits:
    """Sizes from which on something is called a fault.

    Each is several times what a careful session scatters; gain and temperature
    are counted from what the room's pairs typically show.
    """

    gain_db: float = 0.2
    temperature_k: float = 0.12
    position_mm: float = 2.5
    noise_db: float = 10.0
    coherence: float = 0.5
    partner: float = 0.7
    typical: Typical = Typical()

    def widened(self, typical: Typical) -> "FaultLimits":
        """Return limits for a room whose pairs are typically so far off.

        A displacement in three axes is 2.6 times its median once in a thousand.
        """
        wide = max(self.position_mm, 3.0 * typical.position_mm)
        return replace(self, position_mm=wide, typical=typical)


@dataclass(frozen=True)
class PairFault:
    """One thing wrong with a pair.

    Parameters
    ----------
    kind : {"swapped", "place", "noise", "gain", "temperature", "position", "pattern"}
    size : float
        In the unit of the kind: dB, K or mm; a correlation for swapped takes.
    words : str
        What to tell a person.
    severity : float
        Size over its limit; the largest is the likely reason.
    """

    kind: str
    size: float
    words: str
    severity: float = field(compare=False)


def position_error(fit: SwapFit, speed_of_sound: float = 343.0) -> float:
    """Return the displacement of one end that explains the residual [m].

    A displaced end moves each arrival by its projection, d cos(theta) / c. With
    arrivals from everywhere the rms delay is d / (sqrt(3) c), and small delays
    leave a residual of (2 pi f delay)^2 that grows by 6 dB an octave.
    """
    high = fit.centers >= 900
    residual = fit.residual[high]
    turn = (2 * np.pi * fit.centers[high, None]) ** 2
    # Beyond half the energy the small-angle law ends.
    delays = np.where(residual < 0.5, residual, np.nan) / turn
    good = np.isfinite(delays) & (fit.noise[high] < 0.2)
    if not good.any():
        return float("nan")
    return float(np.sqrt(3 * np.median(delays[good])) * speed_of_sound)


def name_faults(
    fit: SwapFit,
    *,
    noise_excess_db: float = 0.0,
    own: float = 1.0,
    partners: Sequence[tuple[str, float]] = (),
    limits: FaultLimits | None = None,
) -> list[PairFault]:
    """Return what is wrong with a pair, the likeliest reason first.

    Parameters
    ----------
    fit : SwapFit
        How the directions differ.
    noise_excess_db : float
        Noise floor of the noisier direction over the median of the room [dB].
    own : float
        Correlation of the directions as recorded, under 1 kHz.
    partners : sequence of (str, float)
        Other pairs and how well this pair's reverse response correlates with
        their forward one.
    limits : FaultLimits, optional
        From which sizes on to speak.
    """
    bounds = limits or FaultLimits()
    alike = _clean_median(fit, fit.matched, 0.0, 1100.0, absent=own)
    if min(alike, own) < bounds.coherence:
        noisy = noise_excess_db > bounds.noise_db
        stranger = _stranger(min(alike, own), partners, bounds, noisy)
        if stranger:
            return [stranger]
    found = [
        _sized(
            "noise",
            noise_excess_db,
            bounds.noise_db,
            f"noise {noise_excess_db:.0f} dB above the other takes",
        ),
        _sized(
            "gain",
            fit.gain_db - bounds.typical.gain_db,
            bounds.gain_db,
            f"gain step of {fit.gain_db:+.2f} dB between the directions",
        ),
        _sized(
            "temperature",
            fit.temperature_change - bounds.typical.temperature_k,
            bounds.temperature_k,
            f"air changed by {fit.temperature_change:+.2f} K between the directions",
        ),
        _unexplained(fit, alike, bounds),
    ]
    # Noise makes every other fit uncertain, so it comes first.
    return sorted(
        (f for f in found if f), key=lambda f: (f.kind != "noise", -f.severity)
    )


def _clean_median(
    fit: SwapFit, values: FloatArray, low: float, high: float, *, absent: float
) -> float:
    """Return the median over early windows of some octaves that noise spares."""
    bands = (fit.centers >= low) & (fit.centers <= high)
    early = np.where(fit.noise[bands] < 0.05, values[bands], np.nan)[:, :4]
    return float(np.nanmedian(early)) if np.isfinite(early).any() else absent


def _sized(kind: str, size: float, limit: float, words: str) -> PairFault | None:
    large = abs(size) if kind != "noise" else size
    if not np.isfinite(size) or large <= limit:
        return None
    return PairFault(kind, float(size), words, large / limit)


def _stranger(
    alike: float,
    partners: Sequence[tuple[str, float]],
    bounds: FaultLimits,
    noisy: bool,
) -> PairFault | None:
    best = max(partners, key=lambda p: p[1], default=("", 0.0))
    if best[1] > bounds.partner:
        words = f"stands swapped: the reverse take belongs to pair {best[0]}"
        return PairFault("swapped", best[1], words, 100.0)
    if alike < bounds.coherence / 2 and not noisy:
        words = "the directions are unlike at all frequencies: not the same places"
        return PairFault("place", alike, words, 50.0)
    return None


def _unexplained(fit: SwapFit, alike: float, bounds: FaultLimits) -> PairFault | None:
    """Tell a displaced end from unequal gain patterns by the low octaves.

    A displacement hardly shows at 500 Hz; a pattern does.
    """
    distance = position_error(fit)
    left = _clean_median(fit, fit.residual, 200.0, 600.0, absent=0.0)
    reach = np.nan_to_num(distance, nan=0.0)
    turn = (2 * np.pi * 350.0 * reach / 343.0) ** 2 / 3
    if left > max(0.03, 6 * turn) or (not np.isfinite(distance) and alike < 0.9):
        words = (
            f"{100 * left:.0f} % of the low-frequency energy differs and no gain, "
            "place or temperature explains it: unequal gain patterns"
        )
        return PairFault("pattern", left, words, left / 0.03)
    millimetres = 1000 * distance
    return _sized(
        "position",
        millimetres,
        bounds.position_mm,
        f"an end stood about {millimetres:.0f} mm off in one direction",
    )
