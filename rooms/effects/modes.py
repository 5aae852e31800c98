"""Low-frequency modes: the wave equation below a crossover.

In a box the image sources carry the modes themselves (with real reflection
factors they are the modal sum), so only rooms of other shapes call for a grid.
"""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rir import GainPattern
from rir.arrays import FloatArray
from rooms.effects.effect import Effect, Need, Tolerance, judged
from rooms.scene import Scene
from rooms.sound import Budget, Sound, Work

if TYPE_CHECKING:
    from rooms.wave_grid import WaveGrid

__all__ = ["MODES", "crossover_of", "marched_octaves"]

_HIGHEST, _LOWEST = 350.0, 60.0
"""Crossovers [Hz]: work grows with the fourth power of the highest; at the lowest, half
an octave of cross-over ends below the lowest octave, and nothing counted changes."""

_CELLS = 40_000
"""Bounds the work of an emitter, which grows with the power 4/3 of the cells."""

_PER_DB = {
    "level_db": 1.0,
    "clarity_db": 2.0,
    "reverberation_percent": 12.0,
    "early_decay_percent": 30.0,
}
"""What the lowest octave strays per dB of level (benchmarks/planner_honesty)."""

_SKIRT = 0.8
"""How far below its edge, as a factor, the lowest octave still hears single modes."""

_WIDTH = 0.5
"""Octaves over which one solution fades into the next."""

_ALIKE = 0.01
"""Absorption that differs by less between octaves is one: tables state no more."""

_RUMBLE = 12.0
"""Below this [Hz] the grid is faded out: the impulse moves air for good, and the
pressure of a closed room would climb, which no loudspeaker makes it do."""


def schroeder_frequency(scene: Scene) -> float:
    """Return up to where single modes stand out [Hz].

    That is 2000 sqrt(T / V) with Eyring's T of the octave that it lies in; of the next
    below, where that of none does.

    References
    ----------
    M. R. Schroeder, JASA 99, 3240 (1996).
    """
    decay = np.minimum(scene.eyring_t60(), 10.0)
    found = 2000 * np.sqrt(decay / max(scene.geometry.volume, 1e-6))
    edges = _edges(scene)
    inside = found > np.concatenate([[0.0], edges])
    return float(np.max(np.where(inside, np.minimum(found, [*edges, np.inf]), 0.0)))


def _edges(scene: Scene) -> FloatArray:
    """Return where octaves meet [Hz]."""
    return np.sqrt(scene.bands[1:] * scene.bands[:-1])


def crossover_of(scene: Scene, budget: Budget) -> float:
    """Return the crossover [Hz]: the Schroeder frequency, within what a grid bears."""
    bearable = (scene.speed_of_sound / Work.cells_per_wave) * (
        _CELLS / max(scene.geometry.volume, 1e-6)
    ) ** (1 / 3)
    limits = schroeder_frequency(scene), _HIGHEST, bearable, budget.sample_rate / 5
    return float(min(limits))


def marched_octaves(scene: Scene, budget: Budget) -> NDArray[np.bool_]:
    """Tell which octaves hear the grid, if only at their lower edge; always the lowest.

    Half of the cross-over lies above the crossover.
    """
    heard = scene.bands / np.sqrt(2) < 2 ** (_WIDTH / 2) * crossover_of(scene, budget)
    heard[0] = True
    return heard


def needed(scene: Scene, budget: Budget, tolerance: Tolerance) -> Need:
    """Judge by how far up single modes stand out."""
    frequency = schroeder_frequency(scene)
    if scene.geometry.lattice:
        return Need(False, "in a box the images carry the modes themselves")
    if not scene.geometry.watertight:
        return Need(False, "an open mesh encloses no air to make a grid of")
    edge = float(scene.bands[0]) / np.sqrt(2)
    if frequency < _SKIRT * edge:
        why = f"single modes end at {frequency:.0f} Hz, below the lowest octave"
        return Need(False, why)
    # levels stray by about 5.6 dB where modes do not overlap
    stray = 5.6 * min(1.0, frequency / edge - _SKIRT)
    errors = {kind: factor * float(stray) for kind, factor in _PER_DB.items()}
    why = f"single modes stand out up to {frequency:.0f} Hz"
    if crossover_of(scene, budget) <= _LOWEST:
        return Need(False, f"{why}, out of reach of a grid", errors)
    return judged(tolerance, errors, why, 0.05)


