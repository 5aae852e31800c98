"""Straight moves with limited speed and acceleration, at rest at both ends."""

import numpy as np


class Glide:
    """Move from one point to another, and say where it is when.

    Parameters
    ----------
    start, end
        Points, shape (n_axes,), mm.
    speed, acceleration
        Along the line, mm/s and mm/s².
    begin
        Time it starts, s.

    Examples
    --------
    >>> glide = Glide(np.zeros(1), np.array([100.0]), 50.0, 100.0, begin=0.0)
    >>> glide.end_time, glide.position(1.25).tolist(), glide.speed_at(1.25)
    (2.5, [50.0], 50.0)
    """

    def __init__(
        self,
        start: np.ndarray,
        end: np.ndarray,
        speed: float,
        acceleration: float,
        begin: float,
    ) -> None:
        self.start, self.end, self.begin = start, end, begin
        self.length = float(np.linalg.norm(end - start))
        self.acceleration = acceleration
        self.speed = min(speed, float(np.sqrt(self.length * acceleration)))
        self.ramp = self.speed / acceleration if self.length else 0.0
        cruise = self.length / self.speed - self.ramp if self.length else 0.0
        self.end_time = begin + 2 * self.ramp + cruise

    def travelled(self, now: float) -> float:
        """Return the way covered at a time, mm."""
        t = min(max(now, self.begin), self.end_time) - self.begin
        left = self.end_time - self.begin - t
        if t <= self.ramp:
            return 0.5 * self.acceleration * t * t
        if left <= self.ramp:
            return self.length - 0.5 * self.acceleration * left * left
        return self.speed * (t - 0.5 * self.ramp)

    def at(self, way: float) -> np.ndarray:
        """Return the point after some way along the line."""
        if self.length == 0.0 or way >= self.length:
            return self.end.copy()
        return self.start + (self.end - self.start) * (way / self.length)

    def position(self, now: float) -> np.ndarray:
        """Return the point at a time."""
        return self.at(self.travelled(now))

    def speed_at(self, now: float) -> float:
        """Return the speed at a time, mm/s."""
        if not self.begin < now < self.end_time:
            return 0.0
        edge = min(now - self.begin, self.end_time - now)
        return min(self.speed, self.acceleration * edge)

    def braked(self, now: float) -> "Glide":
        """Return the move that slows down to rest from a time on."""
        speed = self.speed_at(now)
        here = self.travelled(now)
        stop = min(self.length, here + speed**2 / (2 * self.acceleration))
        return Brake(self, here, stop, speed, now)


class Brake(Glide):
    """Slow down to rest along an interrupted move."""

    def __init__(
        self, glide: Glide, here: float, stop: float, speed: float, begin: float
    ) -> None:
        super().__init__(glide.at(here), glide.at(stop), 1.0, 1.0, begin)
        self.acceleration = glide.acceleration
        self.speed = speed
        self.end_time = begin + speed / glide.acceleration

    def travelled(self, now: float) -> float:
        """Return the way covered at a time, mm."""
        t = min(max(now, self.begin), self.end_time) - self.begin
        way = self.speed * t - 0.5 * self.acceleration * t * t
        return self.length if now >= self.end_time else min(way, self.length)

    def speed_at(self, now: float) -> float:
        """Return the speed at a time, mm/s."""
        if not self.begin <= now < self.end_time:
            return 0.0
        return self.speed - self.acceleration * (now - self.begin)
