"""Random faults on two simulated rigs, and the rules no fault may break.

The rules: every call ends within its time; afterwards each position is either not
known or right; nothing is sent into motion outside the envelope or with an unknown
position; the carriers keep clear of each other and of the keep-outs.
"""

import math
import re
from dataclasses import dataclass, field

import numpy as np

from rigs.calibration.frame import Frame
from rigs.calibration.mount import Mount
from rigs.carriers import Carriers
from rigs.clock import VirtualClock
from rigs.firmware.grbl.firmware import GrblFirmware
from rigs.grbl.controller import GrblController
from rigs.grbl.options import GrblOptions
from rigs.lines.direct import DirectLine
from rigs.machine import MachineRig
from rigs.planning.envelope import Envelope, KeepOut
from rigs.rig import Surroundings
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

SETTINGS = {
    20: 1, 22: 1, 24: 600, 25: 6000, 27: 2, 110: 12000, 111: 12000, 112: 12000,
    120: 500, 121: 500, 122: 500, 130: 2000, 131: 2000, 132: 1500,
}  # fmt: skip
KEEP_OUTS = (
    KeepOut("table", [0.7, 0.7, 0.0], [1.2, 1.3, 0.7]),
    KeepOut("shelf", [1.6, 0.2, 0.9], [1.9, 0.8, 1.2]),
)
LOWS = np.array([box.low for box in KEEP_OUTS])
HIGHS = np.array([box.high for box in KEEP_OUTS])
SEPARATION = 0.25
CLEARANCE = 0.08
TOLERANCE = 1e-4
"""Largest error of a believed position, m."""
LONGEST_CALL = 900.0
"""Simulated seconds any call may take: homing, a reconnection and a retry included."""
CONFIRMED = 2.5e-4
"""The same after a confirmation: 0.1 mm on each axis and the search's step, m."""
SLIP = 4.0
"""Largest extent of lost steps, mm."""
WATCH = 0.1
MOTION = re.compile(rb"G1 X(\S+) Y(\S+) Z(\S+) F")
FAULTS = (
    "brown-out", "garbage", "garble", "mute", "delay", "unplug", "deaf", "reset",
    "hold", "door", "soft-limit", "hard-limit", "sleep", "unlock",
)  # fmt: skip


class BrokenRuleError(AssertionError):
    """One of the rules was broken."""


@dataclass(frozen=True)
class Fault:
    """One thing that goes wrong."""

    kind: str
    carrier: int
    after: float
    """Seconds from the start of the next call."""
    amount: float = 1.0


class WatchedLine(DirectLine):
    """A line that checks every motion command against the rules."""

    driver: GrblController
    rig: MachineRig

    def write(self, data: bytes) -> None:
        """Send bytes, unless they break a rule."""
        for match in MOTION.finditer(data):
            axes = dict(zip("xyz", map(float, match.groups()), strict=True))
            point = self.rig.pose_of(axes | {"yaw": 0.0}).position
            if not self.driver.known:
                raise BrokenRuleError(f"motion to {point} with an unknown position")
            if self.rig.envelope.path_gap(point[None]) < -1e-6 or np.any(
                (point < self.rig.envelope.low - 1e-6)
                | (point > self.rig.envelope.high + 1e-6)
            ):
                raise BrokenRuleError(f"motion to {point}, outside the envelope")
        super().write(data)


