"""Level of direct sounds, band by band, from where the loudspeaker looks.

Interpolated waveforms lose level where their sounds do not quite add up. The level
itself is a smooth function of the direction and distance the listener has in the frame
of the loudspeaker; where places left out confirm it, direct sounds are brought to it.
"""

from dataclasses import dataclass

import numpy as np

from inverse.rows.directivity import aimed_offsets, direct_windows
from inverse.rows.fitset import FitSet
from rir import Poses
from rir.arrays import FloatArray
from rir.harmonics import evaluate_harmonics

__all__ = ["DirectLevels"]

ORDER = 4
"""Of the pattern in each band: lobes of 45 degrees, as small loudspeakers have."""
RIDGE = 0.1
"""A tenth of a row: holds shapes that no direction tells, moves others little."""
MOST_NEPER = 0.8
"""Largest change of an amplitude, 7 dB: a shadowed direct sound is not made up."""
QUIET = 1e-9  # 90 dB below the loudest band there is nothing to read
LOW_HZ = (250.0, 500.0)
"""Middles of the lowest bands; the window of 3.6 ms resolves no narrower ones."""
STEP_HZ = 1000.0  # bands above: patterns change no faster with frequency
RINGING_S = 0.004  # what masks of such bands ring; spectra are padded by it


@dataclass(frozen=True, eq=False)
class DirectLevels:
    """Hold how direct levels depend on distance and aim, band by band.

    Parameters
    ----------
    weights : ndarray, shape (bands, regressors)
        Of the log energy of direct sounds, neper.
    trust : ndarray, shape (bands,)
        How far levels are moved towards it, 0 to 1.
    latency_s, speed_of_sound, sample_rate : float
        Seconds, metres per second and hertz.
    """

    weights: FloatArray
    trust: FloatArray
    latency_s: float
    speed_of_sound: float
    sample_rate: float

    @classmethod
    def fit(cls, rows: FitSet, answers: FloatArray, latency_s: float) -> "DirectLevels":
        """Fit levels of measured rows and find where they beat the answers'.

        Parameters
        ----------
        rows : FitSet
            Measured rows.
        answers : ndarray, shape (rows, n)
            Predictions for their ends, without rows of their emitter.
        latency_s : float
            Of every arrival.
        """
        timing = rows.distances, rows.speed_of_sound, latency_s, rows.sample_rate
        measured, gap = (_levels(one, *timing) for one in (rows.responses, answers))
        gap = gap - measured
        basis = _basis(rows.emitters, rows.listeners)
        count = measured.shape[1]
        left_out = np.full(measured.shape, np.nan)
        for place in np.unique(rows.places):
            here = rows.places == place
            if here.all():
                break
            left_out[here] = basis[here] @ _solved(basis[~here], measured[~here]).T
        own = np.array([_square(left_out[:, k] - measured[:, k]) for k in range(count)])
        others = np.array([_square(gap[:, k]) for k in range(count)])
        trust = np.where(np.isfinite(own), others / np.maximum(own + others, 1e-300), 0)
        return cls(
            _solved(basis, measured), trust, latency_s, timing[1], rows.sample_rate
        )

    def apply(
        self, answer: FloatArray, emitters: Poses, listeners: Poses
    ) -> FloatArray:
        """Return answers with the level of their direct sounds corrected."""
        from scipy.fft import irfft

        reach = np.linalg.norm(emitters.positions - listeners.positions, axis=1)
        timing = reach, self.speed_of_sound, self.latency_s, self.sample_rate
        wanted = _basis(emitters, listeners) @ self.weights.T
        move = self.trust * (wanted - _levels(answer, *timing))
        move = np.where(np.isfinite(move), move, 0.0)
        gains = np.exp(0.5 * np.clip(move, -2 * MOST_NEPER, 2 * MOST_NEPER)) - 1
        spectra, masks = _spectra(answer, *timing)
        moved = irfft(spectra * (gains @ masks), 2 * (masks.shape[1] - 1))
        return answer + np.asarray(moved)[:, : answer.shape[1]]


def _basis(emitters: Poses, listeners: Poses) -> FloatArray:
    offsets = aimed_offsets(emitters, listeners)
    reach = np.maximum(np.linalg.norm(offsets, axis=1), 1e-3)[:, None]
    shapes = evaluate_harmonics(offsets / reach, ORDER)
    return np.hstack([shapes, np.log(reach)])


def _levels(
    responses: FloatArray,
    reach: FloatArray,
    speed: float,
    latency_s: float,
    sample_rate: float,
) -> FloatArray:
    """Return log energies of direct sounds, shape (rows, bands); NaN if silent."""
    timing = reach, speed, latency_s, sample_rate
    spectra, masks = _spectra(responses, *timing)
    energy = (np.abs(spectra) ** 2) @ masks.T
    measured = energy > QUIET * max(float(energy.max(initial=0.0)), 1e-300)
    return np.log(energy, out=np.full(energy.shape, np.nan), where=measured)


def _spectra(
    responses: FloatArray,
    reach: FloatArray,
    speed: float,
    latency_s: float,
    sample_rate: float,
) -> tuple[FloatArray, FloatArray]:
    """Return spectra of direct sounds and masks of bands that add up to one."""
    from scipy.fft import next_fast_len, rfft

    count = responses.shape[1]
    window = direct_windows(reach, speed, latency_s, count, sample_rate)
    wanted = count + round(RINGING_S * sample_rate)
    size = 2 * ((next_fast_len(wanted, True) or wanted) // 2)
    spectra = np.asarray(rfft(responses * window, size))
    hertz = np.linspace(0, 0.5 * sample_rate, size // 2 + 1)
    top = 0.5 * sample_rate
    centers = np.array([*LOW_HZ, *np.arange(STEP_HZ, top + 1, STEP_HZ)])
    centers = centers[centers <= max(top, LOW_HZ[0])]
    masks = [np.interp(hertz, centers, one) for one in np.eye(len(centers))]
    return spectra, np.array(masks)


def _solved(basis: FloatArray, levels: FloatArray) -> FloatArray:
    """Return weights of every band, shape (bands, regressors)."""
    out = np.zeros((levels.shape[1], basis.shape[1]))
    for band, level in enumerate(levels.T):
        known = np.isfinite(level)
        rows = basis[known]
        middle = float(level[known].mean()) if known.any() else 0.0
        square = rows.T @ rows + RIDGE * np.eye(rows.shape[1])
        out[band] = np.linalg.solve(square, rows.T @ (level[known] - middle))
        # the first shape is a constant
        out[band, 0] += middle * np.sqrt(4 * np.pi)
    return out


def _square(errors: FloatArray) -> float:
    known = errors[np.isfinite(errors)]
    return float(np.mean(known**2)) if len(known) else np.inf
