"""Judge pairs as soon as both directions are there, and the closure at the end."""

from collections import OrderedDict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.deconvolution.takes import FEWEST_TO_JUDGE
from capture.plan import Measure
from capture.session.folder import SessionFolder
from capture.session.journal import Event
from capture.session.outliers import find_outlier
from capture.session.pairing import OneWay, bands, judge_pair, noise_share
from capture.session.state import SessionState
from capture.session.take_judge import TakeJudge

__all__ = ["PairJudge"]

REMEMBERED = 8  # both directions with retakes; older ones are read from disk


class PairJudge:
    """Compare directions of a session with each other.

    Parameters
    ----------
    folder : SessionFolder
        Where raw files lie that are no longer in memory.
    take_judge : TakeJudge
        Turns raw files into responses.
    """

    def __init__(self, folder: SessionFolder, take_judge: TakeJudge) -> None:
        self.folder = folder
        self.take_judge = take_judge
        self._known: OrderedDict[str, OneWay] = OrderedDict()

    def remember(
        self,
        take: str,
        samples: NDArray[np.float64],
        response: NDArray[np.float64],
        started: Event,
    ) -> None:
        """Keep what one good take says of its direction (first microphone)."""
        config = self.take_judge.config
        looped = config.channels.loopback is not None
        first = response[0, self.take_judge.pre :]
        share = noise_share(
            samples[0, : self.take_judge.n_noise],
            samples[-1] if looped else np.asarray(self.take_judge.sweep),
            first,
            config.sample_rate,
            bands(config.sample_rate, *config.sweep.band_hz),
        )
        temperature = started["air"]["temperature_c"]
        self._known[take] = OneWay(
            first, np.nan if temperature is None else temperature, share
        )
        while len(self._known) > REMEMBERED:
            self._known.popitem(last=False)

    def judge(self, state: SessionState, first: str, second: str) -> Event | None:
        """Compare the last good takes of two measures.

        Parameters
        ----------
        state : SessionState
            What has been recorded.
        first, second : str
            Keys of the measures.

        Returns
        -------
        dict or None
            The figures; None as long as one of the two is missing.
        """
        takes = [state.accepted(key) for key in (first, second)]
        if not all(takes):
            return None
        names = [good[-1].name for good in takes]
        one, other = (self.one_way(state, name) for name in names)
        config = self.take_judge.config
        figures: dict[str, Any] = judge_pair(
            one,
            other,
            config.sample_rate,
            band_hz=config.sweep.band_hz,
            position_sigma_m=config.position_sigma_m,
        )
        return {"takes": names, **figures}

    def outlier(self, state: SessionState, key: str) -> tuple[str, str] | None:
        """Return the take of a measure that is unlike the others, and why."""
        names = [take.name for take in state.accepted(key)]
        if len(names) < FEWEST_TO_JUDGE:
            return None
        takes = [self.one_way(state, name).response for name in names]
        found = find_outlier(np.stack(takes))
        return None if found is None else (names[found[0]], found[1])

    def one_way(self, state: SessionState, take: str) -> OneWay:
        """Return what a good take says, from memory or from its raw file."""
        if take not in self._known:
            samples = self.folder.read_raw(state.takes[take].event["file"])
            started = state.started[take]
            response = self.take_judge.deconvolve(samples)
            self.remember(take, samples, response, started)
        return self._known[take]


def reverse_key(step: Measure) -> str:
    """Return the key of the same measure the other way."""
    there, back = step.direction
    return step.key.replace(f"_{there}{back}", f"_{back}{there}", 1)