@dataclass
class Ordeal:
    """Two rigs, one clock, and someone who breaks things.

    Parameters
    ----------
    seed
        Of the noise on the lines.
    """

    seed: int = 0
    clock: VirtualClock = field(default_factory=VirtualClock)
    errors: list[str] = field(default_factory=list)
    longest: float = 0.0
    """Simulated seconds of the longest call."""
    reference: bool = False
    """Whether the rigs feel for their switches, so that they can find lost steps."""
    lost: list[bool] = field(default_factory=lambda: [False, False])
    """Whether steps were lost since a carrier last proved its position."""

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        self.chips = [
            GrblFirmware(SETTINGS, at=at, rng=rng)
            for at in ((-300.0, -300.0, -300.0), (-400.0, -300.0, -300.0))
        ]
        self.frames = [
            Frame.at([2.0, 2.0, 1.6]),
            Frame.at([0.0, 0.0, 1.6], yaw_deg=180.0),
        ]
        self.carriers = Carriers(self._rig(0), self._rig(1), SEPARATION)
        self.watching = False

    @property
    def reaches(self) -> list[Envelope]:
        """Return where each carrier may be."""
        return [rig.envelope for rig in self.carriers.rigs if rig.envelope]

    def _rig(self, k: int) -> MachineRig:
        line = WatchedLine(self.chips[k], self.clock)
        options = GrblOptions(
            feed_mm_per_min=12000, settle_s=0.2, reference=self.reference
        )
        driver = GrblController(line, self.clock, options, simulated=True)
        envelope = Envelope([0.05] * 3, [1.95, 1.95, 1.55], KEEP_OUTS, CLEARANCE, "up")
        around = Surroundings(clock=self.clock)
        mount = Mount(self.frames[k], free_orientation=True)
        rig = MachineRig(f"rig {k}", "grbl", [driver], envelope, mount, around)
        line.driver, line.rig = driver, rig
        return rig

    def truth(self, k: int) -> np.ndarray:
        """Return where a carrier really is, m."""
        self.chips[k].advance(self.clock.now())
        return self.frames[k].to_room(self.chips[k].true_position)

    # -- faults -----------------------------------------------------------------------

    def inflict(self, fault: Fault) -> None:
        """Let a fault happen some time into the next call."""
        chip = self.chips[fault.carrier]
        chip.advance(self.clock.now())
        chip.schedule(fault.after, lambda: self._do(chip, fault), lasting=True)

    def _do(self, chip: GrblFirmware, fault: Fault) -> None:
        if fault.kind == "lost-steps":
            k = self.chips.index(chip)
            chip.slip(SLIP * fault.amount * (chip.rng.random(3) - 0.5))
            self.lost[k] = True
            return
        if fault.kind in ("soft-limit", "hard-limit"):
            if not chip.state.locked and chip.state.name in ("Run", "Idle", "Jog"):
                chip.alarm(2 if fault.kind == "soft-limit" else 1, critical=True)
            return
        pressed = {"reset": 0x18, "hold": ord("!"), "door": 0x84}
        if fault.kind in pressed:
            chip.hear(pressed[fault.kind])
        elif fault.kind in ("sleep", "unlock"):
            for byte in b"$SLP\n" if fault.kind == "sleep" else b"$X\n":
                chip.hear(byte)
        else:
            self._disturb(chip, fault)

    def _disturb(self, chip: GrblFirmware, fault: Fault) -> None:
        count = max(1, round(4 * fault.amount))
        deeds = {
            "brown-out": chip.power_cycle,
            "garbage": lambda: chip.babble(10 * count),
            "garble": lambda: chip.garble(count),
            "mute": lambda: chip.mute(3.0 * fault.amount),
            "delay": lambda: self._lag(chip, fault),
            "unplug": lambda: chip.unplug(8.0 * fault.amount),
            "deaf": lambda: chip.deafen(count),
        }
        deeds[fault.kind]()

    def _lag(self, chip: GrblFirmware, fault: Fault) -> None:
        chip.delay(1.5 * fault.amount)
        chip.schedule(10.0, lambda: chip.delay(0.0), lasting=True)

    # -- calls ------------------------------------------------------------------------

    @property
    def _margin(self) -> float:
        """How much nearer than planned the carriers may come, m."""
        return 2e-3 + (4e-3 * SLIP if any(self.lost) else 0.0)

    def _watch(self, k: int) -> None:
        """Check the true places every few centiseconds while a call goes on."""
        if not self.watching:
            return
        self.chips[k].schedule(WATCH, lambda: self._watch(k), lasting=True)
        if self.chips[k].state.glide is None:
            return
        here = self.frames[k].to_room(self.chips[k].true_position)
        other = self.frames[1 - k].to_room(self.chips[1 - k].true_position)
        apart = math.dist(here[:2], other[:2])
        if apart < SEPARATION - self._margin:
            raise BrokenRuleError(
                f"the carriers are {apart:.3f} m apart at {here} and {other}"
            )
        outside = np.maximum(np.maximum(LOWS - here, here - HIGHS), 0.0)
        gap = math.sqrt(float((outside * outside).sum(axis=1).min()))
        if gap < CLEARANCE - self._margin:
            raise BrokenRuleError(f"carrier {k} is {gap:.3f} m from a keep-out")

    def call(self, action: str, *poses: Pose) -> bool:
        """Make one call, check the rules, and return whether it succeeded."""
        began = self.clock.now()
        self.watching = True
        for k in (0, 1):
            self.chips[k].advance(began)
            self._watch(k)
        try:
            getattr(self.carriers, action)(*poses)
            good = True
        except (RigError, OutOfReachError) as error:
            self.errors.append(f"{type(error).__name__}: {error}")
            good = False
        self.watching = False
        took = self.clock.now() - began
        self.longest = max(self.longest, took)
        if took > LONGEST_CALL:
            raise BrokenRuleError(f"{action} took {took:.0f} s")
        if good and action == "confirm":
            self._check_confirmed()
        self._check_beliefs(poses if good and action == "place" else ())
        return good

    def _check_confirmed(self) -> None:
        """After a confirmation even lost steps must not hide."""
        for k, rig in enumerate(self.carriers.rigs):
            believed = rig.where()
            if believed is not None:
                off = float(np.linalg.norm(believed.position - self.truth(k)))
                if off > CONFIRMED:
                    raise BrokenRuleError(f"confirmed, and {1e3 * off:.2f} mm off")
                self.lost[k] = self.lost[k] and off > TOLERANCE

    def _check_beliefs(self, poses: tuple[Pose, ...]) -> None:
        for k, rig in enumerate(self.carriers.rigs):
            believed = rig.where()
            if believed is None:
                continue
            error = float(np.linalg.norm(believed.position - self.truth(k)))
            self.lost[k] = self.lost[k] and error > TOLERANCE
            if not self.lost[k] and not error <= TOLERANCE:
                raise BrokenRuleError(f"carrier {k} is {1e3 * error:.2f} mm off belief")
            if poses and believed.distance(poses[k]) > TOLERANCE:
                raise BrokenRuleError(f"carrier {k} did not go where it was sent")