def apply(scene: Scene, sound: Sound) -> None:
    """Replace what lies below the crossover by the solution on a grid."""
    crossover = crossover_of(scene, sound.budget)
    if crossover <= 0 or not np.isfinite(crossover):
        return

    def finish(responses: FloatArray) -> FloatArray:
        return _joined(scene, sound, responses, crossover)

    sound.finishers.append(finish)


def _joined(
    scene: Scene, sound: Sound, responses: FloatArray, crossover: float
) -> FloatArray:
    """Cross over from grids to the responses, half an octave wide."""
    budget = sound.budget
    length = 2 * budget.n_samples
    f = np.asarray(np.fft.rfftfreq(length, 1 / budget.sample_rate), dtype=np.float64)
    spectrum = np.fft.rfft(responses, length, axis=-1) * (1 - _below(f, crossover))
    rest = np.ones_like(f)
    for octave, top in _octaves(scene, crossover):
        keep = rest * _below(f, top)
        rest = rest - keep
        used = (keep > 1e-9) & (f > 0)
        # where paths take over, they stray by more than cells at the end of the skirt
        highest = top if top == crossover else top * 2 ** (_WIDTH / 2)
        span = float(f[used][0]), highest
        spectrum[:, used] += _low(scene, sound, f[used], octave, span) * keep[used]
    if _marched(budget) < budget.duration:
        later = np.fft.rfft(responses * _later(budget), length, axis=-1)
        spectrum += later * _below(f, crossover)
    return np.fft.irfft(spectrum, length, axis=-1)[:, : budget.n_samples]


def _below(f: FloatArray, top: float) -> FloatArray:
    """Return a gain that falls from 1 to 0 around a frequency."""
    octaves = np.log2(np.maximum(f, 1e-6) / top)
    return np.cos(np.pi / 2 * np.clip(octaves / _WIDTH + 0.5, 0, 1)) ** 2


def _octaves(scene: Scene, crossover: float) -> list[tuple[int, float]]:
    """Return octaves whose walls differ, and up to where each counts [Hz].

    An octave of which less is left below the crossover than it takes to cross over has
    no grid of its own.
    """
    tops = [edge for edge in _edges(scene) if edge * 2 ** (_WIDTH / 2) < crossover]
    count = len(tops)
    tops.append(crossover)
    alike = [
        not scene.walls
        and np.allclose(scene.absorption[:, k], scene.absorption[:, k + 1], atol=_ALIKE)
        for k in range(count)
    ]
    return [(k, tops[k]) for k in range(count + 1) if k == count or not alike[k]]


def _marched(budget: Budget) -> float:
    """Return how long the grid is marched [s]."""
    return min(budget.work.grid_until, budget.duration)


def _later(budget: Budget) -> FloatArray:
    """Return factors that fade in as the grid fades out, the energies adding to one."""
    from rooms.multipoles import ending

    out = ending(round(_marched(budget) * budget.sample_rate))
    return np.sqrt(1 - np.pad(out, (0, budget.n_samples - len(out))) ** 2)


def _low(
    scene: Scene,
    sound: Sound,
    frequencies: FloatArray,
    octave: int,
    span: tuple[float, float],
) -> NDArray[np.complex128]:
    """Return transfer functions from the grid, gain patterns of first order applied."""
    from rooms.multipoles import Moments, transfer

    fineness = sound.budget.work.cells_per_wave
    grid, faded = _grid(scene, fineness, octave, span)
    omni = GainPattern.omni()
    emitting, listening = sound.patterns or (omni, omni)
    turns = sound.emitter.orientation[None], sound.listeners.orientations
    moments = (
        Moments.of(emitting, turns[0], frequencies),
        Moments.of(listening, turns[1], frequencies),
    )
    places = sound.emitter.position, sound.listeners.positions
    duration = _marched(sound.budget)
    return transfer(grid, places, moments, frequencies, duration, faded)


@lru_cache(maxsize=8)
def _grid(
    scene: Scene, fineness: float, octave: int, span: tuple[float, float]
) -> tuple["WaveGrid", FloatArray]:
    """Return a grid and the filter of its rumble, set up once for all emitters."""
    from scipy.signal import butter

    from rooms.wave_grid import WaveGrid

    lowest, highest = span
    grid = WaveGrid(scene, highest, fineness, octave, lowest)
    rise = butter(2, _RUMBLE, "highpass", fs=grid.sample_rate, output="sos")
    return grid, np.asarray(rise, dtype=np.float64)


MODES = Effect("modes", "low frequencies by the wave equation (FDTD)", needed, apply)
