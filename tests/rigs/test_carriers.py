import pytest

from rigs import Carriers, Envelope, SimulatedRig, VirtualClock
from rir.errors import OutOfReachError, RigError
from rir.pose import Pose

A, B = Pose.at(1, 1, 1), Pose.at(2, 1, 1)


def test_place_and_swap_report_both_poses():
    seen = []
    carriers = Carriers(
        SimulatedRig(lambda pose: seen.append(("emitter", pose))),
        SimulatedRig(lambda pose: seen.append(("listener", pose))),
    )
    carriers.place(A, B)
    assert seen == [("emitter", A), ("listener", B)]
    assert carriers.place(B, A) == (B, A)
    assert carriers.where() == (B, A)
    assert carriers.simulated


def test_too_close_is_refused_before_anything_moves():
    seen = []
    carriers = Carriers(SimulatedRig(seen.append), SimulatedRig(), separation=0.3)
    with pytest.raises(OutOfReachError, match=r"0\.100 m apart"):
        carriers.place(A, Pose.at(1.1, 1, 1))
    assert seen == []


def test_an_error_stops_both():
    class Failing(SimulatedRig):
        stopped = 0

        def move(self, pose, via=()):  # noqa: ARG002
            raise RigError("the belt is off")

        def stop(self):
            self.stopped += 1

    emitter, listener = Failing(), Failing()
    with pytest.raises(RigError, match="belt"):
        Carriers(emitter, listener).place(A, B)
    assert (emitter.stopped, listener.stopped) == (1, 1)


def test_a_simulated_rig_takes_its_time():
    clock = VirtualClock()
    rig = SimulatedRig(clock=clock, speed=0.5, acceleration=0.5, settle=2.0, start=A)
    rig.move(B)
    assert clock.now() == pytest.approx(1.0 / 0.5 + 0.5 / 0.5 + 2.0)
    assert rig.duration(A, B) == pytest.approx(clock.now())


def test_envelope_error_names_the_rig_and_the_numbers():
    rig = SimulatedRig(envelope=Envelope([0, 0, 0], [1, 1, 1]), name="gantry")
    with pytest.raises(OutOfReachError, match=r"gantry pose .* 1.000 m beyond the x"):
        rig.check(B)
