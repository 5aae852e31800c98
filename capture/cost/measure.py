"""Turn each knob of a session into curves of error against seconds."""

import time
from collections.abc import Callable

import numpy as np

from capture.config import SessionConfig
from capture.cost.bench import CostBench, Outcome
from capture.cost.trials import CostTrial, imperfect, trials_of
from rir.cost import CostCurve, measure_costs

__all__ = ["ERROR", "NOISE", "measure_session"]

ERROR, NOISE = "response error", "noise under the impulse"
COMPUTED = "float width"


def measure_session(
    config: SessionConfig,
    *,
    repeats: int = 3,
    clock: Callable[[], float] = time.process_time,
    on_run: Callable[[str], None] | None = None,
) -> dict[str, list[CostCurve]]:
    """Measure what each knob of a session costs and gains. Everything is simulated.

    Parameters
    ----------
    config : SessionConfig
        The session; its first pair is measured, its seed is that of the noise.
    repeats : int
        Runs of each setting, each with its own noise.
    clock : callable
        Processor time [s], for the float width.
    on_run : callable, optional
        Told the setting about to be tried.

    Returns
    -------
    dict
        Knob -> two curves: the response's misalignment inside the band,
        and the inverse of the impulse-to-noise ratio in the worst octave, both as
        ratios of amplitudes. Seconds are those of measuring one direction; for the
        float width, of computing one take.
    """
    real = imperfect(config)
    bench = CostBench(real, clock)
    curves = {}
    for knob, trials in trials_of(real).items():
        computed = knob == COMPUTED
        curves[knob] = measure_costs(
            knob,
            trials,
            bench.run,
            lambda outcome: {ERROR: outcome.error, NOISE: outcome.noise},
            units={ERROR: "ratio", NOISE: "ratio"},
            rng=np.random.default_rng(config.seed),
            repeats=repeats,
            seconds=_computing if computed else _measuring,
            seconds_of="CPU" if computed else "measuring",
            per="take" if computed else "direction",
            mark="SIMULATED",
            name=lambda trial: trial.name,
            on_run=on_run,
        )
    return curves


def _computing(trial: CostTrial, outcome: Outcome) -> float:
    del trial
    return outcome.cpu_s


def _measuring(trial: CostTrial, outcome: Outcome) -> float:
    del outcome
    return trial.seconds
