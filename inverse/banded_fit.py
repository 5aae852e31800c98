"""From a fitted box to one whose walls depend on frequency and angle."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inverse.bands.band_fit import (
    DEEP_HZ,
    LEAST_ROWS,
    BandData,
    band_data,
    fit_walls,
    tuned,
)
from inverse.bands.band_places import fit_places
from inverse.bands.banded_room import BandedRoom
from inverse.bands.fitted_bands import FittedBandedRoom
from inverse.bands.half_octaves import HalfOctaves
from inverse.objects.scatter_fit import with_scatterers
from inverse.objects.tomography import with_occluders
from inverse.paths.room import OMNI, BoxRoom
from inverse.paths.shoebox import ORDERS, FittedRoom
from inverse.rows.direct import DirectSound, read_direct
from inverse.rows.fitset import FitSet
from inverse.rows.tiles import Tiles
from rir import Poses
from rir.arrays import FloatArray
from rir.physics import air_absorption

__all__ = ["fit_banded", "in_half_octaves", "start_banded"]

ROWS, FEW = 64, 32  # fewer tell patterns badly (0066); first walls need half
WORTH = 0.9  # a tenth better at rows not fitted, or one factor a wall stays (0057)
LEVEL = (0.7, 1.4)  # 3 dB: more is no want of coherence but a wrong room
TONED, TONE = 160, (0.5, 2.0)  # rows that tell a tile's mean energy; 6 dB at most
CLEAR_HZ = 400.0, 1500.0  # waves shorter than walls, longer than 50 pose errors
LOW_HZ, MIDDLE_HZ, HIGH_HZ = 200.0, 2000.0, 6000.0
"""Bands that move places: above, places 3 mm off turn phases too far at first."""
TREND = (0.6, 1.0)  # a half octave down, walls absorb as much or less
RINGING_HZ, SOFTER = 200.0, (0.1, 0.3, 0.6, 1.0, 1.5)
"""Up to here walls are scaled until a band rings as long as it does (decision 0057)."""
PROVEN = 1.02
"""Objects were proved by rows kept out; wrong poses may hide what they are worth."""
UNEXPLAINED = 0.6  # of the clearest bands' energy: images that leave more earn no fit
HOPELESS = 0.7
"""One factor a wall that leaves more of it than this: half octaves do not mend that."""
EQUAL_S = 0.08  # a loudspeaker's response; longer, the room itself gets into the source
SLANT = 0.6
"""Cosine at which a factor and an admittance are taken for the same wall."""


def start_banded(
    rows: FitSet, direct: DirectSound, room: BoxRoom, *, angled: bool
) -> BandedRoom:
    """Return a banded room that answers as a plain one does."""
    grid = HalfOctaves(rows.sample_rate, rows.n_samples)
    omega = 2 * np.pi * np.arange(len(grid.hertz)) / grid.size
    pulse = np.fft.rfft(direct.pulse, grid.size)
    source = pulse * np.exp(1j * omega * direct.lead)
    factors = np.clip(np.abs(room.walls), 0.05, 0.97)
    walls = SLANT * (1 - factors) / (1 + factors) if angled else factors
    emitting = np.zeros((grid.bands, len(room.emitting)))
    emitting[:, 0] = OMNI[0]
    loss = np.asarray(air_absorption(grid.centers)) * np.log(10) / 20
    return BandedRoom(
        replace(room, latency_s=direct.latency_s),
        grid,
        np.tile(walls.astype(np.complex128), (grid.bands, 1)),
        angled,
        loss,
        np.zeros(grid.bands),
        emitting,
        np.tile(room.listening, (grid.bands, 1)),
        source,
    )


def fit_banded(
    rows: FitSet,
    direct: DirectSound,
    room: BoxRoom,
    *,
    pose_sd_m: float,
) -> BandedRoom | None:
    """Fit a box half octave by half octave, its walls and the rows' places in turns.

    Parameters
    ----------
    rows : FitSet
        Measured rows.
    direct : DirectSound
        Their direct sounds, for the source's first spectrum.
    room : BoxRoom
        The box as fitted with one factor a wall.
    pose_sd_m : float
        Standard deviation of each stated coordinate, metres.

    Returns
    -------
    BandedRoom or None
        None where images explain too little for half octaves to be worth it.
    """
    every, rows = rows, rows.spread(ROWS)
    few = rows.spread(FEW)
    banded = _first_walls(few, direct, room)
    if banded is None:
        return None
    data = band_data(rows, banded.grid, banded.source)
    shifts = None
    for edge in (MIDDLE_HZ, HIGH_HZ):
        centers = banded.grid.centers
        chosen = (centers > LOW_HZ) & (centers < edge)
        moved = fit_places(data, banded, chosen, 2, pose_sd_m, shifts)
        data, shifts = moved.data, moved.shifts
        banded = _with_order(rows, data, moved.banded)
        banded = _equalised(rows, data.emitters, data.listeners, banded)
        again = band_data(rows, banded.grid, banded.source)
        data = again.moved(data.emitters, data.listeners)
        banded, _ = fit_walls(data, banded, 2, chosen=centers > DEEP_HZ)
        banded = _deepened(data, banded)
    banded = with_occluders(every, data, _ringing(data, banded))
    banded = with_scatterers(data, banded)
    banded = _equalised(rows, data.emitters, data.listeners, banded)
    return _levelled(rows, data, banded)


def in_half_octaves(
    rows: FitSet, fitted: FittedRoom, judged: FitSet, pose_sd_m: float
) -> FittedBandedRoom | None:
    """Return the room with banded walls where they predict other rows better."""
    if len(rows) < LEAST_ROWS or _unclear(rows.spread(FEW), fitted) > HOPELESS:
        return None
    try:
        banded = fit_banded(rows, read_direct(rows), fitted.room, pose_sd_m=pose_sd_m)
    except np.linalg.LinAlgError:
        return None
    if banded is None:
        return None
    kept = fitted.coloring, fitted.covariance, fitted.active
    better = FittedBandedRoom(banded.room, *kept, banded)
    # the first rows of a spread are those that were fitted
    fresh = judged.spread_rest(ROWS) if len(judged) > ROWS + FEW else judged
    gain = _gap(fresh, better) / max(_gap(fresh, fitted), 1e-300)
    proven = banded.occluders is not None or banded.scatterers is not None
    if gain >= (PROVEN if proven else WORTH):
        return None
    return replace(better, tones=_tones(rows.spread(TONED), better))


def _unclear(rows: FitSet, fitted: FittedRoom) -> float:
    """Return the part of the clearest bands' energy that is unexplained."""
    predicted = fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    hertz = np.fft.rfftfreq(rows.n_samples, 1 / rows.sample_rate)
    clear = (hertz > CLEAR_HZ[0]) & (hertz < CLEAR_HZ[1])
    measured, residual = (
        (np.abs(np.fft.rfft(one)[:, clear]) ** 2).sum(axis=1)
        for one in (rows.responses, rows.responses - predicted)
    )
    return float(np.mean(residual / np.maximum(measured, 1e-300)))


