import pytest

from capture.interfaces import INTERFACES, InterfaceSurroundings
from capture.interfaces.conformance import (
    DirectWorld,
    check_interface,
    check_interface_type,
)
from capture.interfaces.portaudio import PortAudioInterface
from capture.interfaces.simulated import SimulatedInterface
from capture.session.start import SessionRequest, plan_session

KINDS = {"simulated": SimulatedInterface, "portaudio": PortAudioInterface}


@pytest.mark.parametrize("name", sorted(INTERFACES))
def test_every_interface_keeps_the_protocol(name: str) -> None:
    check_interface_type(KINDS[name])
    assert INTERFACES[name].about


def test_the_simulated_one_is_an_interface_in_full() -> None:
    config = plan_session(SessionRequest("kitchen", "1"))
    around = InterfaceSurroundings(DirectWorld())
    check_interface(INTERFACES["simulated"].open(config, around))
