"""Sound that bends around the edges of a room of flat faces."""

import numpy as np

from inverse.paths.box_fit import SLOW_HZ
from inverse.paths.mesh_room import MeshRoom
from inverse.paths.room import turns_of
from inverse.rows.fitset import place_numbers
from rir import Poses
from rir.arrays import ComplexArray, FloatArray

__all__ = ["bends", "bent_sound"]

LEAST_OPENING_DEG = 200.0  # edges of less are nearly flat: what they bend is faint
MOST_EDGES = 60  # more cost minutes: ways are tried edge by edge
FREQUENCIES = 24
"""Per half octave about two, from `SLOW_HZ` up: gains are smooth between them."""


def bends(room: MeshRoom) -> bool:
    """Tell whether a room has edges that bend sound, few enough to follow."""
    from rooms.diffraction import find_edges

    count = len(find_edges(room.shape.mesh, least_opening_deg=LEAST_OPENING_DEG))
    return 0 < count <= MOST_EDGES


def bent_sound(
    room: MeshRoom, emitters: Poses, listeners: Poses, n_samples: int
) -> FloatArray:
    """Return what arrives by way of one edge or two, shape (rows, n_samples).

    The uniform theory of diffraction gives the gain of each way at some
    frequencies; between them it is drawn smoothly. Ways that are mirrored as well
    are left out.
    """
    from rooms.diffraction import diffracted_paths, find_edges

    mesh = room.shape.mesh
    edges = find_edges(mesh, least_opening_deg=LEAST_OPENING_DEG)
    bands = np.geomspace(SLOW_HZ, room.sample_rate / 2, FREQUENCIES)
    factors = np.repeat(np.abs(room.walls)[:, None], FREQUENCIES, axis=1)
    size = int(2 ** np.ceil(np.log2(n_samples + room.bank.taps.shape[1])))
    hertz = np.arange(size // 2 + 1) * room.sample_rate / size
    spectra = np.zeros((len(emitters), len(hertz)), dtype=complex)
    turns = turns_of(emitters, np.eye(3)), turns_of(listeners, np.eye(3))
    places = place_numbers(emitters.positions)
    reach = (n_samples / room.sample_rate - room.latency_s) * room.speed_of_sound
    for place in range(int(places.max(initial=-1)) + 1):
        mine = np.flatnonzero(places == place)
        ways = diffracted_paths(
            mesh,
            emitters.positions[mine[0]],
            listeners.positions[mine],
            bands=bands,
            speed_of_sound=room.speed_of_sound,
            reflection=factors,
            edges=edges,
        )
        for k in np.flatnonzero(ways.length < reach).tolist():
            row = mine[ways.listener[k]]
            level = _gain(turns[0][row] @ ways.departure[k], room.emitting)
            level *= _gain(turns[1][row] @ ways.arrival[k], room.listening)
            delay = ways.length[k] / room.speed_of_sound + room.latency_s
            shape = _smooth(hertz, bands, ways.gain[k])
            spectra[row] += level * shape * np.exp(-2j * np.pi * hertz * delay)
    return np.fft.irfft(spectra * _pulse(room, size), size)[:, :n_samples]


def _gain(way: FloatArray, pattern: FloatArray) -> float:
    from rir.harmonics_kernel import fill_harmonics, order_of

    basis = np.empty(len(pattern))
    fill_harmonics(way[0], way[1], way[2], order_of(len(pattern)), basis)
    return float(pattern @ basis)


def _smooth(hertz: FloatArray, bands: FloatArray, gain: ComplexArray) -> ComplexArray:
    at = np.log(np.clip(hertz, bands[0], bands[-1]))
    known = np.log(bands)
    return np.interp(at, known, gain.real) + 1j * np.interp(at, known, gain.imag)


def _pulse(room: MeshRoom, size: int) -> ComplexArray:
    """Return the spectrum of an arrival at a whole sample."""
    signs = (-1.0) ** np.arange(room.bank.taps.shape[0])
    lead = np.exp(2j * np.pi * np.arange(size // 2 + 1) * room.bank.lead / size)
    return np.fft.rfft(signs @ room.bank.taps, size) * lead
