"""The words that flags and reasons are spoken in, and their codes."""

__all__ = ["FLAG_WORDS", "REASONS", "flag_words"]

# One bit each, since a response may deserve several.
NON_FINITE = 1
DC_OFFSET = 2
CLIPPED = 4
LOW_RANGE = 8
CURVED = 16
TAIL_EVENT = 32
EARLY_CLICK = 64
SHORT_BT = 128
NO_DECAY = 256
SILENT = 512
UNSTEADY_NOISE = 1024

FLAG_WORDS = {
    NON_FINITE: "non_finite",
    DC_OFFSET: "dc_offset",
    CLIPPED: "clipped",
    LOW_RANGE: "low_dynamic_range",
    CURVED: "curved_decay",
    TAIL_EVENT: "tail_event",
    EARLY_CLICK: "early_click",
    SHORT_BT: "short_BT",
    NO_DECAY: "no_decay",
    SILENT: "silent",
    UNSTEADY_NOISE: "unsteady_noise",
}
"""Bit of each warning flag and its word."""

(
    GIVEN,
    NOT_FINITE,
    ALL_ZERO,
    ALL_CONSTANT,
    ONE_PULSE,
    PULSES,
    NO_LATE,
    RANGE_SHORT,
    NO_POINTS,
    NOT_STRAIGHT,
    LATE_BURIED,
    UNDER_NOISE,
    SHORT_RECORD,
    BANDWIDTH_SHORT,
    BAND_OUTSIDE,
    NOISE_SWINGS,
) = range(16)

REASONS = (
    "",
    "a sample is NaN or infinite",
    "every sample is zero",
    "every sample is the same",
    "a single impulse does not decay",
    "the curve falls in single steps, not as a decay",
    "there is no energy behind the split",
    "the decay meets the noise or the end too early for this range",
    "the direct sound alone falls through this range",
    "the curve is not a straight decay in this range",
    "the energy behind the split lies under the noise",
    "no decay stands out of the noise",
    "the response is too short",
    "bandwidth times reverberation time is below 12.5",
    "the band reaches beyond half the sample rate",
    "the noise swings too much to tell it from the decay in this range",
)
"""Why a value is NaN, by code."""


def flag_words(bits: int) -> list[str]:
    """Return the words of a response's flags.

    Examples
    --------
    >>> flag_words(3)
    ['non_finite', 'dc_offset']
    """
    return [word for bit, word in FLAG_WORDS.items() if bits & bit]
