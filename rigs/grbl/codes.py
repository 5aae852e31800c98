"""What the numbers of Grbl's alarms and errors mean, in our words.

Numbers after the tables of the Grbl 1.1 and grblHAL documentation.
"""

ALARMS = {
    1: "a limit switch was hit; the motion stopped dead and the position is unsure",
    2: "a target lay beyond the travel; nothing moved there, the position is kept",
    3: "it was reset while moving; the position is unsure",
    4: "the probe was not in the state expected before probing",
    5: "the probe found nothing within its way",
    6: "it was reset during homing",
    7: "the door was opened during homing",
    8: "homing could not leave a switch; more pull-off, or check the wiring",
    9: "homing found no switch within its way; check switches and travel settings",
    10: "the emergency stop is pressed",
    11: "homing is required first",
    12: "a limit switch is pressed; free it first",
    14: "the spindle did not reach its speed",
    16: "the power-on self-test failed",
    17: "a motor driver reports a fault",
    18: "the homing cycle is not configured properly",
}
KEEPS_POSITION = {2, 4, 5}
"""Alarms after which the counted position still holds."""

ERRORS = {
    1: "a word has no letter",
    2: "a number is missing or malformed",
    3: "the $ command is unknown",
    4: "a value must not be negative",
    5: "homing is not enabled ($22)",
    6: "the step pulse is too short",
    7: "settings could not be read and were reset",
    8: "the $ command is only allowed when idle",
    9: "locked out by an alarm or a jog",
    10: "soft limits need homing to be enabled",
    11: "the line is too long",
    12: "the step rate is too high for the board",
    13: "the door is open",
    14: "the line does not fit the memory",
    15: "the jog target lies beyond the travel; ignored",
    16: "the jog line is not allowed",
    17: "laser mode needs PWM",
    20: "the code is not supported",
    21: "two codes of one modal group",
    22: "no feed rate is set",
    23: "the code takes a whole number",
    24: "two codes want the axis words",
    25: "a word is repeated",
    26: "axis words are missing",
    27: "the line number is out of range",
    28: "a word the code needs is missing",
    29: "the work coordinate system does not exist",
    30: "G53 needs G0 or G1",
    31: "axis words without a use",
    32: "an arc lacks axes in its plane",
    33: "the target is not valid",
    34: "the arc's radius is not possible",
    35: "an arc lacks its offsets",
    36: "words without a use",
    37: "the tool length offset is on the wrong axis",
    38: "the tool number is too high",
    46: "the machine must be homed first",
    79: "not allowed during a critical event",
}


def alarm_text(code: int) -> str:
    """Return what an alarm number means.

    Examples
    --------
    >>> alarm_text(9)
    'alarm 9: homing found no switch within its way; check switches and travel settings'
    """
    return f"alarm {code}: {ALARMS.get(code, 'not known to this driver')}"


def error_text(code: int) -> str:
    """Return what an error number means."""
    return f"error {code}: {ERRORS.get(code, 'not known to this driver')}"
