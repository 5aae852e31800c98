"""A trained field whose listener pattern can be exchanged."""

import numpy as np
import torch

from fields.layers.harmonics import broadband_coefficients
from fields.render.weighting import pattern_weighting, single_harmonic
from fields.training.network import NetworkField
from rir import GainPattern, Pose, Poses
from rir.harmonics import harmonic_count

__all__ = ["DirectionalField"]


class DirectionalField(NetworkField):
    """Answer responses through any listener pattern, and the emitter's own.

    A listener pattern only changes the weights of the rays, so any pattern is
    a sum over spherical harmonics of responses the field gives anyway.
    """

    @classmethod
    def of(cls, field: NetworkField) -> "DirectionalField":
        """Give a plain network field its directions."""
        return cls(field.network, field.config, field.frame, field.report)

    def predict(
        self,
        emitters: Poses | Pose | np.ndarray,
        listeners: Poses | Pose | np.ndarray,
        *,
        listener_gain: GainPattern | None = None,
    ) -> np.ndarray:
        """Return responses, shape (queries, n_samples), float32.

        Parameters
        ----------
        emitters, listeners : Poses
            The two ends.
        listener_gain : GainPattern, optional
            Hear through this pattern instead of the one trained with; patterns
            that differ between bands are applied band by band.
        """
        if listener_gain is None:
            return super().predict(emitters, listeners)
        if len(listener_gain.bands) == 1:
            row = torch.tensor(
                broadband_coefficients(listener_gain, listener_gain.order)
            )
            return self.rendered(emitters, listeners, pattern_weighting(row.float()))
        parts = self.harmonic_responses(emitters, listeners, listener_gain.order)
        return _banded(parts, listener_gain, self.frame.sample_rate)

    def harmonic_responses(
        self,
        emitters: Poses | Pose | np.ndarray,
        listeners: Poses | Pose | np.ndarray,
        order: int,
    ) -> np.ndarray:
        """Return what each spherical harmonic hears.

        Returns
        -------
        numpy.ndarray
            Shape (queries, (order + 1)^2, n_samples), float32: an Ambisonic
            room response in the listener's frame, real orthonormal, ACN order.
        """
        parts = [
            self.rendered(emitters, listeners, single_harmonic(index, order))
            for index in range(harmonic_count(order))
        ]
        return np.stack(parts, axis=1)

    def emitter_gain(self) -> GainPattern:
        """Return the emitter's pattern: the learned direct sound's, or read out.

        Raises
        ------
        TrainingError
            If the field has no direct sound written out and none can be read.
        """
        from fields.training.readout import read_emitter_pattern

        return read_emitter_pattern(self)


def _banded(parts: np.ndarray, pattern: GainPattern, sample_rate: float) -> np.ndarray:
    """Filter each harmonic's response by its gain over frequency and add."""
    n_samples = parts.shape[-1]
    length = 2 * n_samples
    frequencies = np.fft.rfftfreq(length, 1 / sample_rate)
    place = np.log(np.maximum(frequencies, 1.0))
    centers = np.log(np.asarray(pattern.bands))
    gains = np.stack(
        [np.interp(place, centers, row) for row in np.asarray(pattern.coefficients).T]
    )
    spectra = np.fft.rfft(parts, length, axis=-1)
    heard = np.fft.irfft((spectra * gains).sum(axis=1), length, axis=-1)
    return heard[:, :n_samples].astype(np.float32)
