"""Turn gathered sound into samples."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from rir import GainPattern
from rir.arrays import FloatArray, IntArray
from rir.pose import rotate
from rooms.box_images import walls_met
from rooms.lanes import BandLanes
from rooms.sound import Arrivals, Lattice, Sound

__all__ = ["render"]

_CHUNK = 8
"""Listeners rendered in one compiled call."""


def render(sound: Sound) -> FloatArray:
    """Return the responses at all listeners, shape (listeners, n_samples).

    Parameters
    ----------
    sound : Sound
        What the effects have gathered.
    """
    count = len(sound.listeners)
    out = np.empty((count, sound.budget.n_samples))
    renderer = _Renderer(sound)
    grid = renderer.new_grid()
    for first in range(0, count, _CHUNK):
        part = range(first, min(first + _CHUNK, count))
        out[part.start : part.stop] = renderer.responses(part, grid)
    for finish in sound.finishers:
        out = finish(out)
    return out


def _tells_apart(sound: Sound) -> Iterator[FloatArray]:
    """Yield all that may differ from band to band, shapes (..., bands)."""
    if sound.air_loss is not None:
        yield sound.air_loss
    bands = sound.scene.bands
    for pattern in sound.patterns or ():
        if len(pattern.bands) > 1:
            yield pattern.at_bands(bands).coefficients.T
    if sound.lattice is not None:
        yield sound.lattice.reflection
        if sound.lattice.by_angle is not None:
            yield sound.lattice.by_angle
    for path in sound.arrivals:
        yield path.gain
    if sound.waves is not None:
        yield sound.waves.amplitude


def _axis(lattice: Lattice, axis: int, reach: float, lanes: BandLanes) -> Any:
    """Return image numbers, gains and reflection counts along one axis."""
    length = float(lattice.size[axis])
    count = min(int(reach / length) + 2, lattice.max_order)
    index = np.arange(-count, count + 1)
    near, far = (times[:, None] for times in walls_met(index))
    if lattice.by_angle is None:
        walls = lattice.reflection[2 * axis : 2 * axis + 2]
        gain = walls[0] ** near * walls[1] ** far
        return index, lanes.fit(gain), np.abs(index)
    walls = lattice.by_angle[2 * axis : 2 * axis + 2]
    gain = walls[0] ** near[..., None] * walls[1] ** far[..., None]
    # a row for each image and class of angles
    return index, lanes.fit(gain.reshape(-1, gain.shape[-1])), np.abs(index)


class _Renderer:
    """What all listeners of one sound share, prepared once."""

    def __init__(self, sound: Sound) -> None:
        from rooms.kernels import pulses

        budget, scene = sound.budget, sound.scene
        self.sound = sound
        centers = tuple(map(float, scene.bands))
        angled = sound.lattice is not None and sound.lattice.by_angle is not None
        self.lanes = BandLanes(_tells_apart(sound), centers, padded=angled)
        self.scale = budget.sample_rate / scene.speed_of_sound
        self.rows = 0
        self.fading = np.zeros(0)
        self.orders = (1, 0)
        angles = None if sound.lattice is None else sound.lattice.by_angle
        self.classes = 1 if angles is None else angles.shape[1]
        empty = np.zeros(0, dtype=np.int64)
        self.axes: Any = ((empty, np.zeros((0, self.lanes.width)), empty),) * 3
        if sound.lattice is not None:
            self._prepare(sound.lattice)
        self.ends = self._ends()
        self.paths = self._pack(sound.arrivals)
        self.waves = self._drawn()
        if len(self.lanes) == 1:
            bank = pulses.pulse_bank()[None].astype(np.float32)
            banks = bank, np.array([[8, 0, pulses.TAPS]])
        else:
            rate, most = budget.sample_rate, budget.work.moments
            banks = pulses.lane_banks(self.lanes.centers, rate, most)
        self.shaping = (self._decay(), *banks)

    def new_grid(self) -> FloatArray:
        most = 8 if len(self.lanes) == 1 else self.sound.budget.work.moments
        return np.zeros((self.sound.budget.n_samples + 1, most, self.lanes.width))

    def _prepare(self, lattice: Lattice) -> None:
        limit = lattice.until * self.sound.budget.sample_rate
        far = lattice.farthest * self.scale
        rows = int(np.ceil(min(limit, far))) + 1
        self.rows = min(rows, self.sound.budget.n_samples + 1)
        self.orders = (lattice.from_order, lattice.max_order)
        self.fading = self._fading(lattice)
        reach = self.rows / self.scale
        self.axes = tuple(_axis(lattice, k, reach, self.lanes) for k in range(3))

    def _fading(self, lattice: Lattice) -> FloatArray:
        """Return the factors of the last rows of images, which fade until their end."""
        if lattice.fading <= 0:
            return np.zeros(0)
        times = np.arange(self.rows) / self.sound.budget.sample_rate
        left = np.clip((lattice.until - times) / lattice.fading, 0, 1)
        return np.sin(np.pi / 2 * left[left < 1])

    def _ends(self) -> Any:
        """Return whether there are gain patterns, their turns and coefficients."""
        count, width = len(self.sound.listeners), self.lanes.width
        if self.sound.patterns is None:
            none, table = np.zeros((width, 1)), np.zeros((0, width))
            turns = np.zeros((count, 3, 3))
            return False, np.eye(3), none, turns, none, table, table
        emitting, listening = (
            np.ascontiguousarray(self.lanes.fit(pattern.T).T)
            for pattern in (
                pattern.at_bands(self.sound.scene.bands).coefficients
                for pattern in self.sound.patterns
            )
        )
        turns = np.stack([_turn(q) for q in self.sound.listeners.orientations])
        # only images look gains up
        side = self.sound.budget.work.directions if self.sound.lattice else 0
        tables = (_gain_table(rows, side) for rows in (emitting, listening))
        turn = _turn(self.sound.emitter.orientation)
        return True, turn, emitting, turns, listening, *tables

    def _decay(self) -> FloatArray:
        rows = self.sound.budget.n_samples + 1
        if self.sound.air_loss is None:
            return np.ones((rows, self.lanes.width))
        way = np.arange(rows) / self.scale
        return np.exp(-self.lanes.fit(self.sound.air_loss) / 2 * way[:, None])

    def _drawn(self) -> Any:
        """Return waves, what the emitter's pattern sends along them, and rates."""
        from rooms.kernels.deposit import gains_towards

        waves, rate = self.sound.waves, float(self.sound.budget.sample_rate)
        if waves is None:
            drawn = np.zeros(0), np.zeros(0), np.zeros((2, 0, 3))
            sent = np.zeros((2, 0, self.lanes.width))
            return np.zeros(3), drawn, sent, (rate, rate)
        ways = np.stack([waves.one, waves.other])
        weighed, turn, rows = self.ends[:3]
        sent = np.zeros((2, len(waves.time) if weighed else 0, self.lanes.width))
        if weighed:
            gains_towards(turn, rows, ways, sent)
        rates = rate, 1.0 / waves.step
        return waves.center, (waves.time, waves.sign, ways), sent, rates

    def _pack(
        self, arrivals: list[Arrivals]
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return starts, delays [samples] and gains, listener by listener."""
        count = len(self.sound.listeners)
        if not arrivals:
            return (
                np.zeros(count + 1, int),
                np.zeros(0),
                np.zeros((0, self.lanes.width)),
            )
        listener = np.concatenate([a.listener for a in arrivals])
        delay = np.concatenate([a.delay for a in arrivals])
        gain = np.concatenate([self._weighed(a) for a in arrivals])
        order = np.argsort(listener, kind="stable")
        starts = np.searchsorted(listener[order], np.arange(count + 1))
        rate = self.sound.budget.sample_rate
        return starts, delay[order] * rate, self.lanes.fit(gain[order])

    def _weighed(self, arrivals: Arrivals) -> FloatArray:
        if self.sound.patterns is None:
            return arrivals.gain
        turns = self.sound.listeners.orientations[arrivals.listener]
        return arrivals.gain * self._weight(turns, arrivals.departure, arrivals.arrival)

    def _weight(
        self, orientation: FloatArray, departure: FloatArray, arrival: FloatArray
    ) -> FloatArray:
        """Return the gain of both ends for directions in the room frame."""
        emitting, listening = self.sound.patterns or (GainPattern.omni(),) * 2
        bands = self.sound.scene.bands
        local = rotate(orientation * [-1, -1, -1, 1], arrival)
        leave = emitting.at_bands(bands).gain(self.sound.emitter.to_local(departure))
        return leave * listening.at_bands(bands).gain(local)

    def responses(self, part: range, grid: FloatArray) -> FloatArray:
        """Return the responses of some listeners, shape (listeners, n_samples)."""
        from rooms.kernels import pulses, responses

        sound, n = self.sound, self.sound.budget.n_samples
        starts, delays, gains = self.paths
        some = starts[part.start : part.stop + 1]
        inside = slice(some[0], some[-1])
        paths = some - some[0], delays[inside], gains[inside]
        size = sound.lattice.size if sound.lattice is not None else np.zeros(3)
        lattice = size, self.axes, self.orders, self.rows, self.fading, self.classes
        turns = self.ends[3][part.start : part.stop]
        ends = (*self.ends[:3], turns, *self.ends[4:])
        center, drawn, sent, rates = self.waves
        waves = center, drawn, self._amplitudes(part), sent, rates
        listeners = sound.listeners.positions[part.start : part.stop]
        shape = (len(part), len(self.lanes), n + 1 + pulses.TAPS)
        out = np.zeros(shape, dtype=np.float32)
        responses.fill_and_shape(
            sound.emitter.position, listeners, lattice, ends, paths, waves,
            self.scale, grid, self.shaping, out,
        )  # fmt: skip
        out = out[:, :, pulses.LEAD : pulses.LEAD + n].astype(np.float64)
        rate = sound.budget.sample_rate
        return np.stack([self.lanes.join(signals, rate) for signals in out])

    def _amplitudes(self, part: range) -> FloatArray:
        """Return amplitudes of waves, shape (1 or listeners, steps, lanes)."""
        if self.sound.waves is None:
            return np.zeros((1, 1, self.lanes.width))
        whole = self.sound.waves.amplitude
        return self.lanes.fit(
            whole if len(whole) == 1 else whole[part.start : part.stop]
        )


def _gain_table(coefficients: FloatArray, side: int) -> FloatArray:
    """Return gains, (directions, lanes), for the cells of a cube: see `looked_up`."""
    from rir.harmonics import evaluate_harmonics, harmonic_order
    from rooms.kernels.patterns import cell_directions

    if not side:
        return np.zeros((0, len(coefficients)))
    order = harmonic_order(coefficients.shape[1])
    return evaluate_harmonics(cell_directions(side), order) @ coefficients.T


def _turn(orientation: FloatArray) -> FloatArray:
    """Return the matrix that takes room directions into the device frame."""
    return np.ascontiguousarray(rotate(orientation * [-1, -1, -1, 1], np.eye(3)).T)
