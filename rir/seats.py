"""Rows of seats, as a surface of a room may stand for them."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rir.config import StrictModel

__all__ = ["SeatRows"]


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
