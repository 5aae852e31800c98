"""Edge diffraction by the uniform theory (UTD)."""

from rooms.diffraction.edges import Edges, edges_of, find_edges
from rooms.diffraction.paths import DiffractedPaths, diffracted_paths

__all__ = ["DiffractedPaths", "Edges", "diffracted_paths", "edges_of", "find_edges"]
