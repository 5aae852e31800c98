"""Go on fitting a room to rows whose air, listener or places were corrected."""

from dataclasses import replace

from inverse.paths.box_fit import BoxStep, fit_room
from inverse.paths.mesh_fit import MeshStep, family_sd, fit_planes
from inverse.paths.polish import polished, without_coloring
from inverse.paths.polyhedral import FittedMesh, mesh_error, with_paths, without_bent
from inverse.paths.shoebox import FittedRoom, box_error
from inverse.rows.fitset import FitSet

__all__ = ["resumed"]

ROWS, TURNS = 40, 3
"""The start is near: a few rows and steps of a whole-band fit bring it there."""


def resumed(
    rows: FitSet,
    fitted: FittedRoom | FittedMesh,
    *,
    count: int = ROWS,
    turns: int = TURNS,
) -> FittedRoom | FittedMesh:
    """Fit walls, air, devices and pulse again, from where they stand.

    Parameters
    ----------
    rows : FitSet
        Rows as far as paths are listed.
    fitted : FittedRoom or FittedMesh
        The start.
    count : int
        Rows that are fitted, spread over the emitters' places.
    turns : int
        Steps of the fit.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the equations cannot be solved.
    """
    few = rows.spread(count)
    if isinstance(fitted, FittedMesh):
        return _mesh(few, fitted, turns)
    rest = without_coloring(few, fitted.room, fitted.coloring)
    whole = BoxStep(0.5 * rows.sample_rate, fitted.room.order, turns)
    found = fit_room(few, fitted.room, whole, rest)
    coloring, room = polished(few, found.room, fitted.coloring, 1, box_error)
    return replace(
        fitted,
        room=room,
        coloring=coloring,
        covariance=found.covariance,
        active=found.active,
    )


def _mesh(few: FitSet, fitted: FittedMesh, turns: int) -> FittedMesh:
    room = with_paths(few, fitted.room)
    if fitted.bending:
        few, _ = without_bent(few, room)
    whole = MeshStep(0.5 * few.sample_rate, room.order, turns)
    rest = without_coloring(few, room, fitted.coloring)
    found = fit_planes(few, room, whole, rest)
    coloring, room = polished(few, found.room, fitted.coloring, 1, mesh_error)
    return replace(
        fitted,
        room=room.free(),
        coloring=coloring,
        plane_sd=found.plane_sd(),
        family_sd=family_sd(found),
    )
