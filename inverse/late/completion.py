"""What paths leave open: late sound, gains and the alarms of the gate."""

from dataclasses import dataclass, field, replace

import numpy as np

from inverse.array_parts import part_of, prefixed
from inverse.late.agreement import Agreement, bins_after
from inverse.late.alarms import completion_alarms
from inverse.late.coherence_horizon import Uncertainty, predicted_coherence
from inverse.late.energy import EnergyModel, arrival_shares
from inverse.late.even_tail import EvenTail
from inverse.late.features import PlaceFeatures
from inverse.late.gate import MOST_GAIN, Gate, TileEnergies, judge
from inverse.late.late_maps import LateMaps, chi_square_variance
from inverse.late.measured_energies import MeasuredEnergies
from inverse.late.spectral_tilt import colored, tilt_filter
from inverse.late.variant_choice import choose_variant
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.shoebox import FittedRoom
from inverse.rows.fitset import FitSet
from inverse.rows.regions import Regions, apartness
from inverse.rows.tiles import Tiles
from rir import Poses

__all__ = ["Completion"]

MOST_PAIR_GAIN = 4.0  # 12 dB: paths of a pair raised more are mostly their errors
TRIMMED_ROWS, TRIMMED_SAMPLES = (60, 150), 500_000
"""Rows that levels are put right on: as many as so many samples hold; each is answered
some twenty times (decision 0066)."""
BEGUN = 0.1  # part of a bin after the direct sound from which its energies compare


