"""A room of flat faces, walls, air, devices and pulse; the peer of `BoxRoom`."""

from dataclasses import dataclass, replace

import numpy as np

from inverse.paths.bank import PulseBank
from inverse.paths.path_list import PathList, list_paths
from inverse.paths.polyhedron import Polyhedron
from inverse.paths.room import PathRoom, turns_of
from rir import Poses
from rir.arrays import FloatArray

__all__ = ["MeshRoom"]


@dataclass(frozen=True, eq=False)
class MeshRoom(PathRoom[Polyhedron]):
    """Render the mirror paths of a room of flat faces."""

    order: int = 12
    paths: PathList | None = None
    """Paths of the rows being fitted, kept while their geometry moves little."""

    def render(
        self,
        emitters: Poses,
        listeners: Poses,
        n_samples: int,
        bank: PulseBank | None = None,
    ) -> FloatArray:
        """Return the sum of all paths, shape (rows, n_samples)."""
        from inverse.paths.mesh_kernel import lay_paths, render_paths

        chosen = bank or self.bank
        ends = emitters.positions, listeners.positions
        paths = self.paths or self.listed(*ends, n_samples)
        count = len(paths.order)
        laid = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
        lay_paths(*ends, paths.row, paths.order, paths.walls, self.shape.planes, *laid)
        out = np.zeros((len(emitters), n_samples))
        render_paths(
            paths.row,
            paths.order,
            paths.walls,
            *laid,
            turns_of(emitters, np.eye(3)),
            turns_of(listeners, np.eye(3)),
            self.scale,
            self.latency_s * self.sample_rate,
            self.walls,
            self.emitting,
            self.listening,
            chosen.taps,
            chosen.lead,
            out,
        )
        return out

    def listed(
        self, emitters: FloatArray, listeners: FloatArray, n_samples: int
    ) -> PathList:
        """Return the paths of rows that arrive within so many samples."""
        reach = self.reach(n_samples)
        return list_paths(self.shape, emitters, listeners, self.order, reach)

    def holding(self, emitters: Poses, listeners: Poses, n_samples: int) -> "MeshRoom":
        """Return the room with the paths of these rows kept."""
        paths = self.listed(emitters.positions, listeners.positions, n_samples)
        return replace(self, paths=paths)

    def free(self) -> "MeshRoom":
        """Return the room that looks for the paths of any rows."""
        return replace(self, paths=None)
