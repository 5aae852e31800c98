"""Emitters on the move: what a listener hears while the emitter travels."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rir import Poses
from rir.arrays import FloatArray
from rir.errors import SignalError
from rooms.scene import Scene
from rooms.simulation import simulate

__all__ = ["render_moving"]


def render_moving(
    scene: Scene,
    path: Any,
    times: ArrayLike,
    listeners: Any,
    signal: ArrayLike,
    *,
    sample_rate: int,
    duration: float,
    **options: Any,
) -> FloatArray:
    """Return what listeners hear of a signal from an emitter that moves.

    Parameters
    ----------
    scene : Scene
        The room.
    path : Poses
        Poses of the emitter; a step should stay below an eighth of the shortest
        wavelength of interest.
    times : array_like, shape (poses,)
        When each pose is passed [s], ascending.
    listeners : Poses
        Listeners, at rest.
    signal : array_like, shape (n,)
        What the emitter plays from time 0 on.
    sample_rate, duration
        Rate [Hz] and length of the responses [s].
    **options
        Further options of `simulate`.

    Returns
    -------
    ndarray, shape (listeners, n + n_samples - 1)
        Time 0 is the first sample of the signal.

    Notes
    -----
    Each moment of the signal is emitted from the place then reached: it is split
    among the two nearest poses with weights that fall linearly in time, and each
    part is convolved with the response of its pose. The Doppler shift follows by
    itself. For a moving listener exchange the ends: responses are reciprocal.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    poses, moments = Poses.of(path), np.asarray(times, dtype=float)
    dry = np.asarray(signal, dtype=float)
    if len(poses) != len(moments) or np.any(np.diff(moments) <= 0):
        raise SignalError(f"{len(poses)} poses need as many ascending times")
    result = simulate(
        scene, poses, listeners, sample_rate=sample_rate, duration=duration, **options
    )
    clock = np.arange(len(dry)) / sample_rate
    n = len(dry) + result.responses.shape[-1] - 1
    length = int(next_fast_len(n, real=True) or n)
    total = np.zeros((result.responses.shape[1], length // 2 + 1), dtype=complex)
    for index, responses in enumerate(result.responses):
        share = np.interp(clock, moments, np.eye(len(moments))[index])
        part = np.asarray(rfft(dry * share, length))
        total += part * np.asarray(rfft(responses, length, axis=-1))
    return np.asarray(irfft(total, length, axis=-1))[:, :n]
