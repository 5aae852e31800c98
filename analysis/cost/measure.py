"""Turn any knob into error-against-seconds points."""

import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.cost.curve import CostCurve, CostPoint, knee_of, mark_front

__all__ = ["measure_cost"]

Setting = TypeVar("Setting")
Result = TypeVar("Result")


def measure_cost(
    knob: str,
    settings: Sequence[Setting],
    run: Callable[[Setting, np.random.Generator], Result],
    error: Callable[[Result], float],
    *,
    quantity: str,
    unit: str = "",
    repeats: int = 5,
    rng: np.random.Generator,
    seconds: Callable[[Setting, Result], float] | None = None,
    name: Callable[[Setting], str] = str,
    clock: Callable[[], float] = time.process_time,
    on_point: Callable[[CostPoint], None] | None = None,
) -> CostCurve:
    """Run every setting several times and say which one to take.

    Repeats go round all settings in turn, so that a machine that slows down
    half-way does not favour the settings run first.

    Parameters
    ----------
    knob : str
        Name of what is turned.
    settings : sequence
        Its settings.
    run : callable
        ``run(setting, rng) -> result``: the work to be timed.
    error : callable
        ``error(result) -> float``, against a reference the caller holds; not timed.
    quantity, unit : str
        What the error is an error of, and its unit.
    repeats : int
        Runs of each setting.
    rng : numpy.random.Generator
        Handed to `run`; the same draws for every setting of one repeat.
    seconds : callable, optional
        ``seconds(setting, result)``: what a person waits, where that is not the
        computing, for instance the length of a sweep [s].
    name : callable
        Writes a setting for people.
    clock : callable
        Processor time [s].
    on_point : callable, optional
        Told of each finished point, in the order of the settings.

    Returns
    -------
    CostCurve

    Examples
    --------
    >>> import numpy as np
    >>> curve = measure_cost(
    ...     "terms", [1, 4, 16], lambda n, rng: sum(1 / k**2 for k in range(1, n + 1)),
    ...     lambda s: abs(s - np.pi**2 / 6), quantity="the sum", repeats=2,
    ...     rng=np.random.default_rng(0), seconds=lambda n, _: float(n))
    >>> [round(point.error, 2) for point in curve.points]
    [0.64, 0.22, 0.06]
    """
    spent = np.full((len(settings), repeats), np.nan)
    wrong = np.full((len(settings), repeats), np.nan)
    for repeat, seed in enumerate(rng.integers(0, 2**63, repeats)):
        for k, setting in enumerate(settings):
            begin = clock()
            result: Any = run(setting, np.random.default_rng(seed))
            spent[k, repeat] = clock() - begin
            if seconds is not None:
                spent[k, repeat] = seconds(setting, result)
            wrong[k, repeat] = error(result)
    points = mark_front(
        [
            CostPoint(name(s), *_median(spent[k]), *_median(wrong[k]), repeats)
            for k, s in enumerate(settings)
        ]
    )
    for point in points:
        if on_point:
            on_point(point)
    kind = "CPU" if seconds is None else "measuring"
    return CostCurve(knob, quantity, unit, kind, points, knee_of(points))


def _median(values: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the median and a 95 % interval of it.

    References
    ----------
    Conover, Practical Nonparametric Statistics (1999), section 3.2: order
    statistics bound a quantile whatever the distribution. With fewer than six
    values they reach 95 % only as the whole range, which is what is given then.
    """
    kept = np.sort(values[np.isfinite(values)])
    count = len(kept)
    if not count:
        return float("nan"), float("nan"), float("nan")
    low = max(0, int(np.floor((count - 1.96 * np.sqrt(count)) / 2)))
    return float(np.median(kept)), float(kept[low]), float(kept[count - 1 - low])
