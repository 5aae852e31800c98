"""What finite panels change at reflections: mirrored sound becomes scattered."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rir.arrays import FloatArray, IntArray
from rooms.mesh import MeshGeometry
from rooms.panels.kinds import kinds_of
from rooms.panels.rims import Rims, rims_of
from rooms.panels.strength import Faces, mirror_strength
from rooms.reflection import Bounces, Reflection

__all__ = ["FinitePanels", "finite_panels", "mean_strengths"]

_BLOCK = 4096
"""Reflections looked at in one go: 35 frequencies of each take 50 MB."""

_PLACES = np.array([-0.5, 0.5]) / np.sqrt(3)
"""Where a mean looks for the point of reflection along each side: Gauss's rule."""

_COSINES = np.array([0.05, 0.2, 0.4, 0.65, 1.0])
"""Cosines at which means are known; between them they are interpolated."""


@dataclass(frozen=True, eq=False)
class FinitePanels:
    """Reflections lose to scattering what a face of limited size does not mirror.

    What the mirror loses is scattered, so that energy is kept. Where the way of the
    sound is not known the answer is a mean over places on a panel, or on all panels of
    a surface, and over the directions in their plane.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    bands : ndarray, shape (bands,)
        Middle frequencies of octaves [Hz].
    speed : float
        Speed of sound [m/s].

    References
    ----------
    C. L. Christensen, J. H. Rindel, Forum Acusticum, Budapest, 2005: reflection-based
    scattering.
    """

    geometry: MeshGeometry
    bands: FloatArray
    speed: float
    local: bool = True

    def __call__(self, reflection: Reflection, bounces: Bounces) -> Reflection:
        """Take what each face does not mirror."""
        strength = np.ones_like(reflection.pressure)
        if bounces.way is not None:
            rows = np.nonzero(bounces.panel >= 0)[0]
            for first in range(0, len(rows), _BLOCK):
                part = rows[first : first + _BLOCK]
                strength[part] = self._known(bounces, bounces.way[part], part)
        else:
            strength = self._mean(bounces)
        # where a face gathers sound there is more than all of it to mirror
        gathered = np.sqrt(np.maximum(strength, 1.0))
        changed = replace(reflection, pressure=reflection.pressure * gathered)
        return changed.with_scattering(1.0 - np.minimum(strength, 1.0))

    def _known(self, bounces: Bounces, way: FloatArray, rows: IntArray) -> FloatArray:
        """Return the strength of reflections whose ways are known."""
        rims, panels = rims_of(self.geometry), self.geometry.panels
        panel = bounces.panel[rows]
        height = np.einsum("ij,ij->i", way, panels.normal[panel])
        side = (height > 0).astype(np.int64)
        strength = np.ones((len(rows), len(self.bands)))
        ends = np.nonzero(rims.limited[panel, side])[0]
        if not len(ends):
            return strength
        panel, side, rows = panel[ends], side[ends], rows[ends]
        axes = rims.axes[panel]
        point = bounces.point[rows] - self.geometry.origin - rims.center[panel]
        place = np.einsum("nas,ns->na", axes, point)
        flat = np.einsum("nas,ns->na", axes, way[ends])
        local = np.column_stack([flat, -np.abs(height[ends])])
        faces = _faces(rims, panel, side, place, local)
        faces = replace(faces, before=bounces.before[rows], after=bounces.after[rows])
        strength[ends] = mirror_strength(faces, self.bands, self.speed)
        return strength

    def mean(self, free: float) -> FloatArray:
        """Return the mean strength of surfaces in a diffuse field, (surfaces, bands).

        Parameters
        ----------
        free : float
            Way before and after [m].
        """
        # 2 cosine d(cosine) arrives at each angle
        edges = np.concatenate([[0.0], (_COSINES[1:] + _COSINES[:-1]) / 2, [1.0]])
        return np.einsum("c,scb->sb", np.diff(edges**2), self._tables(free)[1])

    def _tables(self, free: float) -> tuple[FloatArray, FloatArray]:
        # what encloses no air has no mean free path
        free = free if free > 0 else self.geometry.diagonal
        return mean_strengths(self.geometry, tuple(self.bands), self.speed, free)

    def _mean(self, bounces: Bounces) -> FloatArray:
        """Return mean strengths of panels or surfaces at angles of incidence."""
        panels, surfaces = self._tables(float(bounces.before[0]))
        cosine = np.clip(bounces.cosine, _COSINES[0], _COSINES[-1])
        above = np.clip(np.searchsorted(_COSINES, cosine), 1, len(_COSINES) - 1)
        low, high = _COSINES[above - 1], _COSINES[above]
        part = ((cosine - low) / (high - low))[:, None]
        below, beyond = (
            np.where(
                (bounces.panel >= 0)[:, None],
                panels[bounces.panel, at],
                surfaces[bounces.surface, at],
            )
            for at in (above - 1, above)
        )
        return (1 - part) * below + part * beyond