@dataclass(frozen=True, eq=False)
class Completion:
    """Complete the sound of paths, the same in both directions."""

    tiles: Tiles
    """Octaves and bins."""
    model: EnergyModel
    """Energy of any pair."""
    gate: Gate
    """Which tiles the paths fill."""
    tail: EvenTail
    """Waveform of what the energy model fills."""
    agreement: Agreement
    """How much of each tile's energy keeps its waveform."""
    alarms: list[str] = field(default_factory=list)
    """What a person should know."""
    finish: np.ndarray = field(default_factory=lambda: np.ones(1))
    """Filter of the whole answer, shape (taps,)."""

    @classmethod
    def fit(
        cls,
        fit_set: FitSet,
        early: np.ndarray,
        paths: FittedRoom | FittedMesh | None,
        *,
        measured: MeasuredEnergies | None = None,
        guide: np.ndarray | None = None,
    ) -> "Completion":
        """Learn from measured rows and what paths say of them.

        Parameters
        ----------
        fit_set : FitSet
            Measured rows.
        early : numpy.ndarray
            The paths' answer, shape (rows, n_samples); zeros without paths.
        paths : FittedRoom, FittedMesh or None
            The paths; their ``speed_of_sound`` and ``length_sd`` are used.
        measured : MeasuredEnergies, optional
            What the same rows say by themselves, where that is known already.
        guide : numpy.ndarray, optional
            Another answer, whose energies are believed in place of the paths'.
        """
        known = measured or MeasuredEnergies.of(fit_set, paths)
        loud = early if guide is None else guide
        fit_set, early, loud = known.rows, early[known.kept], loud[known.kept]
        tiles, speed, regions = known.tiles, known.speed_of_sound, known.regions
        ends = fit_set.emitters.positions, fit_set.listeners.positions
        held = _tile_energies(known, loud)
        model_misfit = known.misfit
        uncertainty = Uncertainty(walls=None if paths is None else paths.length_sd)
        expected = predicted_coherence(tiles.centers, tiles.times, speed, uncertainty)
        apart = apartness(regions(ends[0]), regions(ends[1]))
        # Filters ring before the direct sound; predicting that is no merit.
        begun = arrival_shares(fit_set.distances, speed, tiles)[0][:, None] > BEGUN
        ratio = np.where(begun, _path_ratio(held), np.nan)
        misfit = np.where(begun, model_misfit, np.nan)
        own = chi_square_variance(tiles.widths[:, None], tiles.bin_s)
        gate = judge(held, expected, ratio, misfit, apart, own)
        tail = EvenTail(0, *_timing(tiles, speed))
        alarms = completion_alarms(fit_set, gate, tiles, model_misfit, regions)
        after = bins_after(fit_set.distances, speed, tiles)
        waves = held if guide is None else _tile_energies(known, early)
        agreement = Agreement.fit(waves, after, apart)
        rough = cls(tiles, known.model, gate, tail, agreement, alarms)
        if (gate.weights == 1).all() and (gate.shares == 1).all():
            return rough
        most = min(
            max(TRIMMED_SAMPLES // fit_set.n_samples, TRIMMED_ROWS[0]), TRIMMED_ROWS[1]
        )
        some = np.arange(0, len(fit_set), -(-len(fit_set) // most))
        guided = None if guide is None else loud[some]
        energies = held.measured[some]
        return choose_variant(rough, fit_set.rows(some), early[some], energies, guided)

    def trimmed(
        self,
        rows: FitSet,
        early: np.ndarray,
        energies: np.ndarray,
        guide: np.ndarray | None = None,
    ) -> "Completion":
        """Return the completion with levels put right on average.

        `energies` are the rows' own, shape (rows, bands, bins).
        """
        ends = rows.emitters, rows.listeners
        predicted = self.apply(early, *ends, guide)
        taps = tilt_filter(rows.responses, predicted, rows.sample_rate)
        rough = replace(self, tail=replace(self.tail, tint=taps))
        predicted = rough.apply(early, *ends, guide)
        regions = self.model.features.regions
        ends = rows.emitters.positions, rows.listeners.positions
        apart = apartness(regions(ends[0]), regions(ends[1]))
        gate = self.gate.trimmed(energies, self.tiles.energies(predicted), apart)
        return replace(rough, gate=gate)

    def apply(
        self,
        early: np.ndarray,
        emitters: Poses,
        listeners: Poses,
        guide: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return completed responses, shape (rows, n_samples).

        Parameters
        ----------
        early : numpy.ndarray
            What the paths say, shape (rows, n_samples).
        emitters, listeners : Poses
            The ends.
        guide : numpy.ndarray, optional
            The answer whose energies are believed, where it was fitted with one.
        """
        first, second = emitters.positions, listeners.positions
        regions = self.model.features.regions
        apart = apartness(regions(first), regions(second))
        gains, shares, weights, trims = self.gate.between(apart)
        if (weights == 1).all() and (shares == 1).all():
            return self.tiles.gained(early, gains)
        reach = np.linalg.norm(first - second, axis=1)
        after = bins_after(reach, self.model.speed_of_sound, self.tiles)
        shares, levels = self.agreement.between(after, apart)
        shares = np.where(weights == 1, 1.0, shares)
        if self.agreement.steady:
            gains = np.where(shares > weights, np.minimum(levels, MOST_GAIN), gains)
            weights = np.maximum(weights, shares)
            trims = 1 + (trims - 1) * (1 - shares)
        energies = self.tiles.energies(early)
        loud = energies if guide is None else self.tiles.energies(guide)
        target = self._targets(loud * gains**2, first, second, weights)
        wanted = np.exp(target) * trims**2
        pair = np.sqrt(wanted / np.maximum(energies, 1e-2 * wanted + 1e-300))
        pair = np.where(weights == 1, gains, np.minimum(pair, MOST_PAIR_GAIN))
        out = self.tiles.gained(early, pair * np.sqrt(shares))
        if (shares < 1).any():
            late = self.agreement.late_gain**2 * wanted * (1 - shares)
            out += self.tail.brought(first, second, self.tiles, late)
        return colored(out, self.finish)

    def _targets(
        self,
        energies: np.ndarray,
        first: np.ndarray,
        second: np.ndarray,
        weights: np.ndarray,
    ) -> np.ndarray:
        """Return log energies between the paths' and the energy model's."""
        predicted = self.model(first, second, self.tiles)
        least = np.maximum(energies, 1e-6 * np.exp(predicted) + 1e-300)
        known = np.isfinite(predicted) & (weights < 1)
        mixed = np.full(predicted.shape, -np.inf)
        logs = np.log(least)
        model_logs = np.where(known, predicted, 0.0)
        np.add(weights * logs, (1 - weights) * model_logs, out=mixed, where=known)
        return np.where(weights == 1, logs, mixed)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        model, regions = self.model, self.model.features.regions
        tail, slopes = self.tail, max(len(one.rates) for one in model.maps)
        return {
            "sample_rate": np.array(self.tiles.sample_rate),
            "n_samples": np.array(self.tiles.n_samples),
            "rates": _padded([one.rates for one in model.maps], slopes),
            "level": np.array([one.level for one in model.maps]),
            "shares": _padded([one.shares for one in model.maps], slopes - 1),
            "profiles": model.profiles,
            "bumps": model.features.centers,
            "spacing": np.array(model.features.spacing),
            "region_places": regions.places,
            "region_shares": regions.shares,
            "speed_of_sound": np.array(model.speed_of_sound),
            "gate_gains": self.gate.gains,
            "gate_shares": self.gate.shares,
            "gate_weights": self.gate.weights,
            "gate_coherence": self.gate.coherence,
            "gate_trims": self.gate.trims,
            **prefixed("agreement", self.agreement.as_arrays()),
            "tail_seed": np.array(tail.seed),
            "tail_tint": tail.tint,
            "alarms": np.array(self.alarms, dtype=str),
            "finish": self.finish,
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Completion":
        """Rebuild what :meth:`as_arrays` returned."""
        tiles = Tiles(float(arrays["sample_rate"]), int(arrays["n_samples"]))
        regions = Regions(arrays["region_places"], arrays["region_shares"])
        features = PlaceFeatures(arrays["bumps"], float(arrays["spacing"]), regions)
        maps = []
        for rates, level, shares in zip(
            arrays["rates"], arrays["level"], arrays["shares"], strict=True
        ):
            count = int(np.isfinite(rates).sum())
            maps.append(LateMaps(rates[:count], level, shares[: count - 1]))
        speed = float(arrays["speed_of_sound"])
        model = EnergyModel(tuple(maps), arrays["profiles"], features, speed)
        gate = Gate(*(arrays[f"gate_{name}"] for name in _GATE))
        agreement = Agreement.from_arrays(part_of(arrays, "agreement"))
        seed, tint = int(arrays["tail_seed"]), arrays["tail_tint"]
        tail = EvenTail(seed, *_timing(tiles, speed), tint)
        alarms = [str(one) for one in arrays["alarms"]]
        return cls(tiles, model, gate, tail, agreement, alarms, arrays["finish"])


def _timing(tiles: Tiles, speed: float) -> tuple[float, int, float]:
    return tiles.sample_rate / speed, tiles.n_samples, tiles.sample_rate


def _padded(rows: list[np.ndarray], length: int) -> np.ndarray:
    """Stack arrays of unequal length along their first axis, NaN behind."""
    out = np.full((len(rows), length, *rows[0].shape[1:]), np.nan)
    for filled, row in zip(out, rows, strict=True):
        filled[: len(row)] = row
    return out


def _tile_energies(known: MeasuredEnergies, predicted: np.ndarray) -> TileEnergies:
    if not predicted.any():
        nothing = np.zeros_like(known.energies)
        return TileEnergies(known.energies, nothing, nothing, nothing)
    return TileEnergies(
        known.energies, *known.tiles.compared(known.rows.responses, predicted)
    )


def _path_ratio(held: TileEnergies) -> np.ndarray:
    """Return log ratios of measured energies to the paths', NaN if unknown."""
    known = (held.measured > 0) & (held.predicted > 1e-6 * held.measured)
    ratio = np.full(known.shape, np.nan)
    np.divide(held.measured, held.predicted, out=ratio, where=known)
    return np.log(ratio, out=ratio, where=known)


_GATE = ("gains", "shares", "weights", "coherence", "trims")
