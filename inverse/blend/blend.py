"""Paths, interpolated rows and late sound, blended by errors at places left out.

Paths, rows interpolated on their direct sounds and, with directional loudspeakers,
rows alike in the loudspeaker's frame are mixed tile by tile; the completion puts the
energies right and fills in late sound; direct levels follow the loudspeaker's aim.
Each part is kept only where it is nearer to rows whose emitter it has not heard.
"""

import json
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from inverse.array_parts import part_of
from inverse.blend.aligned import AlignedRows
from inverse.blend.direct_levels import DirectLevels
from inverse.blend.mixture import mix, mixing_weights
from inverse.late.completion import Completion
from inverse.late.measured_energies import MeasuredEnergies
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.shoebox import FittedRoom
from inverse.rows.directivity import directivity
from inverse.rows.fitset import FitSet
from inverse.rows.proof import Proof, prove
from inverse.rows.tiles import Tiles
from inverse.rows.unexplained import BELIEVED
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["Blend"]

AIMED = 0.3
"""Part of the levels' variance that the aim must explain for rows alike to be asked."""
LEAST_ROWS = 16
"""Rows to interpolate between: of fewer, those left out have no neighbours."""
ROWS_S = 0.25  # later than this rows of other places say nothing but energies


@dataclass(frozen=True, eq=False)
class Blend:
    """Complete the sound of paths by interpolated rows and late sound."""

    rows: AlignedRows | None
    """Rows to interpolate between; None where they help nowhere."""
    aimed: bool
    """Whether rows alike in the loudspeaker's frame are heard as well."""
    weights: FloatArray
    """Of the paths, the rows and the rows alike. Shape (voices, bands, bins)."""
    completion: Completion
    """Energies and late sound."""
    guided: bool = False
    """Whether energies are those of interpolated rows, in place of the mixture's."""
    levels: DirectLevels | None = None
    """Levels of direct sounds."""
    proof: Proof = field(default_factory=Proof)
    """Scores at emitters left out."""
    alarms: list[str] = field(default_factory=list)
    """What a person should know."""

    @classmethod
    def fit(
        cls,
        rows: FitSet,
        judged: FitSet,
        early: FloatArray,
        paths: FittedRoom | FittedMesh,
        *,
        aimed: bool | None = None,
        latency_s: float = 0.0,
    ) -> "Blend":
        """Fit to measured rows what completes their paths.

        Parameters
        ----------
        rows : FitSet
            All measured rows.
        judged : FitSet
            Those to judge by.
        early : ndarray
            Paths' sound of the judged rows, shape (judged, n_samples).
        paths : FittedRoom or FittedMesh
            What predicted it; its speed of sound and spread of lengths are used.
        aimed : bool, optional
            Whether the devices differ in pattern; found out when left out.
        latency_s : float
            Of every arrival, seconds.
        """
        tiles = Tiles(rows.sample_rate, rows.n_samples)
        if aimed is None:
            aimed = directivity(rows, latency_s) > AIMED
        kept = None
        if len(rows) >= LEAST_ROWS:
            kept = AlignedRows.of(rows.cut(round(ROWS_S * rows.sample_rate)))
        voices = [early]
        if kept is not None:
            voices.append(kept.left_out(judged))
            if aimed:
                voices.append(kept.left_out(judged, aimed=True))
        measured = MeasuredEnergies.of(judged, paths)
        found = {}
        weights = mixing_weights(judged.responses, voices, tiles)
        mixed = mix(tiles, weights, voices)
        for name, guide in _guides(judged, voices).items():
            known = Completion.fit(judged, mixed, paths, measured=measured, guide=guide)
            ends = judged.emitters, judged.listeners
            found[name] = known, known.apply(mixed, *ends, guide)
        tried = {name: one[1] for name, one in found.items()}
        scores = prove(judged, tried if len(found) > 1 else {})
        best = scores.best if len(found) > 1 else next(iter(found))
        known = {"path": scores.scores[best]} if len(found) > 1 else {}
        completion, answer = found[best]
        guided = best == "rows"
        if not guided and not weights[1:].any():
            kept, weights = None, weights[:1]
        aimed = aimed and kept is not None
        parts = kept, aimed, weights, completion, guided
        rest = cls(*parts, alarms=completion.alarms)
        levels = None
        if aimed and judged.n_places > 1:
            levels = DirectLevels.fit(judged, answer, latency_s)
            moved = levels.apply(answer, judged.emitters, judged.listeners)
            better = prove(judged, {"path": answer, "moved": moved}, known)
            known = {"path": better.scores[better.best]}
            levels, answer = (
                (levels, moved) if better.best == "moved" else (None, answer)
            )
        final = {"path": answer}
        if len(voices) > 1:
            final["rows"] = voices[1]
        return replace(rest, levels=levels, proof=prove(judged, final, known))

    def apply(self, early: FloatArray, emitters: Poses, listeners: Poses) -> FloatArray:
        """Return completed responses, shape (rows, n_samples).

        Parameters
        ----------
        early : ndarray, shape (rows, n_samples)
            The paths' sound.
        emitters, listeners : Poses
            The ends.
        """
        voices = [early]
        if self.rows is not None:
            ends = emitters, listeners, early.shape[1]
            voices.append(self.rows.predict(*ends))
            if self.aimed:
                voices.append(self.rows.predict(*ends, aimed=True))
        return self._completed(voices, emitters, listeners)

    def left_out(self, early: FloatArray, rows: FitSet) -> FloatArray:
        """Return completed responses of measured rows, by other emitters' rows only."""
        voices = [early]
        if self.rows is not None:
            voices.append(self.rows.left_out(rows))
            if self.aimed:
                voices.append(self.rows.left_out(rows, aimed=True))
        return self._completed(voices, rows.emitters, rows.listeners)

    def _completed(
        self, voices: list[FloatArray], emitters: Poses, listeners: Poses
    ) -> FloatArray:
        mixed = mix(self.completion.tiles, self.weights, voices)
        guide = voices[1] if self.guided else None
        answer = self.completion.apply(mixed, emitters, listeners, guide)
        if self.levels is not None:
            answer = self.levels.apply(answer, emitters, listeners)
        return answer

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        arrays = {
            "weights": self.weights,
            "aimed": np.array(self.aimed),
            "guided": np.array(self.guided),
        }
        parts = {"rows": self.rows, "launch": self.levels}
        for name, part in parts.items():
            held = {} if part is None else vars(part)
            arrays |= {f"{name}.{key}": np.asarray(one) for key, one in held.items()}
        arrays["alarms"] = np.array(self.alarms, dtype=str)
        arrays["proof"] = np.array(json.dumps(self.proof.scores))
        late = self.completion.as_arrays()
        return arrays | {f"late.{name}": one for name, one in late.items()}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Blend":
        """Rebuild what :meth:`as_arrays` returned."""
        rows, levels = part_of(arrays, "rows"), part_of(arrays, "launch")
        return cls(
            AlignedRows(**_with_scalars(rows)) if rows else None,  # type: ignore
            bool(arrays["aimed"]),
            arrays["weights"],
            Completion.from_arrays(part_of(arrays, "late")),
            bool(arrays.get("guided", False)),
            DirectLevels(**_with_scalars(levels)) if levels else None,  # type: ignore
            Proof(json.loads(str(arrays["proof"]))),
            [str(one) for one in arrays["alarms"]],
        )


def _guides(judged: FitSet, voices: list[FloatArray]) -> dict[str, FloatArray | None]:
    """Return answers to take energies from: rows' as well where paths are poor."""
    left = judged.responses - voices[0]
    loud = float((judged.responses**2).sum())
    if len(voices) < 2 or float((left**2).sum()) < BELIEVED * loud:
        return {"mixture": None}
    return {"mixture": None, "rows": voices[1]}


def _with_scalars(arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    return {name: one if one.ndim else one.item() for name, one in arrays.items()}