def finite_panels(
    geometry: MeshGeometry, bands: FloatArray, speed: float
) -> FinitePanels | None:
    """Return the change for a room; None if no face ends where sound can pass."""
    if not np.any(rims_of(geometry).limited):
        return None
    return FinitePanels(geometry, bands, speed)


@lru_cache(maxsize=16)
def mean_strengths(
    geometry: MeshGeometry, bands: tuple[float, ...], speed: float, free: float
) -> tuple[FloatArray, FloatArray]:
    """Return the mean strength of panels and of surfaces, (n, cosines, bands) each.

    Panels of about the same size and ends share one mean. Ways before and after are
    the mean free path `free` [m].
    """
    rims, panels = rims_of(geometry), geometry.panels
    number, panel, side = kinds_of(geometry)
    means = [
        _panel_mean(rims, p, s, free, np.array(bands), speed)
        for p, s in zip(panel.tolist(), side.tolist(), strict=True)
    ]
    # kind 0 has no end and loses nothing
    kinds = np.array([np.ones((len(_COSINES), len(bands))), *means])
    met = np.where(rims.met.sum(axis=1, keepdims=True) > 0, rims.met, 1.0)
    share = (met / met.sum(axis=1, keepdims=True))[:, :, None, None]
    strengths = (kinds[number] * share).sum(axis=1)
    lost = np.zeros((geometry.surfaces, len(_COSINES), len(bands)))
    area = geometry.face_areas * rims.met.sum(axis=1)[panels.of_face]
    away = area[:, None, None] * (1 - strengths[panels.of_face])
    np.add.at(lost, geometry.face_surface, away)
    return strengths, 1 - lost / np.maximum(geometry.areas, 1e-300)[:, None, None]


def _panel_mean(
    rims: Rims,
    panel: int,
    side: int,
    free: float,
    bands: FloatArray,
    speed: float,
) -> FloatArray:
    """Return the mean strength of a panel at each cosine, shape (cosines, bands)."""
    grid = [
        _places(low, high)
        for low, high in zip(rims.low[panel, side], rims.high[panel, side], strict=True)
    ]
    u, v, cosine, turn = np.meshgrid(*grid, _COSINES, [0, np.pi / 2], indexing="ij")
    sine = np.sqrt(1 - cosine**2)
    way = np.stack([sine * np.cos(turn), sine * np.sin(turn), -cosine], axis=-1)
    count = u.size
    place = np.stack([u, v], axis=-1).reshape(count, 2)
    rows = np.full(count, panel), np.full(count, side)
    faces = _faces(rims, *rows, place, way.reshape(count, 3))
    faces = replace(faces, before=np.full(count, free), after=np.full(count, free))
    strength = mirror_strength(faces, bands, speed).reshape(*u.shape, len(bands))
    return np.minimum(strength.mean(axis=(0, 1, 3)), 1.0)


def _places(low: float, high: float) -> FloatArray:
    """Return where along a side sound may be mirrored."""
    if np.isfinite(high - low):
        return (low + high) / 2 + _PLACES * (high - low)
    return np.zeros(1)


def _faces(
    rims: Rims, panel: IntArray, side: IntArray, place: FloatArray, way: FloatArray
) -> Faces:
    """Return reflections at places on panels, with ways yet to be stated."""
    none = np.zeros(len(panel))
    return Faces(
        way,
        none,
        none,
        rims.low[panel, side] - place,
        rims.high[panel, side] - place,
        rims.bend[panel, side],
        rims.passage[panel, side],
        rims.gap[panel, side],
    )
