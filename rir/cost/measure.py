"""Turn any knob into error-against-seconds points."""

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rir.cost.curve import CostCurve
from rir.cost.front import knee_of, mark_front
from rir.cost.point import CostPoint, median_interval

__all__ = ["measure_cost", "measure_costs"]

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
    rng: np.random.Generator,
    **options: Any,
) -> CostCurve:
    """Run every setting several times and say which one to take.

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
    rng : numpy.random.Generator
        Handed to `run`; the same draws for every setting of one repeat.
    **options
        Those of `measure_costs`.

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
    (curve,) = measure_costs(
        knob,
        settings,
        run,
        lambda result: {quantity: error(result)},
        units={quantity: unit},
        rng=rng,
        **options,
    )
    return curve


def measure_costs(
    knob: str,
    settings: Sequence[Setting],
    run: Callable[[Setting, np.random.Generator], Result],
    errors: Callable[[Result], Mapping[str, float]],
    *,
    units: Mapping[str, str],
    rng: np.random.Generator,
    repeats: int = 5,
    seconds: Callable[[Setting, Result], float] | None = None,
    seconds_of: str | None = None,
    count: int = 1,
    per: str = "",
    mark: str = "",
    name: Callable[[Setting], str] = str,
    warm: Callable[[Setting], object] | None = None,
    clock: Callable[[], float] = time.process_time,
    on_run: Callable[[str], None] | None = None,
) -> list[CostCurve]:
    """Run every setting several times; one curve for each quantity that can be wrong.

    Repeats go round all settings in turn, so that a machine that slows down
    half-way does not favour the settings run first.

    Parameters
    ----------
    knob, settings, run
        As in `measure_cost`.
    errors : callable
        ``errors(result)`` answers quantity -> error; one left out counts as NaN.
    units : mapping
        Quantity -> unit of its error, in the order of the curves.
    rng : numpy.random.Generator
        Handed to `run`; the same draws for every setting of one repeat.
    repeats : int
        Runs of each setting.
    seconds : callable, optional
        ``seconds(setting, result)``: what a person waits, where that is not the
        computing, for instance the length of a sweep [s].
    seconds_of : str, optional
        What they are seconds of; ``"CPU"``, or ``"measuring"`` if `seconds` is given.
    count, per : int, str
        How many things one run makes, and what one of them is called: the seconds
        told are those for one.
    mark : str
        ``"SIMULATED"`` or ``"MEASURED"``.
    name : callable
        Writes a setting for people.
    warm : callable, optional
        ``warm(setting)``, called before each run and not timed: fills caches.
    clock : callable
        Processor time [s].
    on_run : callable, optional
        Told the name of each setting before it is run.

    Returns
    -------
    list of CostCurve
        In the order of `units`.
    """
    spent = np.full((len(settings), repeats), np.nan)
    wrong = {quantity: np.full_like(spent, np.nan) for quantity in units}
    for repeat, seed in enumerate(rng.integers(0, 2**63, repeats)):
        for k, setting in enumerate(settings):
            if on_run:
                on_run(name(setting))
            if warm:
                warm(setting)
            begin = clock()
            result = run(setting, np.random.default_rng(seed))
            spent[k, repeat] = clock() - begin
            if seconds is not None:
                spent[k, repeat] = seconds(setting, result)
            for quantity, error in errors(result).items():
                wrong[quantity][k, repeat] = error
    names = [name(setting) for setting in settings]
    kind = seconds_of or ("CPU" if seconds is None else "measuring")
    curves = []
    for quantity, unit in units.items():
        points = _points(names, spent / count, wrong[quantity])
        knee = knee_of(points)
        curves.append(CostCurve(knob, quantity, unit, kind, points, knee, per, mark))
    return curves


def _points(
    names: Sequence[str], spent: NDArray[np.float64], wrong: NDArray[np.float64]
) -> tuple[CostPoint, ...]:
    repeats = spent.shape[1]
    return mark_front(
        [
            CostPoint(name, *median_interval(s), *median_interval(e), repeats)
            for name, s, e in zip(names, spent, wrong, strict=True)
        ]
    )