def _tones(rows: FitSet, fitted: FittedRoom) -> FloatArray:
    """Return gains that bring each tile's mean energy to the measured one."""
    predicted = fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    tiles = Tiles(rows.sample_rate, rows.n_samples)
    weight = 1 / np.maximum((rows.responses**2).sum(axis=1), 1e-300)
    wanted = np.tensordot(weight, tiles.energies(rows.responses), axes=1)
    found = np.tensordot(weight, tiles.energies(predicted), axes=1)
    floor = 1e-9 * float(wanted.max())
    gains = np.sqrt((wanted + floor) / (found + floor))
    return np.clip(gains, *TONE)


def _gap(rows: FitSet, fitted: FittedRoom) -> float:
    predicted = fitted.predict(rows.emitters, rows.listeners, rows.n_samples)
    return float(((rows.responses - predicted) ** 2).sum())


def _first_walls(rows: FitSet, direct: DirectSound, room: BoxRoom) -> BandedRoom | None:
    """Return walls of all bands, found from the clearest bands outwards."""
    tried = []
    for angled in (True, False):
        banded = start_banded(rows, direct, room, angled=angled)
        banded = _equalised(rows, rows.emitters, rows.listeners, banded)
        data = band_data(rows, banded.grid, banded.source)
        centers = banded.grid.centers
        clear = (centers > CLEAR_HZ[0]) & (centers < CLEAR_HZ[1])
        if not clear.any():
            return None
        banded, residual = fit_walls(data, banded, 3, chosen=clear)
        tried.append((float(residual[clear].mean()), banded, data))
    residual, banded, data = min(tried, key=lambda one: one[0])
    if residual > UNEXPLAINED:
        return None
    lowest, highest = np.flatnonzero(clear)[[0, -1]].tolist()
    banded = _copied(banded, highest, range(highest + 1, banded.grid.bands))
    upper = centers > centers[highest]
    if upper.any():
        banded, _ = fit_walls(data, banded, 2, chosen=upper)
    for band in range(lowest - 1, -1, -1):
        banded = tuned(data, _copied(banded, band + 1, [band]), band)
        alone = np.arange(banded.grid.bands) == band
        if centers[band] > DEEP_HZ:
            banded, _ = fit_walls(data, banded, 4, chosen=alone)
    return banded


def _deepened(data: BandData, banded: BandedRoom) -> BandedRoom:
    """Let the deepest bands go on as walls change in the bands above."""
    deep = np.flatnonzero(banded.grid.centers <= DEEP_HZ)
    for band in deep[::-1].tolist():
        if band + 2 >= banded.grid.bands:
            continue
        banded = _copied(banded, band + 1, [band])
        walls = banded.walls.copy()
        here, above = walls[band + 1], walls[band + 2]
        trend = np.clip(here.real / np.maximum(above.real, 1e-6), *TREND)
        walls[band] = here.real * trend + 1j * here.imag
        if not banded.angled:
            walls[band] = here
        banded = tuned(data, replace(banded, walls=walls), band)
    return banded


