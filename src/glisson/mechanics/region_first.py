"""Takes the part of the organ that moves through the load steps, and the whole organ only to where they end."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import degrees

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.mechanics.body import LoadState
from glisson.mechanics.cut_region import CutRegion, cut_out
from glisson.mechanics.linear_solvers import make_iterative_solver
from glisson.mechanics.load_path import History, LoadPath
from glisson.mechanics.newton import Newton, NewtonEnd

Way = Sequence[tuple[float, FloatArray]]
"""Shares of the way to a goal, ascending to 1, with what is known of the nodes (n, 3) there."""

_FIRST_REACH = 0.2  # before it a tool only just comes to bear: many steps for little motion
_LOOSEST = 1e-3  # residual of the load steps of the region; their ends are exact
_MOST = 0.7  # of the elements: a region that large saves nothing
_MARGIN = 0.1  # of the cushion: the whole organ's equilibrium presses somewhat harder
_ERROR_SHARE = 0.02  # of a correction that stays as an error; found on members of the family that no figure is told of


class RegionFirst:
    """A `Carrier`.

    On the way the cut goes along as the survey says. At the end the whole organ comes to a rough equilibrium from
    there, and then the region to an exact one within it.

    Args:
        ways: for the stage's name and the number of the goal in the stage, displacements from the scanned shape in
            mm that are roughly known (from linear elements); none for goals in which nothing moves by itself.
        still_mm: displacement up to which a part is cut off.
    """

    def __init__(self, ways: Mapping[tuple[str, int], Way], still_mm: float) -> None:
        self._ways, self._still = ways, still_mm
        self._done: list[str] = []
        self._surveyed: FloatArray | None = None
        self._farthest: FloatArray | None = None
        self.estimated_error: FloatArray | None = None

    def carry(self, path: LoadPath, goal: LoadState) -> NewtonEnd:
        """Take the path's body there; as a whole where the region finds no equilibrium or is nearly all of it."""
        nodes = path.body.elasticity.mesh.nodes
        if self._surveyed is None or self._farthest is None or self.estimated_error is None:
            self._surveyed = np.zeros_like(nodes)
            self._farthest = self.estimated_error = np.zeros(len(nodes))
        stage = path.history.stage
        way = self._ways.get((stage, self._done.count(stage)), ())
        self._done.append(stage)
        before = self._surveyed
        if way:
            self._surveyed = way[-1][1]
            self._farthest = np.maximum(self._farthest, np.linalg.norm(self._surveyed, axis=1))
        far: NDArray[np.bool_] = self._farthest > self._still
        moving = np.any(far[path.body.elasticity.mesh.tetrahedra], axis=1)
        if not 0.0 < moving.mean() < _MOST:
            return path.ramp(goal)
        memory, start, positions = path.body.memory(), path.body.loading, path.positions
        region = cut_out(path.body, moving, positions)
        settings = replace(path.newton.settings, tolerance=max(path.newton.settings.tolerance, _LOOSEST))
        newton = Newton(region.body, make_iterative_solver(), settings)
        try:
            inner, ahead = _path_within(path, region, newton), [(reach, known - before) for reach, known in way]
            end = self._through(inner, region, path, goal, ahead)
        finally:
            newton.close()
        if end.status is Status.CONVERGED:
            return end
        path.body.recall(memory)
        path.body.loading, path.positions = start, positions
        return path.ramp(goal)

    def _through(self, inner: LoadPath, region: CutRegion, path: LoadPath, goal: LoadState, way: Way) -> NewtonEnd:
        """Follow the survey's way in the region, and settle first the whole organ, then the region."""
        start, met = path.body.loading, np.zeros_like(path.positions)
        for reach, known in _stations(way):
            predicted = inner.positions + (known - met)[region.nodes]
            end = inner.follow(region.goal(start.towards(goal, reach), known), predicted, reach)
            if end.status is not Status.CONVERGED:
                return end
            met = known
        end = inner.without_penetration(_MARGIN) if way else inner.ramp(region.goal(goal, met))
        if end.status is not Status.CONVERGED:
            return end
        composite = path.positions + met
        composite[region.nodes] = inner.positions
        region.lead(path.body)
        end = path.settle(goal, composite)
        if end.status is Status.CONVERGED:
            end = _settled_within(region, path)
        if end.status is Status.CONVERGED:
            correction = np.linalg.norm(path.positions - composite, axis=1)
            self.estimated_error = self.estimated_error + _ERROR_SHARE * correction
            path.history.extend(inner.history)
            path.note(1.0, end)
        return end


def _stations(way: Way) -> Way:
    """Of each share of the way the last that is known, from where tools bear well."""
    return [(reach, known) for reach, known in dict(way).items() if reach >= _FIRST_REACH]


def _path_within(path: LoadPath, region: CutRegion, newton: Newton) -> LoadPath:
    """A path for the region from where the whole organ is."""
    history = History(path.history.stage, bearing=set(path.history.bearing))
    return LoadPath(region.body, newton, path.positions[region.nodes], degrees(path.step_rad), history, path.progress)


def _settled_within(region: CutRegion, path: LoadPath) -> NewtonEnd:
    """Exact equilibrium of the region, the others' nodes staying where they are; with positions of all."""
    region.follow(path.body, path.positions)
    newton = Newton(region.body, make_iterative_solver(), path.newton.settings)
    inner = _path_within(path, region, newton)
    try:
        end = inner.equilibrium(inner.positions)
    finally:
        newton.close()
    if end.status is Status.CONVERGED:
        region.body.accept(end.positions)
        region.lead(path.body)
        path.positions = path.positions.copy()
        path.positions[region.nodes] = end.positions
    return replace(end, positions=path.positions)
