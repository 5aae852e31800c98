import inspect

import numpy as np
import pytest

from capture.interfaces import INTERFACES, AudioInterface, Surroundings
from capture.interfaces.portaudio import PortAudioInterface
from capture.interfaces.simulated import SimulatedInterface
from capture.session.start import SessionRequest, plan_session

KINDS = {"simulated": SimulatedInterface, "portaudio": PortAudioInterface}


class Delta:
    """A world that answers with the direct sound alone."""

    def responses(self, output: int = 0) -> np.ndarray:
        del output
        return np.eye(1, 64)


@pytest.mark.parametrize("name", sorted(INTERFACES))
def test_every_interface_keeps_the_protocol(name: str) -> None:
    kind = KINDS[name]
    asked = inspect.signature(AudioInterface.play_record).parameters
    assert list(inspect.signature(kind.play_record).parameters) == list(asked)
    for member in ("describe", "close"):
        assert callable(getattr(kind, member))
    assert isinstance(kind.simulated, bool)
    assert INTERFACES[name].about


def test_the_simulated_one_is_an_interface_in_full() -> None:
    config = plan_session(SessionRequest("kitchen", "1"))
    interface = INTERFACES["simulated"].open(config, Surroundings(Delta()))
    assert isinstance(interface, AudioInterface)
    signal = np.zeros(4000)
    signal[100:2000] = np.hanning(1900)
    take = interface.play_record(signal, 5000, label="t")
    assert take.samples.shape == (interface.n_inputs, 5000)
    assert take.sample_rate == interface.sample_rate
    interface.close()
