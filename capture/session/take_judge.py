"""Turn a take into responses and a verdict, the same way live and at a rebuild."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capture.checks.finding import TakeLimits
from capture.checks.run import CheckedTake, check_take, divide_only
from capture.checks.silent_channels import silent_channels
from capture.config import NYQUIST_SHARE, SessionConfig
from capture.devices.mounting import mounted
from capture.interfaces.protocol import Recording
from capture.session.journal import Event
from capture.signal.excitation import Excitation
from capture.signal.reference import SweepReference, refer
from capture.signal.sweep import Sweep, synchronized_sweep
from rir import Environment, Pose, SignalError

__all__ = ["TakeJudge", "TakeVerdict", "session_sweep", "take_poses"]

FloatArray = NDArray[np.float64]
LOWEST_HZ = 5.0  # an octave below the band is swept; below this, only time passes
RETAKE_MARKS = ("clock_drift",)
"""Soft marks that mean a wrong set-up when everything is on one interface."""


@dataclass(frozen=True, eq=False)
class TakeVerdict:
    """What the checks say of a take."""

    accepted: bool
    """Whether the take may be used."""
    reasons: list[str]
    """Why not, with the figure; empty when accepted."""
    marks: list[str]
    """What was noticed but does no harm."""
    figures: dict[str, Any]
    """Every number the checks found."""
    response: FloatArray = field(repr=False)
    """The responses. Shape (microphones, pre + n)."""


def session_sweep(config: SessionConfig) -> Sweep:
    """Return the sweep of a session: it runs an octave beyond the band if it can."""
    low, high = config.sweep.band_hz
    top = NYQUIST_SHARE * config.sample_rate
    return synchronized_sweep(
        max(low / 2, LOWEST_HZ),
        max(top, high),
        config.sweep.seconds,
        config.sample_rate,
        band=(low, high),
        amplitude=10 ** (config.sweep.amplitude_dbfs / 20),
    )


def take_poses(config: SessionConfig, event: Event) -> tuple[list[Pose], list[Pose]]:
    """Return the poses of the loudspeakers and the microphones of a take."""
    first = event.get("loudspeaker", 0)
    offsets = config.channels.loudspeaker_offsets_m[first : first + config.overlapping]
    emitters = mounted(_pose(event["emitter"]), offsets)
    listeners = mounted(_pose(event["listener"]), config.channels.microphone_offsets_m)
    return emitters, listeners


def _pose(fields: dict[str, Any]) -> Pose:
    return Pose(fields["position_m"], fields["orientation"])


class TakeJudge:
    """Judge the takes of one session.

    Parameters
    ----------
    config : SessionConfig
        What the session is.
    """

    def __init__(self, config: SessionConfig) -> None:
        self.config = config
        self._golden: SweepReference | None = None
        self._grids: dict[int, Excitation] = {}
        rate = config.sample_rate
        self.n_noise = round(config.sweep.noise_s * rate)
        self.n_tail = round(config.sweep.tail_s * rate)
        self.interleaving = config.interleaving
        self.length, self.pre = self.interleaving.length, self.interleaving.pre

    @cached_property
    def sweep(self) -> Sweep:
        """The excitation."""
        return session_sweep(self.config)

    @cached_property
    def signal(self) -> FloatArray:
        """What is played: silence, sweep, silence; (n,), or (loudspeakers, n)."""
        sweep = np.asarray(self.sweep)
        signals = self.interleaving.signals(sweep, self.n_noise, self.n_tail)
        return signals if len(signals) > 1 else signals[0]

    def judge(self, recording: Recording, event: Event) -> TakeVerdict:
        """Judge a take; the first good one becomes the golden loopback.

        Parameters
        ----------
        recording : Recording
            What the inputs heard.
        event : dict
            The take's ``take_started`` event: poses and air.
        """
        try:
            result = self.check(recording.samples, event)
        except SignalError as error:
            reasons = [*self._silences(recording), str(error)]
            nothing = np.zeros((len(recording.samples), self.pre + self.length))
            return TakeVerdict(False, reasons, [], {}, nothing)
        spoiling = [v for v in result.findings if v.hard or v.word in RETAKE_MARKS]
        reasons = [finding.text for finding in spoiling]
        reasons += self._silences(recording)
        reasons += [f"the driver reported {flag}" for flag in recording.flags]
        marks = [v.text for v in result.findings if v not in spoiling]
        responses = self.interleaving.separate(result.response)
        verdict = TakeVerdict(not reasons, reasons, marks, result.figures, responses)
        if verdict.accepted and self._golden is None:
            self.set_golden(recording.samples)
        return verdict

    def _silences(self, recording: Recording) -> list[str]:
        stop = self.n_noise + len(self.sweep)
        rate = recording.sample_rate
        return silent_channels(recording.samples, rate, self.n_noise, stop)

    def set_golden(self, samples: FloatArray) -> None:
        """Keep the loopback of a take as the one to compare with."""
        if self.config.channels.loopback is not None:
            grid = self.grid(samples.shape[-1])
            self._golden = refer(grid, samples[-1].copy())

    def check(self, samples: FloatArray, event: Event) -> CheckedTake:
        """Deconvolve a take.

        Parameters
        ----------
        samples : ndarray, shape (channels, n)
            Microphones, then the loopback.
        event : dict
            The take's ``take_started`` event.
        """
        microphones, reference = self._referred(samples)
        looped = reference.loopback is not None
        delays = self._direct_delays(event) if looped else None
        return check_take(microphones, reference, self._golden, delays, TakeLimits())

    def _referred(self, samples: FloatArray) -> tuple[FloatArray, SweepReference]:
        """Return the microphones of a take and what to divide them by."""
        looped = self.config.channels.loopback is not None
        microphones = samples[:-1] if looped else samples[:, self.n_noise :]
        grid = self.grid(microphones.shape[-1])
        return microphones, refer(grid, samples[-1] if looped else None)

    def grid(self, n: int) -> Excitation:
        """Return the transformed sweep for takes of n samples; all takes share it."""
        if n not in self._grids:
            self._grids[n] = Excitation(
                np.asarray(self.sweep),
                self.config.sample_rate,
                n,
                length=self.interleaving.extra + self.length,
                pre=self.pre,
                band=self.config.sweep.band_hz,
            )
        return self._grids[n]

    def deconvolve(self, samples: FloatArray) -> FloatArray:
        """Return a judged take's responses, each loudspeaker's microphones in turn.

        Shape (loudspeakers · microphones, pre + length).
        """
        return self.interleaving.separate(
            divide_only(*self._referred(samples)).response
        )

    def _direct_delays(self, event: Event) -> FloatArray | None:
        """Return the expected arrival of the direct sound per microphone [s]."""
        air = {key: value for key, value in event["air"].items() if value is not None}
        speed = Environment(**air).speed_of_sound
        if not np.isfinite(speed):
            return None
        [emitter, *_], listeners = take_poses(self.config, event)
        return np.array([emitter.distance(pose) for pose in listeners]) / speed
