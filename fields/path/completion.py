"""What paths leave open: late sound, gains and the alarms of the gate."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fields.path.calm import CalmTail
from fields.path.energy import EnergyModel, arrival_shares
from fields.path.features import PlaceFeatures
from fields.path.fitset import FitSet
from fields.path.gate import Gate, Held, judge
from fields.path.horizon import Doubt, predicted_coherence
from fields.path.late import LateMaps, chi_square_variance
from fields.path.open_air import direct_windows, free_levels
from fields.path.regions import Regions, apartness, find_regions, sight_bits
from fields.path.tail import Tail
from fields.path.tiles import Tiles
from fields.path.tint import tint_filter
from fields.path.words import completion_alarms
from rir import Poses

__all__ = ["Completion"]

MOST_ROWS, LEAST_ROWS = 400, 120
MOST_SAMPLES = 1_000_000
MOST_FOLDS = 5
LEAST_PER_FOLD = 6
MOST_PAIR_GAIN = 4.0
TRIMMED_ROWS = 150
BEGUN = 0.1
FIRM = 0.7
LEAST_BESIDE = 0.02


@dataclass(frozen=True, eq=False)
class Completion:
    """Complete the sound of paths, the same in both directions.

    Parameters
    ----------
    tiles : Tiles
        Octaves and bins.
    model : EnergyModel
        Energy of any pair.
    gate : Gate
        Which tiles the paths fill.
    tail : Tail
        Waveform of what the energy model fills.
    alarms : list of str
        What a person should know.
    firm : bool
        Whether the direct sounds told are kept as they are.
    onset_s : float
        Delay of every arrival, seconds.
    """

    tiles: Tiles
    model: EnergyModel
    gate: Gate
    tail: Tail | CalmTail
    alarms: list[str] = field(default_factory=list)
    firm: bool = False
    onset_s: float = 0.0

    @classmethod
    def fit(
        cls,
        fit_set: FitSet,
        early: np.ndarray,
        paths: Any,
        *,
        spatial: bool = False,
    ) -> "Completion":
        """Learn from measured rows and what paths say of them.

        Parameters
        ----------
        fit_set : FitSet
            Measured rows.
        early : numpy.ndarray
            The paths' answer, shape (rows, n_samples); zeros without paths.
        paths : object or None
            The paths; their ``speed_of_sound`` and ``length_sd`` are used.
        spatial : bool
            Let the tail differ from place to place as in a diffuse field. The
            default is one even waveform, which is the better guess of each.
        """
        most = int(np.clip(MOST_SAMPLES // fit_set.n_samples, LEAST_ROWS, MOST_ROWS))
        if len(fit_set) > most:
            kept = _spread_rows(fit_set, most)
            fit_set, early = fit_set.rows(kept), early[kept]
        speed = float(getattr(paths, "speed_of_sound", fit_set.speed_of_sound))
        tiles = Tiles(fit_set.sample_rate, fit_set.n_samples)
        ends = fit_set.emitters.positions, fit_set.listeners.positions
        timing = fit_set.distances, fit_set.sample_rate, speed
        free = free_levels(paths, fit_set.emitters, fit_set.listeners)
        bits = sight_bits(fit_set.responses, *timing, free)
        regions = find_regions(*ends, bits)
        features = PlaceFeatures.of(np.vstack(ends), regions)
        held = _held(tiles, fit_set.responses, early)
        model = EnergyModel.fit(held.measured, *ends, tiles, features, speed)
        model_misfit = _left_out(held, fit_set, tiles, features, speed, model)
        doubt = Doubt(walls=getattr(paths, "length_sd", None))
        expected = predicted_coherence(tiles.centers, tiles.times, speed, doubt)
        apart = apartness(regions(ends[0]), regions(ends[1]))
        # Filters ring before the direct sound; what is told of that is no merit.
        begun = arrival_shares(fit_set.distances, speed, tiles)[0][:, None] > BEGUN
        ratio = np.where(begun, _path_ratio(held), np.nan)
        misfit = np.where(begun, model_misfit, np.nan)
        own = chi_square_variance(tiles.widths[:, None], tiles.bin_s)
        gate = judge(held, expected, ratio, misfit, apart, own)
        center = np.vstack(ends).mean(axis=0)
        tail = _tail(spatial, 0, center, tiles, speed)
        alarms = completion_alarms(fit_set, gate, tiles, model_misfit, regions)
        onset = float(getattr(getattr(paths, "room", None), "latency_s", 0.0))
        windows = direct_windows(
            timing[0], speed, onset, fit_set.n_samples, fit_set.sample_rate
        )
        firm = _firm(fit_set.responses * windows, early * windows)
        rough = cls(tiles, model, gate, tail, alarms, firm, onset)
        if (gate.weights == 1).all() and (gate.shares == 1).all():
            return rough
        some = np.arange(0, len(fit_set), -(-len(fit_set) // TRIMMED_ROWS))
        chosen = fit_set.rows(some)
        rough = rough._tinted(chosen, early[some])
        told = rough.apply(early[some], chosen.emitters, chosen.listeners)
        energies = held.measured[some], tiles.energies(told)
        return replace(rough, gate=gate.trimmed(*energies, apart[some]))

    def _tinted(self, rows: FitSet, early: np.ndarray) -> "Completion":
        """Return the completion with the rows' spectral shape on its tail."""
        if not isinstance(self.tail, CalmTail):
            return self
        told = self.apply(early, rows.emitters, rows.listeners)
        taps = tint_filter(rows.responses, told, rows.sample_rate)
        return replace(self, tail=replace(self.tail, tint=taps))

    def apply(self, early: np.ndarray, emitters: Poses, listeners: Poses) -> np.ndarray:
        """Return completed responses, shape (rows, n_samples).

        Parameters
        ----------
        early : numpy.ndarray
            What the paths say, shape (rows, n_samples).
        emitters, listeners : Poses
            The ends.
        """
        first, second = emitters.positions, listeners.positions
        regions = self.model.features.regions
        apart = apartness(regions(first), regions(second))
        gains, shares, weights, trims = self.gate.between(apart)
        if (weights == 1).all() and (shares == 1).all():
            return self.tiles.gained(early, gains)
        target = self._targets(early, first, second, gains, weights)
        wanted = np.exp(target) * trims**2
        direct = self._direct(early, first, second)
        early = early - direct
        heard = self.tiles.energies(early)
        if self.firm:
            own = self.tiles.energies(direct)
            wanted = np.maximum(wanted - own, LEAST_BESIDE * np.minimum(wanted, own))
        pair = np.sqrt(wanted / np.maximum(heard, 1e-2 * wanted + 1e-300))
        pair = np.where(weights == 1, gains, np.minimum(pair, MOST_PAIR_GAIN))
        out = self.tiles.gained(early, pair * np.sqrt(shares))
        if (shares < 1).any():
            out += self._tail(first, second, wanted * (1 - shares))
        return out + direct

    def _direct(
        self, early: np.ndarray, first: np.ndarray, second: np.ndarray
    ) -> np.ndarray:
        """Return direct sounds that are firm; tiles must not cut them in two."""
        if not self.firm:
            return np.zeros_like(early)
        reach = np.linalg.norm(first - second, axis=1)
        timing = self.model.speed_of_sound, self.onset_s
        shape = early.shape[1], self.tiles.sample_rate
        return early * direct_windows(reach, *timing, *shape)

    def _targets(
        self,
        early: np.ndarray,
        first: np.ndarray,
        second: np.ndarray,
        gains: np.ndarray,
        weights: np.ndarray,
    ) -> np.ndarray:
        """Return log energies between the paths' and the energy model's."""
        heard = self.tiles.energies(early) * gains**2
        told = self.model(first, second, self.tiles)
        least = np.maximum(heard, 1e-6 * np.exp(told) + 1e-300)
        known = np.isfinite(told) & (weights < 1)
        mixed = np.full(told.shape, -np.inf)
        logs = np.log(least)
        heard_of = np.where(known, told, 0.0)
        np.add(weights * logs, (1 - weights) * heard_of, out=mixed, where=known)
        return np.where(weights == 1, logs, mixed)

    def _tail(
        self, first: np.ndarray, second: np.ndarray, target: np.ndarray
    ) -> np.ndarray:
        """Return late sound with the energies of the tiles."""
        if isinstance(self.tail, CalmTail):
            return self.tail.brought(first, second, self.tiles, target)
        sound = self.tail(first, second)
        brought = self.tiles.energies(sound)
        # A bin that the direct sound cuts holds too little sound to be scaled.
        least = 0.5 * np.median(brought, axis=-1, keepdims=True) + 1e-300
        gains = np.sqrt(target / np.maximum(brought, least))
        return self.tiles.gained(sound, gains)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays, for a file."""
        model, regions = self.model, self.model.features.regions
        slopes = max(len(one.rates) for one in model.maps)
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
            "region_boxes": regions.boxes,
            "speed_of_sound": np.array(model.speed_of_sound),
            "gate_gains": self.gate.gains,
            "gate_shares": self.gate.shares,
            "gate_weights": self.gate.weights,
            "gate_coherence": self.gate.coherence,
            "gate_trims": self.gate.trims,
            "tail_seed": np.array(self.tail.seed),
            "tail_center": self.tail.center,
            "tail_spatial": np.array(isinstance(self.tail, Tail)),
            "tail_tint": getattr(self.tail, "tint", np.ones(1)),
            "alarms": np.array(self.alarms, dtype=str),
            "firm": np.array(self.firm),
            "onset_s": np.array(self.onset_s),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> "Completion":
        """Rebuild what :meth:`as_arrays` returned."""
        tiles = Tiles(float(arrays["sample_rate"]), int(arrays["n_samples"]))
        regions = Regions(
            arrays["region_places"], arrays["region_shares"], arrays["region_boxes"]
        )
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
        center, seed = arrays["tail_center"], int(arrays["tail_seed"])
        spatial = bool(arrays["tail_spatial"])
        tail = _tail(spatial, seed, center, tiles, speed)
        if isinstance(tail, CalmTail):
            tail = replace(tail, tint=arrays["tail_tint"])
        alarms = [str(one) for one in arrays["alarms"]]
        firm, onset = bool(arrays["firm"]), float(arrays["onset_s"])
        return cls(tiles, model, gate, tail, alarms, firm, onset)


def _tail(
    spatial: bool, seed: int, center: np.ndarray, tiles: Tiles, speed: float
) -> Tail | CalmTail:
    shape = seed, center, tiles.sample_rate / speed, tiles.n_samples
    return Tail(*shape) if spatial else CalmTail(*shape, tiles.sample_rate)


def _padded(rows: list[np.ndarray], length: int) -> np.ndarray:
    """Stack arrays of unequal length along their first axis, NaN behind."""
    out = np.full((len(rows), length, *rows[0].shape[1:]), np.nan)
    for filled, row in zip(out, rows, strict=True):
        filled[: len(row)] = row
    return out


def _spread_rows(fit_set: FitSet, count: int) -> np.ndarray:
    """Return rows drawn evenly over emitters."""
    order = np.argsort(fit_set.places, kind="stable")
    picked = order[np.linspace(0, len(order) - 1, count).astype(int)]
    return np.sort(picked)


def _firm(measured: np.ndarray, told: np.ndarray) -> bool:
    """Return whether direct sounds are told well enough to be kept whole."""
    loud = np.sqrt(np.maximum((measured**2).sum(axis=1, keepdims=True), 1e-300))
    measured, told = measured / loud, told / loud
    both = float((measured * told).sum())
    power = float((measured**2).sum() * (told**2).sum())
    return both > 0 and both**2 > FIRM * power


def _held(tiles: Tiles, measured: np.ndarray, told: np.ndarray) -> Held:
    energies = tiles.energies(measured)
    if not told.any():
        nothing = np.zeros_like(energies)
        return Held(energies, nothing, nothing, nothing)
    return Held(
        energies,
        tiles.energies(told),
        tiles.products(measured, told),
        tiles.products(measured, np.roll(told, 1, axis=0)),
    )


def _path_ratio(held: Held) -> np.ndarray:
    """Return log ratios of measured energies to the paths', NaN if unknown."""
    known = (held.measured > 0) & (held.told > 1e-6 * held.measured)
    ratio = np.full(known.shape, np.nan)
    np.divide(held.measured, held.told, out=ratio, where=known)
    return np.log(ratio, out=ratio, where=known)


