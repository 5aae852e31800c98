"""What accuracy costs: points of error against seconds, and which one to take."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

from rir.cost.point import CostPoint
from rir.errors import DatasetError
from rir.records import software_version
from rir.schema import Schema

__all__ = ["COST_CURVE", "CostCurve"]

COST_CURVE = Schema("cost curve", 1, format="resounding-cost")
OUT_OF_REACH = 20.0
"""Doublings of the seconds for half the error beyond which nobody would go."""


@dataclass(frozen=True)
class CostCurve:
    """All settings of one knob.

    Parameters
    ----------
    knob : str
        What was turned, for instance ``"sweep length"``.
    quantity, unit : str
        What the error is an error of, and its unit, for instance C50 and dB. The
        unit ``"ratio"`` is one of amplitudes: it is told in decibels.
    seconds_of : str
        What the seconds are seconds of: ``"CPU"`` or ``"measuring"``.
    points : tuple of CostPoint
        In the order of the settings.
    knee : int
        Index of the recommended setting; -1 if there is none.
    per : str
        What the seconds are for one of, for instance ``"pair"``; "" for the whole.
    mark : str
        ``"SIMULATED"`` or ``"MEASURED"``; "" where neither applies.
    """

    knob: str
    quantity: str
    unit: str
    seconds_of: str
    points: tuple[CostPoint, ...]
    knee: int
    per: str = ""
    mark: str = ""

    @property
    def front(self) -> list[CostPoint]:
        """The points worth taking, cheapest first."""
        return sorted((p for p in self.points if p.on_front), key=lambda p: p.seconds)

    @property
    def sentence(self) -> str:
        """What a person needs to know, in one sentence."""
        start = f"{self.mark}: " if self.mark else ""
        if self.knee < 0:
            return f"{start}{self.knob}: no setting gave a result."
        best = self.points[self.knee]
        each = f" a {self.per}" if self.per else ""
        said = (
            f"{start}{self.knob} {best.setting}: {self.shown(best.error)} of "
            f"{self.quantity} costs {best.seconds:.2g} s{each} here"
        )
        factor = self._halving_factor(best)
        if factor is None:
            return f"{said}; more of it does not help."
        return f"{said}; the next halving costs {factor:.2g}×."

    def shown(self, error: float) -> str:
        """Return an error as a person would write it."""
        if self.unit == "ratio":
            return f"{20 * math.log10(max(error, 1e-300)):.1f} dB"
        return f"{error:.2g} {self.unit}".rstrip()

    def _halving_factor(self, best: CostPoint) -> float | None:
        """Return how many times dearer half the error is, from the next point on."""
        better = [p for p in self.front if p.seconds > best.seconds]
        if not better or best.error <= 0 or best.seconds <= 0:
            return None
        after = better[0]
        gain = math.log2(best.error / max(after.error, 1e-300))
        dearer = math.log2(after.seconds / best.seconds) / gain
        return 2**dearer if dearer < OUT_OF_REACH else None

    def save(self, path: str | Path) -> Path:
        """Write the curve as JSON."""
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        data = {**COST_CURVE.stamp, "software": software_version()}
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
            written = json.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise DatasetError(
                f"cannot read {path} as a cost curve: {error}"
            ) from error
        data = COST_CURVE.open(written, path)
        fields = {k: data[k] for k in CostCurve.__dataclass_fields__ if k in data}
        fields["points"] = tuple(CostPoint(**p) for p in data["points"])
        return CostCurve(**fields)
