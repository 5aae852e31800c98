"""Carry out a plan: the only place that moves rigs and plays sound."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from capture.config import SessionConfig
from capture.devices.movers import Mover, Redo, RedoNow, Skip
from capture.devices.opening import HeldInterface
from capture.devices.sensors import AirSensor, NoSensor
from capture.interfaces import AudioInterface, Recording
from capture.plan import Measure, Move, SessionPlan, Step, take_name
from capture.session.folder import SessionFolder, file_sha256
from capture.session.pair_judge import PairJudge, reverse_key
from capture.session.record import SessionRecord
from capture.session.state import SessionState
from capture.session.take_judge import TakeJudge, TakeVerdict
from rigs.clock import Clock, SystemClock
from rir import Environment, InterfaceError, Pose, RigError, SessionError

__all__ = ["Session"]

log = logging.getLogger(__name__)


@dataclass
class Session:
    """A session at work: devices, folder and what has been done so far.

    Parameters
    ----------
    folder : SessionFolder
        Where everything is written.
    config : SessionConfig
        What the session is.
    plan : SessionPlan
        What it does.
    record : SessionRecord
        What has been done so far; takes every event.
    mover : Mover
        Brings the devices to their places.
    open_interface : callable
        Opens the audio interface; called again after a device failure.
    sensor : AirSensor
        Reads temperature and humidity.
    clock : Clock
        Passes the waiting time.
    """

    folder: SessionFolder
    config: SessionConfig
    plan: SessionPlan
    record: SessionRecord
    mover: Mover
    open_interface: Callable[[], AudioInterface]
    sensor: AirSensor = field(default_factory=NoSensor)
    clock: Clock = field(default_factory=SystemClock)

    def __post_init__(self) -> None:
        self.take_judge = TakeJudge(self.config)
        self.pair_judge = PairJudge(self.folder, self.take_judge)
        self._held = HeldInterface(
            lambda: self.open_interface(),
            self.clock,
            record=self.record.add,
            show=self.record.show,
        )
        self._gave_up = 0
        self.last_reason = ""
        self._poses: tuple[Pose, Pose] | None = None
        self._at: Move | None = None

    @property
    def state(self) -> SessionState:
        """What the session's events add up to."""
        return self.record.state

    def run(self) -> list[str]:
        """Do what is left of the plan.

        Returns
        -------
        list of str
            Keys of the measures that got too few good takes; empty when complete.

        Raises
        ------
        SessionError, RigError, InterfaceError
            If the session cannot go on; it can be resumed.
        """
        remaining = self.plan.without(self.state.done(self.plan))
        self.record.show(
            {"event": "planned", "plan": self.plan, "remaining": remaining}
        )
        try:
            if remaining.steps:
                self.mover.prepare()
            self._follow(list(remaining))
        except BaseException as error:
            self._stop(error)
            raise
        finally:
            self._close()
        missing = [step.key for step in self.plan.measures if self.state.missing(step)]
        self.record.add({"event": "session_finished", "missing": missing})
        return missing

    def reject(self, take: str, reason: str) -> None:
        """Turn a good take into a bad one."""
        self.record.add({"event": "take_rejected", "take": take, "reason": reason})

    def _follow(self, steps: list[Step]) -> None:
        """Do steps one after the other, as the operator steers them."""
        last: list[Step] = []
        block: list[Step] = []
        while steps:
            step = steps.pop(0)
            if isinstance(step, Move):
                last, block = block, []
            block.append(step)
            self.record.show({"event": "step", "step": step})
            try:
                self._do(step)
            except Skip:
                self._skip(steps)
            except RedoNow:
                steps[:0] = self._forget(block)
                block = []
            except Redo:
                steps[:0] = [*self._forget(last), step]
                block = []
            else:
                self.record.show({"event": "step_done", "step": step})

    def _skip(self, steps: list[Step]) -> None:
        """Leave out what follows until the next move."""
        while steps and not isinstance(steps[0], Move):
            step = steps.pop(0)
            if isinstance(step, Measure):
                self.record.add({"event": "skipped", "key": step.key})
            self.record.show({"event": "step_done", "step": step})

    def _forget(self, block: list[Step]) -> list[Step]:
        """Drop the takes of a block of steps, so that it is done again."""
        for step in block:
            if isinstance(step, Measure):
                for take in self.state.accepted(step.key):
                    self.reject(take.name, "the operator measured it again")
        return block

    def _do(self, step: Step) -> None:
        if isinstance(step, Move):
            self._move(step)
        elif isinstance(step, Measure):
            self._measure(step)
        else:
            self.clock.sleep(step.seconds)

    def _move(self, step: Move) -> None:
        self._at = step
        self._poses = self.mover.place(step)
        emitter, listener = self._poses
        self.record.add(
            {
                "event": "moved",
                "pair": step.pair,
                "direction": step.direction,
                "emitter": pose_fields(emitter),
                "listener": pose_fields(listener),
            }
        )

    def _measure(self, step: Measure) -> None:
        """Record takes until enough are good or the retakes are used up."""
        self._check_gains(step)
        tries = self.state.missing(step) + self.config.retakes
        while self.state.missing(step) and tries:
            tries -= 1
            self._take(step)
            if not self.state.missing(step):
                self._drop_outlier(step)
        if self.state.missing(step):
            self._give_up(step)
        else:
            self._gave_up = 0
            self._compare(step)

    def _give_up(self, step: Measure) -> None:
        """Leave a direction for later; stop when several fail one after the other.

        Raises
        ------
        SessionError
            If going on would only collect more bad takes.
        """
        reason = self.last_reason
        self.record.add({"event": "gave_up", "key": step.key, "reason": reason})
        self._gave_up += 1
        if self._gave_up >= self.config.stop_after:
            raise SessionError(
                f"{self._gave_up} directions in a row got no good take ({reason}); "
                "mend it and run again: the session resumes"
            )

    def _drop_outlier(self, step: Measure) -> None:
        """Reject the take that is unlike the others, so that it is made again."""
        outlier = self.pair_judge.outlier(self.state, step.key)
        if outlier is not None:
            self.last_reason = outlier[1]
            self.reject(*outlier)

    def _compare(self, step: Measure) -> None:
        """Judge what a finished measure completes: a pair, or the session's closure."""
        if step.closure:
            kind, other = "closure_judged", step.key.removesuffix("-closure")
        else:
            kind, other = "pair_judged", reverse_key(step)
        keys = sorted((step.key, other))
        figures = self.pair_judge.judge(self.state, *keys)
        if figures is not None:
            self.record.add({"event": kind, "pair": step.pair, **figures})
            if figures["doubts"] and self.mover.doubt("; ".join(figures["doubts"])):
                raise RedoNow

    def _check_gains(self, step: Measure) -> None:
        """Refuse a direction that would be recorded with other gains than its pair.

        Raises
        ------
        SessionError
            If the gains have changed.
        """
        now = self.config.gains.model_dump()
        for take in self.state.accepted(reverse_key(step)):
            then = self.state.started[take.name].get("gains", now)
            if then != now:
                raise SessionError(
                    f"{step.key} would be recorded with gains {now}, but {take.name} "
                    f"was with {then}; restore them, or measure the pair again"
                )

    def _take(self, step: Measure) -> None:
        number = self.state.next_take(step.key)
        name = take_name(step.key, number)
        about = {"take": name, "key": step.key, "take_no": number}
        air = self.sensor.read(name)
        self.record.add(
            {"event": "take_started", **about, **self._circumstances(step, air)}
        )
        try:
            recording = self._play(name, step)
        except (InterfaceError, RigError) as error:
            self.last_reason = str(error)
            self.record.add({"event": "take_failed", **about, "reason": str(error)})
            self._mend(error)
            return
        event = self.keep(about, recording)
        self.last_reason = "; ".join(event["reasons"])
        self.record.add(event)

    def _mend(self, error: InterfaceError | RigError) -> None:
        """Make ready for another try after a device has failed."""
        if isinstance(error, InterfaceError):
            self._held.drop()
        elif self._at is not None:
            self.mover.mend(error)
            self._move(self._at)

    def _circumstances(self, step: Measure, air: Environment) -> dict[str, Any]:
        if self._poses is None:
            raise SessionError(f"{step.key} was asked before anything was placed")
        emitter, listener = self._poses
        return {
            "pair": step.pair,
            "direction": step.direction,
            "loudspeaker": step.loudspeaker,
            "gains": self.config.gains.model_dump(),
            "emitter": pose_fields(emitter),
            "listener": pose_fields(listener),
            "air": {
                "temperature_c": air.temperature_c,
                "humidity_percent": air.humidity_percent,
                "pressure_kpa": air.pressure_kpa,
            },
        }

    def _play(self, name: str, step: Measure) -> Recording:
        interface = self._held.get()
        self.record.show(
            {"event": "playing", "take": name, "seconds": self.plan.take_s}
        )
        with self.mover.quiet():
            return interface.play_record(
                self.take_judge.signal,
                self.take_judge.signal.shape[-1],
                label=name,
                output=step.loudspeaker,
            )

    def keep(self, about: dict[str, Any], recording: Recording) -> dict[str, Any]:
        """Write a recording to the disk, judge it, and return its event."""
        peaks = 20 * np.log10(np.abs(recording.samples).max(axis=-1) + 1e-10)
        self.record.show({"event": "recorded", "peak_dbfs": peaks.tolist()})
        path = self.folder.write_raw(
            about["take"], recording.samples, recording.sample_rate
        )
        started = self.state.started[about["take"]]
        verdict = self.take_judge.judge(recording, started)
        if verdict.accepted:
            self.pair_judge.remember(
                about["take"], recording.samples, verdict.response, started
            )
        return self.finished(about, path.name, verdict, recording.flags)

    def finished(
        self, about: dict[str, Any], file: str, verdict: TakeVerdict, flags: list[str]
    ) -> dict[str, Any]:
        """Return the event of a take whose file is on the disk."""
        return {
            "event": "take_finished",
            **about,
            "file": f"raw/{file}",
            "sha256": file_sha256(self.folder.raw_path / file),
            "accepted": verdict.accepted,
            "reasons": verdict.reasons,
            "marks": verdict.marks,
            "figures": verdict.figures,
            "flags": flags,
        }

    def _stop(self, error: BaseException) -> None:
        """Bring everything to rest and say why, whatever has happened."""
        self.mover.stop()
        reason = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        try:
            self.record.add({"event": "stopped", "reason": reason})
        except SessionError:
            log.warning("the stop could not be journalled")

    def _close(self) -> None:
        self._held.drop()
        self.mover.close()


def pose_fields(pose: Pose) -> dict[str, Any]:
    """Return a pose as plain data.

    Examples
    --------
    >>> pose_fields(Pose.at(1, 2, 1.2))["position_m"]
    [1.0, 2.0, 1.2]
    """
    return {
        "position_m": pose.position.tolist(),
        "orientation": pose.orientation.tolist(),
    }
