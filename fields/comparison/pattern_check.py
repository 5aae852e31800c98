"""How well a trained field has the emitter's pattern, against the truth."""

from dataclasses import replace

import numpy as np

from fields.data import FieldData
from fields.field import Directional, Field
from fields.pattern import departures, direct_levels
from rir import GainPattern

__all__ = ["check_pattern", "front_to_back", "pattern_error"]

SPHERE = 400
"""Even directions patterns are compared in: ten times the coefficients of degree 5."""
FACING = 0.5
"""Cosine: front and back are cones of 60 degrees about the axis."""


def check_pattern(field: Field, test: FieldData) -> dict[str, float]:
    """Compare the pattern in a field's answers with the known one.

    Parameters
    ----------
    field : Field
        A trained field.
    test : FieldData
        Rows of unseen emitters; the frame's emitter pattern is the truth.

    Returns
    -------
    dict
        "front-to-back" of the direct sounds the field answers and "true
        front-to-back" of the data, dB; "pattern error", the largest amplitude
        between the pattern a directional field states and the truth. Empty where
        the emitter is omnidirectional or its pattern unknown.
    """
    truth = test.frame.emitter_gain
    if truth is None or truth.is_omni:
        return {}
    heard = field.predict(test.emitters, test.listeners)
    answered = replace(test, responses=heard / np.float32(test.frame.scale))
    found = {
        "front-to-back": front_to_back(answered),
        "true front-to-back": front_to_back(test),
    }
    if isinstance(field, Directional):
        found["pattern error"] = pattern_error(field.emitter_gain(), truth)
    return found


def front_to_back(data: FieldData) -> float:
    """Return the level of direct sounds in front over those behind, dB.

    In front is where the cosine to the emitter's axis exceeds a half.
    """
    levels, clean = direct_levels(data)
    cosine = departures(data.emitters, data.listeners)[:, 0]
    sides = [levels[clean & side] for side in (cosine > FACING, cosine < -FACING)]
    if min(map(len, sides)) == 0:
        return float("nan")
    front, back = (float(np.mean(np.square(side))) for side in sides)
    return 10 * float(np.log10(front / back)) if min(front, back) > 0 else float("nan")


def pattern_error(found: GainPattern, truth: GainPattern) -> float:
    """Return the largest difference in amplitude, the levels made equal.

    Examples
    --------
    >>> pattern_error(GainPattern.omni(), GainPattern.omni())
    0.0
    """
    directions = _sphere()
    ours, theirs = (one.gain(directions).mean(axis=1) for one in (found, truth))
    energy = float(ours @ ours)
    level = float(ours @ theirs) / energy if energy > 0 else 0.0
    return float(np.abs(level * ours - theirs).max())


def _sphere() -> np.ndarray:
    height = 1 - (2 * np.arange(SPHERE) + 1) / SPHERE
    angle = np.arange(SPHERE) * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)
