"""Scattered sound of boxes by transport, without chance."""

from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray
from rooms.transport.box import BoxTransport, Detail
from rooms.transport.mirrors import image_energy
from rooms.transport.places import find_places, pair_energy

__all__ = [
    "COARSE",
    "FINE",
    "LATE_MODEL",
    "BoxTransport",
    "find_places",
    "image_energy",
    "pair_energy",
    "transport_of",
]

LATE_MODEL = "transport 2"
"""Which late sound simulated data sets hold; those that state none hold boxes whose
scattered sound decayed as Eyring says. It goes up when responses change."""

FINE = Detail()
"""For responses: decays to 0.5 %, levels to 0.05 dB (benchmarks/box_transport)."""

COARSE = Detail(stretch=0.0, wall_rays=4096, volume_rays=32768, place_rays=0)
"""For means over places: decays to 2 %, in a tenth of the time."""


def transport_of(
    size: FloatArray,
    absorption: FloatArray,
    scattering: FloatArray,
    speed: float,
    duration: float,
    detail: Detail,
) -> BoxTransport:
    """Return the transport in a box, see `BoxTransport`; made once for the last few."""
    arrays = [np.ascontiguousarray(x, float) for x in (size, absorption, scattering)]
    keys = tuple(array.tobytes() for array in arrays)
    return _made(*keys, absorption.shape[1], float(speed), float(duration), detail)


@lru_cache(maxsize=8)
def _made(
    size: bytes,
    absorption: bytes,
    scattering: bytes,
    bands: int,
    speed: float,
    duration: float,
    detail: Detail,
) -> BoxTransport:
    one, other = (np.frombuffer(x).reshape(6, bands) for x in (absorption, scattering))
    return BoxTransport(np.frombuffer(size), one, other, speed, duration, detail)