def _copied(banded: BandedRoom, band: int, to: Iterable[int]) -> BandedRoom:
    """Let bands start from another one."""
    parts = {name: getattr(banded, name).copy() for name in _BANDWISE}
    for one in parts.values():
        one[list(to)] = one[band]
    return replace(banded, **parts)


_BANDWISE = ("walls", "loss", "phase", "emitting", "listening")


def _with_order(rows: FitSet, data: BandData, banded: BandedRoom) -> BandedRoom:
    """Stop at the order where the sound stops, as simulators do."""
    measured = np.fft.rfft(rows.responses, banded.grid.size)
    some = slice(0, None, 4)
    ends = data.emitters[some], data.listeners[some]
    rest = measured[some] * (banded.grid.masks.sum(axis=0) > 0.5)
    errors = []
    for order in range(ORDERS + 1):
        most = order if order < ORDERS else 400
        part = replace(banded, room=banded.room.with_order(order, most))
        rest = rest - part.images(*ends) * banded.source
        errors.append(float((np.abs(rest) ** 2).sum()))
    best = int(np.argmin(errors))
    whole = errors[-1] <= 1.002 * errors[best]
    order = 400 if whole else max(best, 1)
    return replace(banded, room=replace(banded.room, least=0, order=order))


def _equalised(
    rows: FitSet, emitters: Poses, listeners: Poses, banded: BandedRoom
) -> BandedRoom:
    """Fit the source's spectrum to the rows."""
    grid = banded.grid
    measured = np.fft.rfft(rows.responses, grid.size)
    predicted = banded.images(emitters, listeners)
    weight = 1 / (np.abs(measured) ** 2).sum(axis=1, keepdims=True)
    cross = (weight * predicted.conj() * measured).sum(axis=0)
    power = (weight * np.abs(predicted) ** 2).sum(axis=0)
    floor = 1e-3 * float(power.max()) + 1e-300
    found = _smooth(cross, grid) / (_smooth(power, grid).real + floor)
    return replace(banded, source=found)


def _ringing(data: BandData, banded: BandedRoom) -> BandedRoom:
    """Let the deepest bands ring as long as they do.

    Their few waves do not tell six walls apart, but how fast energy falls is heard.
    """
    deep = banded.grid.centers <= RINGING_HZ
    if not banded.angled or not deep.any():
        return banded
    wanted = _lateness(data.targets, banded.grid)[deep]
    shares = np.array(SOFTER)
    found = []
    for share in shares:
        walls = np.where(deep[:, None], share * banded.walls.real, banded.walls.real)
        tried = replace(banded, walls=walls + 1j * banded.walls.imag)
        kernels = tried.kernels(data.weight)
        predicted = tried.envelopes(data.emitters, data.listeners, kernels, deep)
        found.append(_lateness(predicted, banded.grid)[deep])
    found = np.array(found)
    best = np.array(
        [np.interp(-w, -f, shares) for w, f in zip(wanted, found.T, strict=True)]
    )
    walls = banded.walls.copy()
    walls[deep] = best[:, None] * walls[deep].real + 1j * walls[deep].imag
    banded = replace(banded, walls=walls)
    for band in np.flatnonzero(deep).tolist():
        banded = tuned(data, banded, band)
    return banded


def _lateness(envelopes: NDArray, grid: HalfOctaves) -> FloatArray:
    """Return the log of late over early energy of each band."""
    power = (np.abs(envelopes) ** 2).mean(axis=0)
    out = np.zeros(grid.bands)
    for band in range(grid.bands):
        first, length = int(grid.starts[band]), int(grid.lengths[band])
        length = round(length * grid.n_samples / grid.size)
        mine = power[first : first + length]
        early, late = mine[: length // 2].sum(), mine[length // 2 :].sum()
        out[band] = np.log((late + 1e-300) / (early + 1e-300))
    return out


def _levelled(rows: FitSet, data: BandData, banded: BandedRoom) -> BandedRoom:
    """Give each half octave the energy it has: what agrees alone is too quiet."""
    measured = np.abs(np.fft.rfft(rows.responses, banded.grid.size)) ** 2
    images = banded.images(data.emitters, data.listeners)
    predicted = np.abs(images * banded.source) ** 2
    weight = 1 / measured.sum(axis=1)
    masks = banded.grid.masks
    found = masks @ (weight @ predicted)
    ratio = masks @ (weight @ measured) / np.maximum(found, 1e-300)
    gain = np.sqrt(np.clip(ratio, *LEVEL)) @ masks + (1 - masks.sum(axis=0))
    return replace(banded, source=banded.source * gain)


def _smooth(spectrum: NDArray, grid: HalfOctaves) -> NDArray[np.complex128]:
    """Keep what lasts no longer than a source's response."""
    at = np.arange(grid.size)
    around = np.minimum(at, grid.size - at) / (EQUAL_S * grid.sample_rate)
    window = np.where(around < 1, np.cos(0.5 * np.pi * np.minimum(around, 1)) ** 2, 0)
    kept = np.fft.irfft(spectrum, grid.size) * window
    return np.fft.rfft(kept)
