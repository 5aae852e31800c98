"""Rows of seats, as a surface of a room may stand for them."""

import re
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rir.config import StrictModel

__all__ = ["SeatRows", "names_seats"]

_SEATS = re.compile(
    r"audience|seat(?:s|ing)?|stalls|pews?|publikum|gestühl|bestuhlung|sitze"
    r"|publik|public|fauteuils|sièges|sieges|pubblico|poltrone"
)
"""Words that layers of published halls say seats by: English, German, Swedish, French,
Italian."""

_NOT_SEATS = re.compile(
    r"floor|under|below|beneath|behind|aisles?|walls?|front|back|rear|side|edges?|box"
)
"""Words that make a name that of what is around seats."""


class SeatRows(StrictModel):
    """Rows of seats that a surface stands for, with or without people in them.

    Sound that grazes them meets troughs between backs. Typical theatre seats where
    nothing else is stated.
    """

    back_m: Annotated[float, Field(gt=0.0, le=2.0)] = 0.8
    """Height of the backs above the floor [m]."""
    under_m: Annotated[float, Field(ge=0.0)] = 0.3
    """Free height below the seats, where sound passes from row to row [m]."""
    row_m: Annotated[float, Field(gt=0.0, le=3.0)] = 0.9
    """Distance from row to row [m]."""
    drawn_at: Literal["tops", "floor"] | None = None
    """Where the surface lies: at the tops of the backs, or on the floor. When left
    out, the floor of a box is a floor and a surface of a mesh lies at the tops."""

    @model_validator(mode="after")
    def _above(self) -> Self:
        if not self.under_m < self.back_m:
            raise ValueError(
                f"under_m {self.under_m:g} must be less than back_m {self.back_m:g}"
            )
        return self

    @property
    def depth_m(self) -> float:
        """Depth of the troughs between rows [m]."""
        return self.back_m - self.under_m

    @property
    def on_floor(self) -> "SeatRows":
        """The same on a surface that is a floor, unless another is stated."""
        return self.model_copy(update={"drawn_at": self.drawn_at or "floor"})


def names_seats(name: str) -> bool:
    """Tell whether the name of a surface says that it stands for rows of seats.

    Names are read by words, since layers of halls have no other mark.

    Examples
    --------
    >>> [names_seats(name) for name in ("Audience_2", "seats.001", "upperSeating")]
    [True, True, True]
    >>> [names_seats(name) for name in ("wall behind seats", "publication", "seatbelt")]
    [False, False, False]
    """
    parted = re.sub(r"(?<=[^\W\d_])(?<![A-ZÄÖÜ])(?=[A-ZÄÖÜ])", " ", name)
    words = re.findall(r"[^\W\d_]+", parted.lower())
    around = any(_NOT_SEATS.fullmatch(word) for word in words)
    return not around and any(_SEATS.fullmatch(word) for word in words)