def random_pose(rng: np.random.Generator, envelope: Envelope) -> Pose:
    """Draw an allowed pose."""
    while True:
        point = rng.uniform(envelope.low, envelope.high)
        if bool(envelope.contains(point)):
            return Pose(point)


def random_fault(rng: np.random.Generator, *, lost_steps: bool = False) -> Fault:
    """Draw a fault."""
    kind = str(
        rng.choice((*FAULTS, "lost-steps", "lost-steps") if lost_steps else FAULTS)
    )
    after = float(rng.exponential(2.0))
    return Fault(kind, int(rng.integers(2)), after, float(rng.uniform(0.1, 2.0)))


def run_sequence(seed: int, calls: int = 4, *, lost_steps: bool = False) -> Ordeal:
    """Play one random sequence of calls and faults, and return what was left.

    Parameters
    ----------
    seed
        Of everything drawn.
    calls
        Placements in the sequence.
    lost_steps
        Whether steps get lost too; the rigs confirm after each placement then.

    Raises
    ------
    BrokenRuleError
        If a rule was broken.
    """
    rng = np.random.default_rng(seed)
    ordeal = Ordeal(seed, reference=lost_steps)
    ordeal.call("home")
    for _ in range(calls):
        for _ in range(int(rng.integers(0, 3))):
            ordeal.inflict(random_fault(rng, lost_steps=lost_steps))
        while True:
            poses = [random_pose(rng, reach) for reach in ordeal.reaches]
            between = poses[0].position - poses[1].position
            if np.linalg.norm(between[:2]) > SEPARATION:
                break
        if not ordeal.call("place", *poses) or (
            lost_steps and not ordeal.call("confirm")
        ):
            ordeal.call("home")
    return ordeal
