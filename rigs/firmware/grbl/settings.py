"""The settings of a Grbl board and how it prints them."""

INTEGERS = {0, 1, 2, 3, 4, 5, 6, 10, 13, 20, 21, 22, 23, 26, 30, 31, 32}
DEFAULTS: dict[int, float] = {
    0: 10, 1: 25, 2: 0, 3: 0, 4: 0, 5: 0, 6: 0, 10: 1, 11: 0.010, 12: 0.002,
    13: 0, 20: 0, 21: 0, 22: 0, 23: 0, 24: 25.0, 25: 500.0, 26: 250, 27: 1.0,
    30: 1000, 31: 0, 32: 0, 100: 250.0, 101: 250.0, 102: 250.0, 110: 500.0,
    111: 500.0, 112: 500.0, 120: 10.0, 121: 10.0, 122: 10.0, 130: 200.0,
    131: 200.0, 132: 200.0,
}  # fmt: skip


def print_setting(number: int, value: float) -> str:
    """Return one line of the ``$$`` report.

    Examples
    --------
    >>> print_setting(22, 1), print_setting(130, 200)
    ('$22=1', '$130=200.000')
    """
    shown = f"{value:.0f}" if number in INTEGERS else f"{value:.3f}"
    return f"${number}={shown}"


def check_setting(settings: dict[int, float], number: int, value: float) -> int:
    """Return the error number a write is refused with, 0 if it is taken."""
    if number not in settings:
        return 3
    if value < 0:
        return 4
    if number == 0 and value < 3:
        return 6
    if number == 20 and value and not settings[22]:
        return 10
    return 0
