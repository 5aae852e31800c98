"""How strongly a device radiates or listens in each direction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rir.arrays import FloatArray
from rir.errors import SignalError
from rir.harmonics import evaluate_harmonics, harmonic_count, harmonic_order
from rir.numbers import read_array

__all__ = ["GainPattern"]

_BROADBAND = (1000.0,)  # a lone band stands for all: its centre is only a name [Hz]


@dataclass(frozen=True, eq=False)
class GainPattern:
    """Amplitude gain over directions, per frequency band, in the device frame.

    Parameters
    ----------
    coefficients : array_like, shape (bands, (order + 1)^2)
        Real orthonormal spherical-harmonic coefficients in ACN order.
    bands : array_like, shape (bands,)
        Band centres [Hz], ascending; a single band holds at all frequencies.

    Notes
    -----
    The gain is a pressure ratio, 1 everywhere for `omni`. Directions point from
    the device outwards, towards where sound leaves or comes from; the device
    looks along +x. Two patterns that agree as functions make a reciprocal pair.

    Examples
    --------
    >>> GainPattern.cardioid().gain([[1, 0, 0], [0, 1, 0]]).round(6).ravel().tolist()
    [1.0, 0.5]
    """

    coefficients: FloatArray
    bands: FloatArray

    def __post_init__(self) -> None:
        bands = np.atleast_1d(read_array(self.bands, "bands of a gain pattern [Hz]"))
        coefficients = np.atleast_2d(
            read_array(self.coefficients, "coefficients of a gain pattern")
        )
        if coefficients.ndim != 2 or bands.ndim != 1 or len(coefficients) != len(bands):
            raise SignalError(
                f"gain pattern: coefficients of shape {coefficients.shape} for bands of"
                f" shape {bands.shape}; give one row per band"
            )
        if not np.isfinite(coefficients).all() or np.any(np.diff(bands) <= 0):
            raise SignalError("gain pattern: finite rows, ascending bands are needed")
        harmonic_order(coefficients.shape[1])
        object.__setattr__(self, "coefficients", coefficients)
        object.__setattr__(self, "bands", bands)

    @staticmethod
    def omni() -> "GainPattern":
        """Return the pattern that is 1 in every direction."""
        return GainPattern(np.array([[np.sqrt(4 * np.pi)]]), np.array(_BROADBAND))

    @staticmethod
    def first_order(alpha: float) -> "GainPattern":
        """Return alpha + (1 - alpha) cos(angle to the front).

        1 is omni, 0.5 a cardioid, 0.25 a hypercardioid, 0 a figure of eight.
        """
        omni, dipole = np.sqrt(4 * np.pi), np.sqrt(4 * np.pi / 3)
        row = [alpha * omni, 0.0, 0.0, (1 - alpha) * dipole]
        return GainPattern(np.array([row]), np.array(_BROADBAND))

    @staticmethod
    def cardioid() -> "GainPattern":
        """Return the cardioid looking along +x."""
        return GainPattern.first_order(0.5)

    @staticmethod
    def fit(
        directions: ArrayLike,
        gains: ArrayLike,
        order: int = 4,
        bands: ArrayLike | None = None,
        weights: ArrayLike | None = None,
    ) -> "GainPattern":
        """Fit a pattern to gains sampled on the sphere by weighted least squares.

        Parameters
        ----------
        directions : array_like, shape (M, 3)
            Unit vectors in the device frame.
        gains : array_like, shape (M,) or (M, bands)
            Amplitude gains.
        order : int
            Highest degree; 4 follows the reference paper (25 coefficients).
        bands : array_like, shape (bands,), optional
            Band centres [Hz]; may be left out for one band.
        weights : array_like, shape (M,), optional
            Quadrature weights or inverse variances.

        Raises
        ------
        SignalError
            If there are fewer directions than coefficients.
        """
        values = np.asarray(gains, dtype=float)
        values = values[:, None] if values.ndim == 1 else values
        basis = evaluate_harmonics(directions, order)
        if len(basis) < harmonic_count(order):
            raise SignalError(
                f"a pattern of order {order} has {harmonic_count(order)} coefficients;"
                f" {len(basis)} directions cannot determine them: lower the order"
            )
        root = np.sqrt(np.ones(len(basis)) if weights is None else np.asarray(weights))
        fitted = np.linalg.lstsq(basis * root[:, None], values * root[:, None])[0]
        centers = _BROADBAND if bands is None else bands
        return GainPattern(
            fitted.T.astype(np.float64), np.asarray(centers, dtype=float)
        )

    @property
    def order(self) -> int:
        """Highest degree of the harmonics."""
        return harmonic_order(self.coefficients.shape[1])

    @property
    def mean_square(self) -> FloatArray:
        """Mean of gain² over the sphere, shape (bands,): the diffuse-field gain."""
        return np.sum(self.coefficients**2, axis=1) / (4 * np.pi)

    @property
    def is_omni(self) -> bool:
        """Whether the gain is 1 in all directions and bands."""
        omni = np.zeros_like(self.coefficients)
        omni[:, 0] = np.sqrt(4 * np.pi)
        return bool(np.allclose(self.coefficients, omni, rtol=0, atol=1e-12))

    def gain(self, directions: ArrayLike) -> FloatArray:
        """Return the amplitude gain, shape (..., bands), for device-frame directions.

        Parameters
        ----------
        directions : array_like, shape (..., 3)
            Unit vectors in the device frame; see `Pose.to_local`.
        """
        return evaluate_harmonics(directions, self.order) @ self.coefficients.T

    def at_bands(self, centers: ArrayLike) -> "GainPattern":
        """Return the pattern interpolated (linearly in log f) at other centres [Hz]."""
        wanted = np.atleast_1d(np.asarray(centers, dtype=float))
        columns = [
            np.interp(np.log(wanted), np.log(self.bands), column)
            for column in self.coefficients.T
        ]
        return GainPattern(np.stack(columns, axis=1), wanted)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, GainPattern):
            return NotImplemented
        same_bands = np.array_equal(self.bands, other.bands)
        return same_bands and np.array_equal(self.coefficients, other.coefficients)

    def __hash__(self) -> int:
        return hash((self.coefficients.tobytes(), self.bands.tobytes()))
