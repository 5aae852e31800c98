"""Scattered sound of a box by transport: the acoustic rendering equation, solved.

Walls scatter by Lambert's law, and between two scatterings sound follows mirrors only.
With the irradiance m of a place on the walls and the exchange J between walls, both by
mirrors only, energy from one place to another is

    16 pi m' G (1 - J)^-1 G m,

G being the root of the scattered share. It is a product of two columns, one a place.

L. Siltanen, T. Lokki, S. Kiminki, L. Savioja, The room acoustic rendering equation,
J. Acoust. Soc. Am. 122, 1624 (2007); H. Kuttruff, Room Acoustics, chapter 4.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from rir.arrays import FloatArray
from rooms.transport.fans import emission_rays, place_rays, volume_rays
from rooms.transport.functions import make_functions
from rooms.transport.single import deposit_hits
from rooms.transport.solving import invert_factor, meet, solve
from rooms.transport.tracing import follow

__all__ = ["BoxTransport", "Detail"]

_DAMPED = 1e-5
"""What transforms let through of energy later than their span."""

_DECAY = 1e-10
"""Share of the energy after which nothing is computed (-100 dB)."""

_COARSEST = 0.004
"""Widest time step [s]: clarity splits sound within a tenth of 50 ms."""

_STEEPEST = 0.25
"""Most that energy decays within a time step, in nepers: errors grow as its cube."""

_STEPS = 512
"""Most time steps; the cost grows with them."""

_ALL = 1 << 30  # no response holds as many reflections, and sums fit 32 bits


@dataclass(frozen=True)
class Detail:
    """How finely sound is followed."""

    degree: float = 2.0
    """Highest degree of the functions on the walls of a cube."""
    stretch: float = 0.6
    """How that grows with the ratio of lengths."""
    wall_rays: int = 16384
    """Rays of each wall."""
    volume_rays: int = 65536
    """Rays of the mean of all places of a cube, and more where sides are longer."""
    place_rays: int = 512
    """Rays of each place."""


class BoxTransport:
    """Exchange of scattered energy between places in one box.

    Parameters
    ----------
    size : ndarray, shape (3,)
        Lengths of the box [m].
    absorption, scattering : ndarray, shape (6, bands)
        Shares of the walls.
    speed : float
        Speed of sound [m/s].
    duration : float
        How long energy is followed [s].
    detail : Detail
        How finely.
    """

    def __init__(
        self,
        size: FloatArray,
        absorption: FloatArray,
        scattering: FloatArray,
        speed: float,
        duration: float,
        detail: Detail,
    ) -> None:
        self.size, self.speed, self.detail = np.asarray(size, float), speed, detail
        both = np.concatenate([absorption, scattering])
        both, self.lane_of = np.unique(both, axis=1, return_inverse=True)
        self.lane_of = self.lane_of.ravel()
        kept, spread = 1.0 - both[:6], both[6:]
        self.mirrored = np.ascontiguousarray(kept * (1.0 - spread))
        self.scattered = np.ascontiguousarray(kept * spread)
        self.gate = np.sqrt(self.scattered)
        self.mirrors = np.any(self.mirrored > 0, axis=1)
        self.lanes = both.shape[1]
        self.step, self.steps = self._choose_steps(both[:6], duration)
        self.functions = make_functions(self.size, detail.degree, detail.stretch)
        damping = -np.log(_DAMPED) / (self.steps * self.step)
        times = self.step * np.arange(self.steps)
        times[-1] = -self.step
        self._window = np.exp(-damping * times)[:, None]
        self._undo = np.exp(damping * self.step * np.arange(self.steps))
        self._factors = self._solve_walls()
        self.known: dict[bytes, Any] = {}
        self._resampling: dict[tuple[float, int], FloatArray] = {}

    def _choose_steps(
        self, absorption: FloatArray, duration: float
    ) -> tuple[float, int]:
        """Return the time step [s] and the number of steps."""
        size, c = self.size, self.speed
        loss = -np.log(np.maximum(1 - absorption, 1e-6))
        # no way loses less than the one along an axis that loses least
        slowest = np.min(c * (loss[0::2] + loss[1::2]) / (2 * size[:, None]))
        across = float(np.linalg.norm(size)) / c
        span = duration
        if slowest > 0:
            span = min(duration, -np.log(_DECAY) / slowest + 2 * across)
        areas = np.repeat(np.prod(size) / size, 2)
        mean = areas @ absorption / areas.sum()
        rates = (
            c * areas.sum() / (4 * np.prod(size)) * -np.log(1 - np.minimum(mean, 0.99))
        )
        step = min(_COARSEST, _STEEPEST / max(float(rates.max()), 1e-9))
        step = max(step, span / _STEPS)
        return step, int(next_fast_len(int(np.ceil(span / step)) + 4, real=True) or 0)

    @property
    def _tables(self) -> tuple[Any, ...]:
        f = self.functions
        return f.degrees, f.starts, f.scale

    @property
    def _per_bin(self) -> float:
        return 1.0 / (self.speed * self.step)

    def _transformed(self, moments: FloatArray) -> Any:
        return rfft(moments * self._window, axis=0)

    def _exchange(self, steps: int) -> Any:
        """Follow sound from wall to wall for so many steps, (freq, lanes, n, n)."""
        f, lanes, n = self.functions, self.lanes, len(self.functions)
        count, rays = self.steps // 2 + 1, self.detail.wall_rays
        exchange = np.zeros((count, lanes, n, n), dtype=np.complex128)
        for wall in range(6):
            if not np.any(self.gate[wall]):
                continue
            low, high = f.starts[wall], f.starts[wall + 1]
            starts, ways, weights = emission_rays(self.size, wall, rays)
            area = np.prod(self.size) / self.size[wall // 2]
            emitted = self._values(wall, starts) * (area * weights[:, None])
            out = np.zeros((steps, high - low, n * lanes))
            follow(
                self.size, (starts, ways), emitted, self.gate[wall],
                (self.mirrored, self.gate), self._tables, self._per_bin, _ALL, out,
            )  # fmt: skip
            # the last step is the one before zero
            out = np.insert(out, [steps - 1] * (self.steps - steps), 0.0, axis=0)
            sent = self._transformed(out.reshape(self.steps, -1))
            sent = sent.reshape(count, high - low, n, lanes)
            exchange[:, :, low:high] = np.moveaxis(sent, 3, 1)
        return exchange

    def _solve_walls(self) -> tuple[FloatArray, FloatArray]:
        """Invert the factors of 1 - J."""
        n = len(self.functions)
        systems = -self._symmetric(self._exchange(self.steps))
        systems[:, :, np.arange(n), np.arange(n)] += 1.0
        systems = systems.reshape(-1, n, n)
        real, imaginary = systems.real.copy(), systems.imag.copy()
        invert_factor(real, imaginary)
        return real, imaginary

    @property
    def mean_free_path(self) -> float:
        """Four times the volume over the surface [m]."""
        return float(2.0 / np.sum(1.0 / self.size))

    @cached_property
    def _close_steps(self) -> int:
        """Steps that hold exchange within a mean free path."""
        wanted = np.ceil(self.mean_free_path * self._per_bin + 2.5)
        return min(self.steps, max(int(wanted), 4))

    @property
    def close_length(self) -> float:
        """Longest way of `close_exchange` [m]."""
        return (self._close_steps - 2.5) / self._per_bin

    @cached_property
    def close_exchange(self) -> Any:
        """Exchange between walls by short ways, (freq * lanes, n, n)."""
        n, exchange = len(self.functions), self._exchange(self._close_steps)
        even = 0.5 * (exchange + np.swapaxes(exchange, 2, 3))
        return even.reshape(-1, n, n).astype(np.complex64)

    def _symmetric(self, exchange: Any) -> Any:
        """Return the symmetric part, with the sums over all that a function sends.

        Every ray hands on what it carries, so these sums neither make nor lose energy;
        half of an exchange that was followed the other way does not know that.
        """
        f, n = self.functions, len(self.functions)
        even = np.zeros((self.lanes, n))
        roots = np.sqrt(np.repeat(np.prod(self.size) / self.size, 2))
        even[:, f.starts[:6]] = (roots[:, None] * self.gate).T
        square = np.maximum((even**2).sum(axis=1), 1e-300)[:, None, None]
        sent, met = exchange @ even[:, :, None], even[:, None] @ exchange
        left = 0.5 * (sent - np.swapaxes(met, 2, 3)) @ even[:, None] / square
        other = np.swapaxes(exchange, 2, 3)
        return 0.5 * (exchange + other) + left + np.swapaxes(left, 2, 3)

    def _values(self, wall: int, points: FloatArray) -> FloatArray:
        """Return the functions of a wall at points on it, shape (points, functions)."""
        from numpy.polynomial.legendre import legvander

        f = self.functions
        some = slice(f.starts[wall], f.starts[wall + 1])
        one, other = (wall // 2 + 1) % 3, (wall // 2 + 2) % 3
        x, y = (2 * points[:, k] / self.size[k] - 1 for k in (one, other))
        degrees = f.degrees[some]
        highest = int(degrees.max())
        values = legvander(x, highest)[:, degrees[:, 0]]
        values = values * legvander(y, highest)[:, degrees[:, 1]]
        return np.ascontiguousarray(values * f.scale[some])

    def _moments(self, rays: Any, weights: FloatArray) -> Any:
        """Return what rays leave on the walls, (freq * lanes, 2, functions)."""
        n, lanes = len(self.functions), self.lanes
        out = np.zeros((self.steps, 1, n * lanes))
        follow(
            self.size, rays, weights[:, None], np.ones(lanes),
            (self.mirrored, self.gate), self._tables, self._per_bin, _ALL, out,
        )  # fmt: skip
        return self._laned(out)

    def _laned(self, out: FloatArray) -> Any:
        n, lanes = len(self.functions), self.lanes
        sent = self._transformed(out.reshape(self.steps, -1)).reshape(-1, n, lanes)
        laned = np.empty((len(sent), lanes, 2, n))
        laned[:, :, 0] = np.swapaxes(sent.real, 1, 2)
        laned[:, :, 1] = np.swapaxes(sent.imag, 1, 2)
        return laned.reshape(-1, 2, n)

    def columns(self, moments: FloatArray) -> FloatArray:
        """Return moments of places solved for all that follows, in the same shape."""
        answers = np.zeros_like(moments)
        solve(*self._factors, moments, answers)
        return answers

    def meet(self, *products: tuple[FloatArray, FloatArray, float]) -> Any:
        """Return a sum of products of columns with factors, (freq, lanes)."""
        out = np.zeros((len(products[0][0]), 2))
        for one, other, factor in products:
            meet(one, other, factor, out)
        return (out[:, 0] + 1j * out[:, 1]).reshape(-1, self.lanes)

    @cached_property
    def _volume_rays(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        longest = self.size.max() / np.cbrt(np.prod(self.size))
        return volume_rays(self.size, int(self.detail.volume_rays * longest))

    @cached_property
    def _mean_moments(self) -> Any:
        """What a place leaves on the walls, on average over all places."""
        starts, ways, weights = self._volume_rays
        return self._moments((starts, ways), weights)

    @cached_property
    def place_rays(self) -> tuple[FloatArray, FloatArray]:
        """Directions (rays, 3) and weights (rays,) of the rays of each place."""
        return place_rays(self.size, self.detail.place_rays)

    @cached_property
    def _missed(self) -> Any:
        """What the few rays of a place miss of ways that last, on average."""
        starts, _, _ = self._volume_rays
        ways, weights = self.place_rays
        turns = max(len(starts) // len(ways), 1)
        starts = starts[: turns * len(ways)]
        rays = starts, np.tile(ways, (turns, 1))
        return self._mean_moments - self._moments(rays, np.tile(weights / turns, turns))

    def mean_energy(self) -> FloatArray:
        """Return energy per second, mean over all pairs, at `times`: (steps, bands)."""
        column = self.columns(self._mean_moments[None])[0]
        energy = self._energy(self.meet((column, column, 1.0)))
        return np.asarray(energy[:, self.lane_of], dtype=float)

    @property
    def times(self) -> FloatArray:
        """Times of `mean_energy` [s]."""
        return np.arange(self.steps, dtype=float) * self.step

    def _energy(self, spectra: Any) -> FloatArray:
        """Return energies per second from spectra, shape (steps, lanes)."""
        series: Any = irfft(spectra, self.steps, axis=0)
        energy: Any = series * (16 * np.pi / self.step * self._undo[:, None])
        return np.asarray(energy, dtype=float)

    def place_moments(self, positions: FloatArray) -> FloatArray:
        """Return what places leave on the walls, as `columns` takes it."""
        ways, weights = self.place_rays
        each = [
            self._moments((np.tile(position, (len(ways), 1)), ways), weights)
            for position in positions
        ]
        return np.stack(each) + self._missed

    def moments_of(self, hits: Any, factors: FloatArray) -> Any:
        """Return what single hits leave on the walls, (freq, lanes, functions)."""
        out = np.zeros((self.steps, len(self.functions) * self.lanes))
        deposit_hits(self.size, hits, factors, self._tables, self._per_bin, out)
        return self._laned(out)

    def resampled(
        self, spectra: Any, step: float, steps: int, first: float
    ) -> FloatArray:
        """Return energies per second in other steps of time, (steps, lanes).

        Nothing arrives before `first` [s]; what the resolution puts there, or makes
        negative, is taken from what follows.
        """
        key = step, steps
        if key not in self._resampling:
            self._resampling = {key: self._resample(step, steps)}
        out = self._resampling[key] @ np.concatenate([spectra.real, spectra.imag])
        arrived = np.cumsum(out, axis=0)
        arrived[: int(np.ceil(first / step))] = 0.0
        arrived = np.maximum(np.maximum.accumulate(arrived, axis=0), 0.0)
        return np.diff(arrived, axis=0, prepend=0.0)

    def _resample(self, step: float, steps: int) -> FloatArray:
        """Return the matrix from spectra to energies in other steps of time.

        Of shape (steps, 2 freq): real parts, then imaginary ones.
        """
        unit = np.eye(self.steps // 2 + 1)
        energy = self._energy(np.concatenate([unit, 1j * unit], axis=1))
        energy[-3:] = 0.0
        at = (np.arange(steps) + 0.5) * step / self.step
        near = np.floor(at).astype(int)
        f = at - near
        # Keys' cubic: keeps the energy and its moments to the second
        shares = (
            -0.5 * f * (1 - f) ** 2, 1 - 2.5 * f**2 + 1.5 * f**3,
            0.5 * f + 2 * f**2 - 1.5 * f**3, -0.5 * f**2 * (1 - f),
        )  # fmt: skip
        out = np.zeros((steps, energy.shape[1]))
        for k, share in enumerate(shares):
            row = near + k - 1
            inside = (row >= 0) & (row < self.steps)
            some = energy[np.where(inside, row, 0)]
            out += np.where(inside, share, 0.0)[:, None] * some
        return out
