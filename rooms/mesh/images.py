"""Specular paths in rooms made of polygons: all of them, each once."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError
from rooms.mesh.geometry import MeshGeometry
from rooms.reflection import Bounces

__all__ = ["Paths", "find_paths"]

ShortArray = NDArray[np.int32]
_SLACK = 1e-9  # of the diagonal: far above rounding, far below a wavelength
_DEEPEST = 100  # orders: far beyond what any search finishes


@dataclass(frozen=True, eq=False)
class Paths:
    """Mirror paths from one emitter to listeners, as a struct of arrays.

    Rows are sorted by listener, then by length.

    Parameters
    ----------
    listener : ndarray, shape (n,)
        Index of the listener.
    length : ndarray, shape (n,)
        Length [m]: the distance from the image to the listener.
    departure, arrival : ndarray, shape (n, 3)
        Unit vectors out of the emitter, and from the listener to where it comes
        from; zero where emitter and listener coincide.
    order : ndarray, shape (n,)
        Number of reflections.
    faces, surfaces : ndarray, shape (n, max_order)
        Triangle and surface of each reflection in order, then -1.
    complete : bool
        False if the search met its limit of nodes.
    """

    listener: IntArray
    length: FloatArray
    departure: FloatArray
    arrival: FloatArray
    order: IntArray
    faces: ShortArray
    surfaces: ShortArray
    complete: bool = True

    def __len__(self) -> int:
        return len(self.listener)

    def gains(self, reflection: ArrayLike, nearest: float = 0.01) -> FloatArray:
        """Return the amplitude of each path per band, shape (n, bands).

        Parameters
        ----------
        reflection : array_like, shape (surfaces, bands)
            Amplitude reflection factors.
        nearest : float
            Lengths below this [m] count as this.
        """
        table = np.asarray(reflection, dtype=float)
        table = np.concatenate([table, np.ones((1, table.shape[1]))])
        # sorted, so that both directions multiply in the same order
        met = np.sort(self.surfaces, axis=1)
        gain = np.ones((len(self), table.shape[1]))
        for column in met.T:
            gain *= table[column]
        return gain / np.maximum(self.length, nearest)[:, None]

    def bounces(
        self, geometry: MeshGeometry, emitter: ArrayLike
    ) -> tuple[IntArray, Bounces]:
        """Return every reflection of all paths, and the path of each.

        Parameters
        ----------
        geometry : MeshGeometry
            The room the paths were found in.
        emitter : array_like, shape (3,)
            Position the paths were found from [m].

        Returns
        -------
        rows : ndarray, shape (bounces,)
            Index of the path, ascending; along each path from the emitter on.
        bounces : Bounces
            The reflections.
        """
        panels = geometry.panels
        place = np.repeat(geometry.localised(emitter), len(self), axis=0)
        way = self.departure.copy()
        before = np.zeros(len(self))
        parts = []
        for column in range(self.faces.shape[1]):
            rows = np.nonzero(self.faces[:, column] >= 0)[0]
            panel = panels.of_face[self.faces[rows, column]]
            normal = panels.normal[panel]
            towards = np.einsum("ij,ij->i", normal, way[rows])
            apart = panels.offset[panel] - np.einsum("ij,ij->i", normal, place[rows])
            step = apart / np.where(towards == 0, 1.0, towards)
            before[rows] += step
            place[rows] += step[:, None] * way[rows]
            arriving = way[rows]
            way[rows] -= 2 * towards[:, None] * normal
            surface = self.surfaces[rows, column]
            parts.append(
                (
                    rows,
                    panel,
                    surface,
                    np.abs(towards),
                    before[rows],
                    place[rows],
                    arriving,
                )
            )
        if not parts:
            none, empty = np.zeros(0, dtype=np.int64), np.zeros(0)
            return none, Bounces(none, none, empty, empty, empty, np.zeros((0, 3)))
        rows, panel, surface, cosine, gone, point, arriving = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        order = np.argsort(rows, kind="stable")
        rows, gone = rows[order], gone[order]
        return rows, Bounces(
            surface[order].astype(np.int64),
            panel[order],
            cosine[order],
            gone,
            self.length[rows] - gone,
            point[order] + geometry.origin,
            arriving[order],
        )


def find_paths(
    geometry: MeshGeometry,
    emitter: ArrayLike,
    listeners: ArrayLike,
    *,
    max_order: int,
    max_length: float = np.inf,
    direct: bool = True,
    max_nodes: int = 50_000_000,
) -> Paths:
    """Find every mirror path from an emitter to listeners.

    A tree of images is pruned by the beams that reach each panel and by length;
    what is left is traced back in double precision: each reflection point lies in
    its panel, and nothing stands between. Triangulation does not matter, and
    exchanging the ends gives the same paths to the last bit.

    Parameters
    ----------
    geometry : MeshGeometry
        The room.
    emitter : array_like, shape (3,)
        Position [m].
    listeners : array_like, shape (L, 3)
        Positions [m].
    max_order : int
        Most reflections, 0…100.
    max_length : float
        Longest path [m].
    direct : bool
        Whether to include the straight way, where it is free.
    max_nodes : int
        Most nodes to look at; beyond it the result says it is not complete.

    Raises
    ------
    SceneError
        If an order is out of range or a position is not finite.

    References
    ----------
    J. Borish, JASA 75, 1827 (1984): images in polyhedra. P. Heckbert,
    P. Hanrahan, SIGGRAPH 1984: beams.

    Examples
    --------
    >>> room = MeshGeometry.box((6, 5, 3))
    >>> paths = find_paths(room, [1.7, 3.1, 1.4], [[4, 1, 2]], max_order=3)
    >>> len(paths)
    63
    """
    from rooms.mesh.backtrace import arrange, validate
    from rooms.mesh.beams import search

    if not 0 <= max_order <= _DEEPEST:
        raise SceneError(f"paths of order 0…{_DEEPEST} can be found, not {max_order}")
    start = geometry.localised(emitter)[0]
    ends = geometry.localised(listeners)
    panels = geometry.panels
    who, order, sequence, nodes = search(
        start,
        np.ascontiguousarray(ends.T),
        panels.normal,
        panels.offset,
        panels.sided,
        panels.hull_start,
        panels.hull,
        panels.center,
        panels.radius,
        max_order,
        float(max_length),
        max_nodes,
        geometry.tolerance,
    )
    if direct:
        who = np.concatenate([np.arange(len(ends)), who])
        order = np.concatenate([np.zeros(len(ends), np.int64), order])
        none = np.full((len(ends), sequence.shape[1]), -1, sequence.dtype)
        sequence = np.concatenate([none, sequence])
    count = len(who)
    out = (
        np.empty(count),
        np.empty((count, 3)),
        np.empty((count, 3)),
        np.full((count, max_order), -1, dtype=np.int32),
        np.empty((count, 3)),
    )
    slack = _SLACK * geometry.diagonal
    tables = geometry.tables
    held = validate(
        start,
        ends,
        who,
        order,
        sequence,
        (panels.normal, panels.offset, panels.face_start, panels.faces, tables.rims),
        (tables.blockers, panels.of_face, tables.planes),
        geometry.hierarchy.arrays,
        slack,
        out,
    )
    if max_length < np.inf:
        held &= out[0] <= max_length
    rows = arrange(who, held, out[0], out[4], len(ends), slack)
    faces = out[3][rows]
    surfaces = np.append(geometry.face_surface, -1).astype(np.int32)[faces]
    return Paths(
        who[rows],
        out[0][rows],
        out[1][rows],
        out[2][rows],
        order[rows],
        faces,
        surfaces,
        nodes >= 0,
    )
