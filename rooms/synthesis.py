"""Turn gathered sound into samples."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rir import GainPattern, Pose
from rooms.bands import join_bands
from rooms.sound import Arrivals, Lattice, Sound, Waves

__all__ = ["render"]

FloatArray = NDArray[np.float64]
_FULL = 8
"""Lanes of a banded grid; see `rooms.kernels.deposit.LANES`."""


def render(sound: Sound, threads: int = 1) -> FloatArray:
    """Return the responses at all listeners, shape (listeners, n_samples).

    The compiled loops release the interpreter lock, so threads share the work.
    """
    count = len(sound.listeners)
    out = np.empty((count, sound.budget.n_samples))

    def work(part: range) -> None:
        renderer = _Renderer(sound)
        for index in part:
            out[index] = renderer.listener(index)

    parts = [range(first, count, threads) for first in range(threads)]
    if threads == 1:
        work(parts[0])
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, parts))
    return out


def _is_flat(sound: Sound) -> bool:
    """Tell whether one band says all: no band differs from any other."""
    if sound.air_loss is not None or sound.waves is not None:
        return False
    for pattern in sound.patterns or ():
        if len(pattern.bands) > 1:
            return False
    if sound.lattice is not None and np.any(np.ptp(sound.lattice.reflection, axis=1)):
        return False
    paths = (path for paths in sound.arrivals for path in paths)
    return not any(np.any(np.ptp(path.gain, axis=1)) for path in paths)


def _lanes(values: FloatArray, lanes: int) -> FloatArray:
    """Fit the band axis (last) to a number of lanes: one, or padded with zeros."""
    if lanes == 1:
        return np.ascontiguousarray(values[..., :1])
    padding = [(0, 0)] * (values.ndim - 1) + [(0, lanes - values.shape[-1])]
    return np.ascontiguousarray(np.pad(values, padding))


@dataclass(frozen=True, eq=False)
class _Axis:
    """Images along one axis: gains and reflection counts, whatever the listener."""

    index: NDArray[np.int64]
    gain: FloatArray
    order: NDArray[np.int64]
    length: float

    def offsets(self, emitter: float, listener: float) -> FloatArray:
        """Signed distances from the listener to the images [m].

        Written so that exchanging the ends changes signs only: reciprocity then
        holds to the last bit of each term.
        """
        even = self.index * self.length + (emitter - listener)
        odd = (self.index + 1) * self.length - (emitter + listener)
        return np.where(self.index % 2 == 0, even, odd)


def _axis(lattice: Lattice, axis: int, reach: float, lanes: int) -> _Axis:
    length = float(lattice.size[axis])
    count = min(int(reach / length) + 2, lattice.max_order)
    index = np.arange(-count, count + 1)
    # Image i > 0 met the far wall first: the far wall ceil(i/2) times.
    more, fewer = (np.abs(index) + 1) // 2, np.abs(index) // 2
    near = np.where(index > 0, fewer, more)[:, None]
    far = np.where(index > 0, more, fewer)[:, None]
    walls = lattice.reflection[2 * axis : 2 * axis + 2]
    gain = walls[0] ** near * walls[1] ** far
    return _Axis(index, _lanes(gain, lanes), np.abs(index), length)


class _Renderer:
    """Renders one listener after another into buffers that are used again."""

    def __init__(self, sound: Sound) -> None:
        budget = sound.budget
        self.sound = sound
        self.lanes = 1 if _is_flat(sound) else _FULL
        self.scale = budget.sample_rate / sound.scene.speed_of_sound
        self.grid = np.zeros((budget.n_samples + 1, 8, self.lanes))
        self.axes: list[_Axis] = []
        self.rows = 0
        if sound.lattice is not None:
            limit = sound.lattice.until * budget.sample_rate
            far = sound.lattice.farthest * self.scale
            self.rows = min(int(np.ceil(min(limit, far))) + 1, len(self.grid))
            reach = self.rows / self.scale
            self.axes = [
                _axis(sound.lattice, axis, reach, self.lanes) for axis in range(3)
            ]
        self.ends = self._ends()
        self.decay = self._decay()

    def _ends(self) -> tuple[FloatArray, FloatArray] | None:
        if self.sound.patterns is None:
            return None
        emitting, listening = (
            _lanes(
                pattern.at_bands(self.sound.scene.bands).coefficients.T, self.lanes
            ).T
            for pattern in self.sound.patterns
        )
        return np.ascontiguousarray(emitting), np.ascontiguousarray(listening)

    def _decay(self) -> FloatArray:
        if self.sound.air_loss is None:
            return np.ones((len(self.grid), self.lanes))
        way = np.arange(len(self.grid)) / self.scale
        return np.exp(-_lanes(self.sound.air_loss, self.lanes) / 2 * way[:, None])

    def listener(self, index: int) -> FloatArray:
        from rooms.kernels import pulses

        used = self._rows_used(index)
        self.grid[:used] = 0.0
        listener = self.sound.listeners[index]
        if self.sound.lattice is not None:
            self._deposit_lattice(listener)
        for arrivals in self.sound.arrivals[index]:
            self._deposit_arrivals(arrivals, listener)
        if self.sound.waves is not None:
            self._deposit_waves(self.sound.waves, listener)
        bank, lead = pulses.pulse_bank(), pulses.HALF_TAPS - 1
        shaped = np.zeros((used + bank.shape[1]) * self.lanes)
        pulses.shape_pulses(self.grid[:used], self.decay, bank, shaped)
        n = self.sound.budget.n_samples
        return self._join(shaped.reshape(-1, self.lanes)[lead : lead + n])

    def _join(self, signals: FloatArray) -> FloatArray:
        """Return the samples of interleaved bands, shape (rows, lanes)."""
        samples = np.zeros(self.sound.budget.n_samples)
        joined = signals[:, 0]
        if self.lanes > 1:
            bands = self.sound.scene.bands
            banded = np.ascontiguousarray(signals.T[: len(bands)])
            joined = join_bands(banded, bands, self.sound.budget.sample_rate)
        samples[: len(joined)] = joined
        return samples

    def _rows_used(self, index: int) -> int:
        """Return how many rows of the grid this listener can fill."""
        if self.sound.waves is not None:
            return len(self.grid)
        rate = self.sound.budget.sample_rate
        paths = [p.delay.max(initial=0.0) for p in self.sound.arrivals[index]]
        last = int(max(paths, default=0.0) * rate) + 1
        return min(max(last, self.rows), len(self.grid))

    def _deposit_lattice(self, listener: Pose) -> None:
        from rooms.kernels import deposit

        lattice, ends = self.sound.lattice, (self.sound.emitter, listener)
        if lattice is None or self.rows < 2:
            return
        grid = self.grid[: self.rows]
        images: list[Any] = [
            axis.offsets(*(float(pose.position[k]) for pose in ends))
            for k, axis in enumerate(self.axes)
        ]
        images += [axis.gain[:, 0] if self._flat else axis.gain for axis in self.axes]
        images += [axis.order for axis in self.axes]
        images += [lattice.max_order, self.scale]
        if self.ends is not None:
            turned = zip(ends, self.ends, strict=True)
            images += [(_turn(pose), rows) for pose, rows in turned]
        images.append(grid[:, :, 0] if self._flat else grid)
        if self.ends is not None:
            deposit.deposit_lattice_patterns(*images)
        elif self._flat:
            deposit.deposit_lattice_flat(*images)
        else:
            deposit.deposit_lattice_bands(*images)

    @property
    def _flat(self) -> bool:
        return self.lanes == 1 and self.ends is None

    def _deposit_arrivals(self, arrivals: Arrivals, listener: Pose) -> None:
        gain = arrivals.gain
        if self.sound.patterns is not None:
            gain = gain * self._weight(listener, arrivals.departure, arrivals.arrival)
        self._deposit(arrivals.delay, gain)

    def _deposit(self, delay: FloatArray, gain: FloatArray) -> None:
        from rooms.kernels import deposit

        rate = self.sound.budget.sample_rate
        deposit.deposit_paths(delay * rate, _lanes(gain, self.lanes), self.grid)

    def _weight(
        self, listener: Pose, departure: FloatArray, arrival: FloatArray
    ) -> FloatArray:
        emitting, listening = self.sound.patterns or (GainPattern.omni(),) * 2
        bands = self.sound.scene.bands
        leave = emitting.at_bands(bands).gain(self.sound.emitter.to_local(departure))
        reach = listening.at_bands(bands).gain(listener.to_local(arrival))
        return leave * reach

    def _deposit_waves(self, waves: Waves, listener: Pose) -> None:
        c = self.sound.scene.speed_of_sound
        emitter_at = (self.sound.emitter.position - waves.center) / c
        listener_at = (listener.position - waves.center) / c
        first = self.sound.emitter.distance(listener) / c
        for leave, reach in ((waves.one, waves.other), (waves.other, waves.one)):
            delay = waves.time - (leave @ emitter_at + reach @ listener_at)
            step = np.clip(
                (delay / waves.step).astype(int), 0, len(waves.amplitude) - 1
            )
            gain = waves.amplitude[step] * waves.sign[:, None]
            gain[delay < first] = 0.0
            if self.sound.patterns is not None:
                gain *= self._weight(listener, leave, reach)
            self._deposit(delay, gain)


def _turn(pose: Pose) -> FloatArray:
    """Return the matrix that takes room directions into the device frame."""
    return np.ascontiguousarray(pose.to_local(np.eye(3)).T)
