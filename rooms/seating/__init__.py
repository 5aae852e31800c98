"""Rows of seats: what they are to sound, where they are, and sound over them."""

from rooms.seating.areas import LEAST_ROWS, seat_floors, seat_panels, tops_above
from rooms.seating.over_seats import OffTheTops, OverSeats
from rooms.seating.troughs import Troughs, acting_depth, over_rows, troughs_of

__all__ = [
    "LEAST_ROWS",
    "OffTheTops",
    "OverSeats",
    "Troughs",
    "acting_depth",
    "over_rows",
    "seat_floors",
    "seat_panels",
    "tops_above",
    "troughs_of",
]
