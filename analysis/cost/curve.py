"""What accuracy costs: points of error against seconds, and which one to take."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from rir.errors import DatasetError
from rir.records import software_version

__all__ = ["CostCurve", "CostPoint", "knee_of", "mark_front"]

FORMAT = "resounding-cost"
SCHEMA = 1


@dataclass(frozen=True)
class CostPoint:
    """One setting of a knob, with what it costs and how wrong it is.

    Parameters
    ----------
    setting : str
        The setting, as a person would write it.
    seconds, seconds_low, seconds_high : float
        Median over repeats, and the ends of its 95 % interval [s].
    error, error_low, error_high : float
        The same of the error, in the unit of the curve.
    repeats : int
        How often it was run.
    on_front : bool
        Whether no other setting is both cheaper and better.
    """

    setting: str
    seconds: float
    seconds_low: float
    seconds_high: float
    error: float
    error_low: float
    error_high: float
    repeats: int
    on_front: bool = False


@dataclass(frozen=True)
class CostCurve:
    """All settings of one knob.

    Parameters
    ----------
    knob : str
        What was turned, for instance ``"sweep length"``.
    quantity, unit : str
        What the error is an error of, and its unit, for instance C50 and dB.
    seconds_of : str
        What the seconds are seconds of: ``"CPU"`` or ``"measuring"``.
    points : tuple of CostPoint
        In the order of the settings.
    knee : int
        Index of the recommended setting; -1 if there is none.
    """

    knob: str
    quantity: str
    unit: str
    seconds_of: str
    points: tuple[CostPoint, ...]
    knee: int

    @property
    def front(self) -> list[CostPoint]:
        """The points worth taking, cheapest first."""
        return sorted((p for p in self.points if p.on_front), key=lambda p: p.seconds)

    @property
    def sentence(self) -> str:
        """What a person needs to know, in one sentence."""
        if self.knee < 0:
            return f"{self.knob}: no setting gave a result."
        best = self.points[self.knee]
        said = (
            f"{self.knob} {best.setting}: {best.error:.2g} {self.unit} of "
            f"{self.quantity} costs {best.seconds:.2g} s here"
        ).replace("  ", " ")
        factor = self._halving_factor(best)
        if factor is None:
            return f"{said}; no setting tried is better."
        return f"{said}; the next halving costs {factor:.2g}×."

    def _halving_factor(self, best: CostPoint) -> float | None:
        """Return how many times dearer half the error is, from the next point on."""
        better = [p for p in self.front if p.seconds > best.seconds]
        if not better or best.error <= 0 or best.seconds <= 0:
            return None
        after = better[0]
        gain = math.log2(best.error / max(after.error, 1e-300))
        return float(2 ** (math.log2(after.seconds / best.seconds) / gain))

    def save(self, path: str | Path) -> Path:
        """Write the curve as JSON."""
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        data = {"format": FORMAT, "schema": SCHEMA, "software": software_version()}
        text = json.dumps(data | asdict(self) | {"sentence": self.sentence}, indent=1)
        target.write_text(text + "\n", encoding="utf-8")
        return target

    @staticmethod
    def load(path: str | Path) -> "CostCurve":
        """Read a curve that `save` wrote.

        Raises
        ------
        DatasetError
            If the file is not one, or newer than this program.
        """
        try:
            data: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise DatasetError(
                f"cannot read {path} as cost results: {error}"
            ) from error
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise DatasetError(f"{path} holds no cost results (format {FORMAT})")
        if data["schema"] > SCHEMA:
            raise DatasetError(
                f"{path} has schema {data['schema']}; update this program"
            )
        fields = {k: data[k] for k in CostCurve.__dataclass_fields__}
        fields["points"] = tuple(CostPoint(**p) for p in data["points"])
        return CostCurve(**fields)


def mark_front(points: Sequence[CostPoint]) -> tuple[CostPoint, ...]:
    """Mark the Pareto front: points that no other beats in both ways.

    Examples
    --------
    >>> def at(seconds, error):
    ...     return CostPoint("", seconds, seconds, seconds, error, error, error, 1)
    >>> [p.on_front for p in mark_front([at(1, 3), at(2, 4), at(3, 1)])]
    [True, False, True]
    """

    def beaten(p: CostPoint) -> bool:
        return not (math.isfinite(p.error) and math.isfinite(p.seconds)) or any(
            q.seconds <= p.seconds
            and q.error <= p.error
            and (q.seconds < p.seconds or q.error < p.error)
            for q in points
        )

    return tuple(replace(p, on_front=not beaten(p)) for p in points)


def knee_of(points: Sequence[CostPoint]) -> int:
    """Return the index of the recommended point of the front; -1 if there is none.

    Of the logarithms of seconds and error, scaled to the unit square, it is the
    point farthest under the line between the ends of the front.

    References
    ----------
    Satopää et al., "Finding a kneedle in a haystack", ICDCSW 2011.
    """
    front = sorted(
        (k for k, p in enumerate(points) if p.on_front),
        key=lambda k: points[k].seconds,
    )
    if len(front) < 3:
        return front[-1] if front else -1
    x, y = (
        [math.log(max(getattr(points[k], name), 1e-300)) for k in front]
        for name in ("seconds", "error")
    )
    wide, tall = x[-1] - x[0], y[0] - y[-1]
    if not wide or not tall:
        return front[0]
    depth = [(y[0] - b) / tall - (a - x[0]) / wide for a, b in zip(x, y, strict=True)]
    return front[max(range(len(front)), key=depth.__getitem__)]