def _misfit(held: Held, told: np.ndarray) -> np.ndarray:
    known = (held.measured > 0) & np.isfinite(told)
    log = np.full(known.shape, np.nan)
    np.log(held.measured, out=log, where=known)
    return log - np.where(known, told, 0.0)


def _left_out(
    held: Held,
    fit_set: FitSet,
    tiles: Tiles,
    features: PlaceFeatures,
    speed: float,
    model: EnergyModel,
) -> np.ndarray:
    """Return log energy errors of the energy model at emitters left out."""
    ends = fit_set.emitters.positions, fit_set.listeners.positions
    misfit = _misfit(held, model(*ends, tiles))
    places = np.unique(fit_set.places)
    if len(places) < 2 or len(fit_set) < LEAST_PER_FOLD * 2:
        return misfit
    for fold in range(min(len(places), MOST_FOLDS)):
        out = fit_set.places % MOST_FOLDS == fold
        if out.all() or not out.any():
            continue
        rest = ~out
        one = EnergyModel.fit(
            held.measured[rest],
            ends[0][rest],
            ends[1][rest],
            tiles,
            features,
            speed,
        )
        told = one(ends[0][out], ends[1][out], tiles)
        part = Held(*(getattr(held, name)[out] for name in _PARTS))
        misfit[out] = _misfit(part, told)
    return misfit


_GATE = ("gains", "shares", "weights", "coherence", "trims")
_PARTS = ("measured", "told", "products", "shuffled")
