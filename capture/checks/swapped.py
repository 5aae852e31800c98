"""A microphone channel that is the cable, while the loopback is a room."""

from collections.abc import Iterator

from capture.checks.evidence import Evidence
from capture.checks.finding import Finding
from capture.checks.table import CHECKS

__all__ = ["check_swapped"]


@CHECKS.add("swapped")
def check_swapped(take: Evidence) -> Iterator[Finding]:
    """Refuse takes in which microphone and loopback changed places.

    Against what was played, the response of a cable is one short pulse, that of a
    room is not; seen from the loopback nothing could be told, since both are then
    divided by the room.
    """
    for channel in take.swapped:
        yield Finding(
            "swapped_channels",
            True,
            f"channel {channel} carries the output by cable and the loopback does "
            "not: are the two swapped?",
            channel=channel,
        )
