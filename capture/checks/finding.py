"""What checks say, and the limits they hold a take to."""

from dataclasses import dataclass

__all__ = ["Finding", "TakeLimits"]


@dataclass(frozen=True)
class Finding:
    """One finding of one check.

    Attributes
    ----------
    word : str
        What was found, one word of the documented list.
    hard : bool
        Whether the response must not be trusted.
    text : str
        The finding in one sentence, with its figure and time.
    value, limit : float
        The figure and what it was compared with.
    unit : str
        Unit of both.
    channel : int or None
        Channel of the recording; None for the loopback or the whole take.
    time : float or None
        When it happened, s from the recording's start.
    """

    word: str
    hard: bool
    text: str
    value: float = float("nan")
    limit: float = float("nan")
    unit: str = ""
    channel: int | None = None
    time: float | None = None


@dataclass(frozen=True)
class TakeLimits:
    """What a take may show before it is marked or refused.

    Attributes
    ----------
    gain_change_db, latency_change, drift_ppm : float
        Against the golden loopback: dB, samples, ppm.
    drift_alone_ppm : float
        Without a golden loopback.
    golden_residual_db : float
        Loopback minus golden loopback, worst block.
    loopback_ripple_db : float
        Change of the loopback's gain within 200 Hz to 8 kHz.
    event_contrast_db, event_level_db : float
        Unexplained sound over its median, and over the sound of its moment.
    loopback_event_db : float
        Unexplained part of the loopback relative to the loopback.
    distortion_percent, spoiling_distortion_percent : float
        Harmonics: to mark, to refuse.
    lost_tail_db : float
        Energy of the decay that the recording no longer holds.
    low_inr_db : float
        Impulse to noise ratio per octave below which a take is marked.
    drowned_db : float
        Noise in the response over the response itself.
    direct_s : float
        Direct sound against geometry.
    dc_dbfs : float
        Constant part.
    crest_sigmas, crest_percent : float
        Predicted wave beyond the recording's extreme: in standard errors of the
        prediction, and in percent of the extreme.
    crosstalk_db : float
        Electrical copy at time zero relative to the direct sound.
    """

    gain_change_db: float = 0.05
    latency_change: float = 1.0
    drift_ppm: float = 0.15
    drift_alone_ppm: float = 0.5
    golden_residual_db: float = -60.0
    loopback_ripple_db: float = 1.25
    event_contrast_db: float = 13.0
    event_level_db: float = -26.0
    loopback_event_db: float = -51.0
    distortion_percent: float = 3.0
    spoiling_distortion_percent: float = 8.0
    lost_tail_db: float = -28.0
    low_inr_db: float = 35.0
    drowned_db: float = 3.0
    direct_s: float = 1e-4
    dc_dbfs: float = -60.0
    crest_sigmas: float = 6.0
    crest_percent: float = 0.05
    crosstalk_db: float = -65.0
