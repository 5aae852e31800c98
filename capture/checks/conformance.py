"""What every check of a take promises; run it on your own by its name."""

from collections.abc import Iterator

import numpy as np

from capture.checks import CHECKS
from capture.checks.evidence import Evidence
from capture.checks.finding import Finding, TakeLimits
from capture.checks.run import gather_evidence
from capture.signal.excitation import Excitation
from capture.signal.reference import refer
from capture.signal.sweep import synchronized_sweep
from rir.arrays import FloatArray
from rir.conformance import promise

__all__ = ["check_check", "example_takes"]

RATE = 16000
"""Of the example takes, Hz."""
LATENCY = 200
"""Samples from playing to recording in them."""
DIRECT = 160
"""Samples from emission to the first microphone: 3.4 m of air."""


def check_check(name: str) -> None:
    """Check that a check of the table looks at any take, and blames no good one.

    Parameters
    ----------
    name : str
        Name in the table of checks.

    Raises
    ------
    AssertionError
        If a promise is broken; names it.
    """
    check = CHECKS[name]
    for what, take in example_takes():
        response = take.response.copy()
        found = list(check(take))
        where = f"{name}, {what}"
        same = np.array_equal(response, take.response, equal_nan=True)
        promise(same, f"{where}: the response is left as it is")
        for one in found:
            promise(isinstance(one, Finding), f"{where}: a finding is a Finding")
            promise(one.word.isidentifier(), f"{where}: its word is one word")
            promise(one.text, f"{where}: it says in a sentence what was found")
            known = one.channel is None or 0 <= one.channel < len(take.response)
            promise(known, f"{where}: its channel is one of the take's")
        blamed = ", ".join(one.word for one in found if one.hard)
        good = what.startswith("good")
        promise(not (good and blamed), f"{where}: nothing is refused, not {blamed}")


def example_takes() -> Iterator[tuple[str, Evidence]]:
    """Yield takes of two microphones by what they are: good ones, and odd ones."""
    sweep = np.asarray(synchronized_sweep(50, 7600, 1.0, RATE, band=(80, 7000)))
    rng = np.random.default_rng(0)
    cable = np.concatenate((np.zeros(LATENCY), sweep, np.zeros(8000)))
    heard = np.stack([_heard(cable, rng, DIRECT + 40 * k) for k in range(2)])
    deaf, broken = heard.copy(), heard.copy()
    deaf[1] = 0.0
    broken[0, 5000] = np.nan
    takes = {
        "good take": (heard, cable),
        "good take without a loopback": (heard[:, LATENCY:], None),
        "one silent channel": (deaf, cable),
        "one channel with NaN": (broken, cable),
        "a silent loopback": (heard, 0 * cable),
    }
    for what, (take, loopback) in takes.items():
        grid = Excitation(sweep, RATE, take.shape[1], length=3200, pre=160)
        reference = refer(grid, loopback)
        golden = refer(grid, cable) if loopback is cable else None
        yield what, gather_evidence(take, reference, golden, None, TakeLimits())


def _heard(cable: FloatArray, rng: np.random.Generator, delay: int) -> FloatArray:
    """Return what a microphone hears in a dry room, with noise 80 dB below."""
    count = 1600
    decay = 10 ** (-3 * np.arange(count) / count)
    response = np.concatenate((np.zeros(delay), 0.05 * decay * rng.normal(size=count)))
    response[delay] = 1.0
    heard = 0.3 * np.convolve(cable, response)[: len(cable)]
    return heard + 1e-4 * np.std(heard) * rng.normal(size=len(heard))
