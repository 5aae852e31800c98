"""What measured rows say of late sound, whatever paths say of it."""

from dataclasses import dataclass

import numpy as np

from inverse.late.energy import EnergyModel
from inverse.late.features import PlaceFeatures
from inverse.paths.open_air import free_levels
from inverse.paths.polyhedral import FittedMesh
from inverse.paths.shoebox import FittedRoom
from inverse.rows.fitset import FitSet
from inverse.rows.regions import Regions, find_regions, sight_bits
from inverse.rows.tiles import Tiles

__all__ = ["MeasuredEnergies", "log_misfit"]

MOST_ROWS, LEAST_ROWS = 400, 120  # energies vary slowly; more rows tell little more
MOST_SAMPLES = 1_000_000  # 8 MB; long responses take fewer rows
MOST_FOLDS = 5  # each costs a fit of the energy model
LEAST_PER_FOLD = 6  # rows, below which errors at places left out say nothing


@dataclass(frozen=True, eq=False)
class MeasuredEnergies:
    """Hold energies of rows and a model of them."""

    rows: FitSet
    """Those that speak."""
    kept: np.ndarray
    """Their numbers in the set they come from."""
    tiles: Tiles
    """Octaves and bins."""
    speed_of_sound: float
    """Metres per second."""
    regions: Regions
    """Rooms of the space."""
    energies: np.ndarray
    """Shape (rows, bands, bins)."""
    model: EnergyModel
    """Energy of any pair."""
    misfit: np.ndarray
    """Log energy errors of such a model at emitters left out."""

    @classmethod
    def of(
        cls, rows: FitSet, paths: FittedRoom | FittedMesh | None
    ) -> "MeasuredEnergies":
        """Learn energies of rows; `paths` tell the speed of sound and free levels."""
        most = int(np.clip(MOST_SAMPLES // rows.n_samples, LEAST_ROWS, MOST_ROWS))
        kept = np.arange(len(rows))
        if len(rows) > most:
            kept = _spread_rows(rows, most)
            rows = rows.rows(kept)
        speed = float((rows if paths is None else paths).speed_of_sound)
        tiles = Tiles(rows.sample_rate, rows.n_samples)
        ends = rows.emitters.positions, rows.listeners.positions
        free = free_levels(paths, rows.emitters, rows.listeners)
        timing = rows.distances, rows.sample_rate, speed
        regions = find_regions(*ends, sight_bits(rows.responses, *timing, free))
        features = PlaceFeatures.of(np.vstack(ends), regions)
        energies = tiles.energies(rows.responses)
        model = EnergyModel.fit(energies, *ends, tiles, features, speed)
        misfit = _left_out(energies, rows, tiles, features, model)
        return cls(rows, kept, tiles, speed, regions, energies, model, misfit)


def log_misfit(energies: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Return logs of energies less their predictions; NaN where unknown."""
    known = (energies > 0) & np.isfinite(predicted)
    log = np.full(known.shape, np.nan)
    np.log(energies, out=log, where=known)
    return log - np.where(known, predicted, 0.0)


def _spread_rows(rows: FitSet, count: int) -> np.ndarray:
    """Return rows drawn evenly over emitters."""
    order = np.argsort(rows.places, kind="stable")
    picked = order[np.linspace(0, len(order) - 1, count).astype(int)]
    return np.sort(picked)


def _left_out(
    energies: np.ndarray,
    rows: FitSet,
    tiles: Tiles,
    features: PlaceFeatures,
    model: EnergyModel,
) -> np.ndarray:
    """Return log energy errors of the energy model at emitters left out."""
    ends = rows.emitters.positions, rows.listeners.positions
    misfit = log_misfit(energies, model(*ends, tiles))
    places = np.unique(rows.places)
    if len(places) < 2 or len(rows) < LEAST_PER_FOLD * 2:
        return misfit
    for fold in range(min(len(places), MOST_FOLDS)):
        out = rows.places % MOST_FOLDS == fold
        if out.all() or not out.any():
            continue
        there = ends[0][~out], ends[1][~out]
        speed = model.speed_of_sound
        one = EnergyModel.fit(energies[~out], *there, tiles, features, speed)
        predicted = one(ends[0][out], ends[1][out], tiles)
        misfit[out] = log_misfit(energies[out], predicted)
    return misfit
