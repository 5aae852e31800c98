"""The low part of rows at a low rate, where trying a room costs milliseconds."""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.bank import PulseBank, ideal_bank
from inverse.paths.box_fit import BoxStep, fit_room, quick_energies
from inverse.paths.oriented_box import OrientedBox
from inverse.paths.room import OMNI, BoxRoom
from inverse.paths.shoebox import FIRST_FACTOR
from inverse.rows.direct import DirectSound
from inverse.rows.fitset import FitSet
from rir.arrays import FloatArray

__all__ = ["LowSound", "TriedRoom"]

ROWS, EDGE_HZ, WINDOW_S = 48, 800.0, 0.05
"""Of a trial: a row is then a hundred samples, a fit 10 to 30 ms (decision 0067)."""
SHARE = 0.8  # band edge over half the low rate
HALF = 10  # samples of the low rate on each side of a pulse
LEAD = 4  # samples of the low rate before the first, for a pulse that begins early
PATTERN = 4
"""Harmonics of the emitter, of first order: below 800 Hz loudspeakers have no more."""
REACH_M = 19.0  # longest path: a little beyond the window
WHOLE = 400  # an order that no path within the reach comes to


@dataclass(frozen=True, eq=False)
class TriedRoom:
    """Hold a room that was tried and the part of the low energy it leaves."""

    room: BoxRoom
    left: float

    @property
    def box(self) -> OrientedBox:
        """The walls."""
        return self.room.box


@dataclass(frozen=True, eq=False)
class LowSound:
    """Hold rows below `EDGE_HZ` at a rate that just holds them."""

    rows: FitSet
    """Filtered and thinned out."""
    latency_s: float
    """Seconds before every arrival in them."""
    level: float
    """Of a direct sound at 1 m."""
    pulse: PulseBank
    """Shape of an arrival."""
    energy: float
    """Of all rows, without what is too slow to count."""

    @classmethod
    def of(cls, rows: FitSet, direct: DirectSound) -> "LowSound":
        """Filter and thin out rows."""
        few = rows.spread(ROWS)
        thin = max(1, int(rows.sample_rate * SHARE / (2 * EDGE_HZ)))
        rate = rows.sample_rate / thin
        kept = int((WINDOW_S + direct.latency_s) * rate) + LEAD
        sound = _thinned(few.responses, thin)[:, :kept]
        energy = float(quick_energies(sound, rate).sum())
        peak = direct.pulse[int(np.argmax(np.abs(direct.pulse)))]
        return cls(
            replace(few, responses=sound, sample_rate=rate),
            direct.latency_s + LEAD / rate,
            float(peak) or 1.0,
            ideal_bank(2 * HALF, SHARE),
            max(energy, 1e-300),
        )

    def room(self, box: OrientedBox) -> BoxRoom:
        """Return a room to start from: equal walls, the same level all round."""
        emitting = np.zeros(PATTERN)
        emitting[0] = np.sqrt(4 * np.pi) * self.level
        return BoxRoom(
            box,
            self.rows.speed_of_sound,
            self.latency_s,
            np.where(box.found, FIRST_FACTOR, 1e-3),
            emitting,
            OMNI.copy(),
            self.pulse,
            self.rows.sample_rate,
            WHOLE,
            REACH_M,
        )

    def tried(self, room: BoxRoom, turns: int, geometry: bool = False) -> TriedRoom:
        """Fit walls' factors and the emitter's pattern, or the geometry as well."""
        step = BoxStep(EDGE_HZ, WHOLE, turns, geometry=geometry)
        found = fit_room(self.rows, room, step, self.rows.responses)
        return TriedRoom(found.room, float(found.errors.sum()) / self.energy)

    def without_lead(self, room: BoxRoom) -> BoxRoom:
        """Return the room without the latency that thinning out brought."""
        late = room.latency_s - LEAD / self.rows.sample_rate
        return replace(room, latency_s=late)

    def left(self, room: BoxRoom, rows: FitSet) -> float:
        """Return the energy a room leaves of some of the rows."""
        gap = rows.responses - room.render(
            rows.emitters, rows.listeners, rows.n_samples
        )
        return float(quick_energies(gap, rows.sample_rate).sum())


def _thinned(responses: FloatArray, thin: int) -> FloatArray:
    """Return every n-th sample behind the low-pass of `ideal_bank`, `LEAD` early."""
    half = HALF * thin
    at = np.arange(-half, half + 1) / thin
    window = np.i0(8.0 * np.sqrt(np.clip(1 - (at / HALF) ** 2, 0, None))) / np.i0(8.0)
    pulse = SHARE * np.sinc(SHARE * at) * window
    size = responses.shape[1] + 2 * half
    spectra = np.fft.rfft(responses, size) * np.fft.rfft(pulse, size)
    heard = np.fft.irfft(spectra, size)[:, half - LEAD * thin :]
    return np.ascontiguousarray(heard[:, ::thin])
