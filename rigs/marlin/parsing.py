"""Marlin's replies and checksums."""

import re
from dataclasses import dataclass

import numpy as np

RESEND = re.compile(r"(?:Resend|rs):? ?N?(\d+)")
PLACE = re.compile(r"([XYZE]):(-?\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Reply:
    """One line of a Marlin board."""

    kind: str
    """ok, resend, busy, error, start, position or other."""
    text: str
    number: int = -1
    """Line asked for again."""
    place: tuple[float, ...] = ()
    """X, Y, Z of a position report, mm."""


def checksummed(number: int, text: str) -> str:
    """Return a line with its number and checksum, the XOR of its bytes.

    Examples
    --------
    >>> checksummed(101, "G1 X10")
    'N101 G1 X10*81'
    """
    body = f"N{number} {text}"
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"{body}*{total}"


def read_reply(line: str) -> Reply:
    """Read one line, without its end.

    Examples
    --------
    >>> read_reply("Resend: 7").number
    7
    >>> read_reply("ok X:50.0 Y:20.0 Z:0.0 E:0.0 Count: A:5000").place
    (50.0, 20.0, 0.0)
    """
    bare = line.strip()
    places = dict(PLACE.findall(bare.partition("Count")[0]))
    place = ()
    if {"X", "Y", "Z"} <= set(places):
        place = tuple(float(places[axis]) for axis in "XYZ")
    if bare == "ok" or bare.startswith("ok "):
        return Reply("ok", bare, place=place)
    if match := RESEND.fullmatch(bare):
        return Reply("resend", bare, int(match[1]))
    if re.fullmatch(r"(echo:)?\s*busy:.*", bare):
        return Reply("busy", bare)
    if bare.startswith(("Error:", "!!")) or "KILLED" in bare or "kill()" in bare:
        return Reply("error", bare)
    if bare == "start" or bare.startswith("Marlin "):
        return Reply("start", bare)
    return Reply("position" if place else "other", bare, place=place)


def vector(place: tuple[float, ...]) -> np.ndarray:
    """Return a place as an array."""
    return np.array(place, dtype=float)
