"""Make triangles fit for tracing, and tell what had to be done."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rir.arrays import FloatArray, IntArray
from rir.errors import SceneError

__all__ = ["Cleaned", "clean"]


@dataclass(eq=False)
class Cleaned:
    """Triangles after cleaning."""

    vertices: FloatArray
    """Corners [m]. Shape (V, 3)."""
    faces: IntArray
    """Vertex indices; normals point into the air where that is defined. Shape (F,
    3)."""
    kept: IntArray
    """Index of each triangle before cleaning. Shape (F,)."""
    watertight: bool = True
    """Whether the triangles enclose the air."""
    report: list[str] = field(default_factory=list)
    """What was repaired, and what was left open."""


def clean(vertices: FloatArray, faces: IntArray, tolerance: float) -> Cleaned:
    """Merge vertices, drop useless triangles and turn normals into the air.

    Parameters
    ----------
    vertices : ndarray, shape (V, 3)
        Corners [m].
    faces : ndarray, shape (F, 3)
        Vertex indices.
    tolerance : float
        Distance below which vertices are one [m].

    Raises
    ------
    SceneError
        If no triangle with an area is left.
    """
    mesh = Cleaned(vertices, faces, np.arange(len(faces)))
    _merge_vertices(mesh, tolerance)
    _drop_degenerate(mesh, tolerance)
    _drop_duplicates(mesh)
    if len(mesh.faces) == 0:
        raise SceneError(
            f"none of the {len(faces)} triangles has an area; a room needs surfaces"
        )
    _orient(mesh)
    return mesh


def _keep(mesh: Cleaned, mask: NDArray[np.bool_], message: str) -> None:
    dropped = int(len(mask) - mask.sum())
    if dropped:
        mesh.faces, mesh.kept = mesh.faces[mask], mesh.kept[mask]
        mesh.report.append(f"dropped {dropped} {message}")


def _merge_vertices(mesh: Cleaned, tolerance: float) -> None:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    count = len(mesh.vertices)
    pairs = KDTree(mesh.vertices).query_pairs(tolerance, output_type="ndarray")
    if len(pairs) == 0:
        return
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    _, label = connected_components(links, directed=False)
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    apart = np.linalg.norm(
        mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1
    )
    cracks = int(np.count_nonzero(apart > 0))
    mesh.vertices, mesh.faces = mesh.vertices[first], inverse[mesh.faces]
    if cracks:
        mesh.report.append(f"closed {cracks} cracks up to {apart.max():.2g} m wide")


def _drop_degenerate(mesh: Cleaned, tolerance: float) -> None:
    corners = mesh.vertices[mesh.faces]
    sides = np.roll(corners, -1, axis=1) - corners
    double_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = np.linalg.norm(sides, axis=2).max(axis=1)
    # the height over the longest side tells a sliver from a small triangle
    _keep(mesh, double_area > tolerance * longest, "triangles without an area")


def _drop_duplicates(mesh: Cleaned) -> None:
    _, first = np.unique(np.sort(mesh.faces, axis=1), axis=0, return_index=True)
    mask = np.zeros(len(mesh.faces), dtype=bool)
    mask[first] = True
    _keep(mesh, mask, "triangles that stood twice")


def edge_table(faces: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return half-edges sorted by edge: (edge id, face, sense ±1) per half-edge."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    sense = np.where(ends[:, 0] < ends[:, 1], 1, -1)
    _, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    face = np.tile(np.arange(len(faces)), 3)
    order = np.argsort(edge, kind="stable")
    return edge.ravel()[order], face[order], sense[order]


def _orient(mesh: Cleaned) -> None:
    edge, face, sense = edge_table(mesh.faces)
    count = np.bincount(edge)
    open_edges = int(np.count_nonzero(count % 2))
    if open_edges:
        mesh.report.append(f"left {open_edges} open edges as they are")
    crowded = int(np.count_nonzero(count > 2))
    if crowded:
        mesh.report.append(f"{crowded} edges join more than two triangles")
    parts = _wind(mesh, edge, face, sense, count)
    if open_edges == 0:
        _face_the_air(mesh, parts)
    edge, _, sense = edge_table(mesh.faces)
    balanced = bool(np.all(np.bincount(edge, sense) == 0))
    mesh.watertight = open_edges == 0 and balanced


def _wind(
    mesh: Cleaned, edge: IntArray, face: IntArray, sense: IntArray, count: IntArray
) -> IntArray:
    """Give neighbours the same winding; return the part each triangle belongs to."""
    first = np.searchsorted(edge, np.nonzero(count == 2)[0])
    left, right = face[first], face[first + 1]
    agree = sense[first] != sense[first + 1]
    near: list[list[tuple[int, bool]]] = [[] for _ in mesh.faces]
    for a, b, same in zip(left.tolist(), right.tolist(), agree.tolist(), strict=True):
        near[a].append((b, same))
        near[b].append((a, same))
    part = np.full(len(mesh.faces), -1)
    flip = np.zeros(len(mesh.faces), dtype=bool)
    for seed in range(len(part)):
        if part[seed] >= 0:
            continue
        part[seed], stack = seed, [seed]
        while stack:
            here = stack.pop()
            for other, same in near[here]:
                if part[other] < 0:
                    part[other], flip[other] = seed, flip[here] == same
                    stack.append(other)
    _flip(mesh, flip, "turned {} triangles to match their neighbours")
    return part


def _flip(mesh: Cleaned, mask: NDArray[np.bool_], message: str) -> None:
    if mask.any():
        mesh.faces[mask] = mesh.faces[mask][:, ::-1]
        mesh.report.append(message.format(int(mask.sum())))


def _face_the_air(mesh: Cleaned, part: IntArray) -> None:
    """Turn closed parts: the air is where an odd number of them encloses a point."""
    names = np.unique(part)
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    wrong = np.zeros(len(part), dtype=bool)
    for name in names:
        own = np.nonzero(part == name)[0]
        face = own[np.argmax(np.linalg.norm(normals[own], axis=1))]
        normal = normals[face] / np.linalg.norm(normals[face])
        size = np.sqrt(np.linalg.norm(normals[face]))
        probe = corners[face].mean(axis=0) + 1e-4 * size * normal
        around = [winding(corners[part == other], probe[None])[0] for other in names]
        wrong[own] = np.count_nonzero(np.abs(around) > 0.5) % 2 == 0
    mesh.faces[wrong] = mesh.faces[wrong][:, ::-1]


def winding(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Return how often triangles (F, 3, 3) surround each of the points (N, 3).

    References
    ----------
    A. van Oosterom, J. Strackee, IEEE Trans. Biomed. Eng. 30, 125 (1983): solid
    angle of a triangle.
    """
    around = np.empty(len(points))
    for index, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a)))
        around[index] = np.arctan2(
            volume, la * lb * lc + ab * lc + bc * la + ca * lb
        ).sum()
    return around / (2 * np.pi)
