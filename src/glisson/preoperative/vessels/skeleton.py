"""The skeleton of a vessel mask as pieces that meet at sites; loops stay, since two vessels that touch make some.

Voxels of the skeleton with more than two neighbours are sites, runs of the others are pieces. A site is as wide as
the vessels that meet there: where two of them cross, thinning leaves two sites with a short run between them, which
become one. Long runs are parted, so that what belongs to one system may end within a run.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.image import Grid
from glisson.preoperative.vessels.centrelines import skeleton_points, touching_voxels

_SPUR = 1.5
"""A run with a free end that is shorter than this many radii of the vessel that it leaves is a spur of the thinning."""

_WIDTH = 0.5
"""Sites nearer to each other than this many radii are one."""

_PIECE_MM = 5.0
_DIRECTION_MM = 8.0
FREE = -1


@dataclass(frozen=True, eq=False)
class Piece:
    """A run of centreline without branchings.

    `points_mm` (n, 3) in order with `radii_mm` (n,), `sites` the number of the site at its first and its
    last point (`FREE`: none), `inward` (2, 3) unit vectors from each end into the piece.
    """

    points_mm: FloatArray
    radii_mm: FloatArray
    sites: tuple[int, int]
    inward: FloatArray

    @cached_property
    def radius_mm(self) -> float:
        """Median radius."""
        return float(np.median(self.radii_mm))

    @property
    def length_mm(self) -> float:
        """Length of the run."""
        return float(np.linalg.norm(np.diff(self.points_mm, axis=0), axis=1).sum())


@dataclass(frozen=True, eq=False)
class _Run:
    points: FloatArray
    radii: FloatArray
    sites: tuple[int, int]


def skeleton_pieces(mask: NDArray[np.bool_], grid: Grid) -> tuple[Piece, ...]:
    """The pieces of a mask's skeleton [i, j, k]; empty where there is nothing to thin."""
    points, radii = skeleton_points(mask, grid)
    if len(points) < 2:
        return ()
    upper = touching_voxels(points, grid)
    graph = csr_array(upper + upper.T)
    meeting = np.diff(graph.indptr) > 2
    site = np.full(len(points), FREE, dtype=np.int64)
    count, site[meeting] = connected_components(graph[meeting][:, meeting], directed=False)
    runs = _runs(points, radii, graph, site)
    widths = np.zeros(count)
    np.maximum.at(widths, site[meeting], radii[meeting])
    centres = np.zeros((count, 3))
    np.add.at(centres, site[meeting], points[meeting])
    centres /= np.maximum(np.bincount(site[meeting], minlength=count), 1)[:, None]
    pieces: list[Piece] = []
    free = count
    for run in _joined([run for run in runs if not _is_spur(run, widths)], centres, widths):
        parts = _parted(run, free)
        free += len(parts) - 1
        pieces += parts
    return tuple(pieces)


def _runs(points: FloatArray, radii: FloatArray, graph: csr_array, site: IntArray) -> list[_Run]:
    plain = np.flatnonzero(site == FREE)
    inner = csr_array(graph[plain][:, plain])
    count, number = connected_components(inner, directed=False)
    order = np.argsort(number, kind="stable")
    runs = []
    for members in np.split(order, np.flatnonzero(np.diff(number[order])) + 1) if count else []:
        own = csr_array(inner[members][:, members])
        ends = np.flatnonzero(np.diff(own.indptr) <= 1)
        along, _ = breadth_first_order(own, int(ends[0]) if len(ends) else 0, directed=False)
        voxels = plain[members[along]]
        runs.append(_Run(points[voxels], radii[voxels], _sites_at_ends(voxels, graph, site)))
    return runs


def _sites_at_ends(voxels: IntArray, graph: csr_array, site: IntArray) -> tuple[int, int]:
    first, last = (
        [int(s) for s in np.unique(site[graph.indices[graph.indptr[v] : graph.indptr[v + 1]]]) if s != FREE]
        for v in (voxels[0], voxels[-1])
    )
    if len(voxels) == 1:
        both = [*first, FREE, FREE]
        return both[0], both[1]
    return (first or [FREE])[0], (last or [FREE])[0]


def _length(run: _Run) -> float:
    return float(np.linalg.norm(np.diff(run.points, axis=0), axis=1).sum())


def _is_spur(run: _Run, widths: FloatArray) -> bool:
    reached = [site for site in run.sites if site != FREE]
    if not reached:
        return len(run.points) < 2
    return len(reached) == 1 and _length(run) < _SPUR * float(widths[reached[0]])


def _joined(runs: list[_Run], centres: FloatArray, widths: FloatArray) -> list[_Run]:
    """The runs without short ones between two sites, which become one site while it is no wider than a vessel."""
    joined = np.arange(len(widths))
    kept = []
    for run in sorted(runs, key=_length):
        if FREE in run.sites:
            kept.append(run)
            continue
        members = np.isin(joined, joined[list(run.sites)])
        across = float(np.linalg.norm(np.ptp(centres[members], axis=0)))
        if max(_length(run), 0.5 * across) < _WIDTH * float(widths[members].max()):
            joined[members] = joined[run.sites[0]]
        else:
            kept.append(run)

    def now(site: int) -> int:
        return FREE if site == FREE else int(joined[site])

    return [_Run(run.points, run.radii, (now(run.sites[0]), now(run.sites[1]))) for run in kept]


def _parted(run: _Run, next_site: int) -> list[Piece]:
    """A run in pieces of some millimetres, which meet at sites numbered from `next_site` on."""
    points = _evened(run.points)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(min(int(along[-1] // _PIECE_MM), len(points) // 2), 1)
    cuts = np.searchsorted(along, np.linspace(0.0, along[-1], count + 1)[1:-1])
    bounds = [0, *np.unique(np.clip(cuts, 2, max(len(points) - 2, 2))).tolist(), len(points)]
    bounds = [b for n, b in enumerate(bounds) if n == 0 or b > bounds[n - 1]]
    sites = [run.sites[0], *range(next_site, next_site + len(bounds) - 2), run.sites[1]]
    pieces = []
    for n, (start, stop) in enumerate(pairwise(bounds)):
        inward = np.stack([_direction(points, along, start, 1, run), _direction(points, along, stop - 1, -1, run)])
        pieces.append(Piece(points[start:stop], run.radii[start:stop], (sites[n], sites[n + 1]), inward))
    return pieces


def _direction(points: FloatArray, along: FloatArray, at: int, sense: int, run: _Run) -> FloatArray:
    """Unit vector (3,) along a run from one of its points; the bend within a site that it starts from is left out."""
    is_end = at in (0, len(points) - 1)
    skipped = min(float(np.median(run.radii)), 0.3 * along[-1]) if is_end else 0.0
    near, far = (int(np.abs(along - (along[at] + sense * d)).argmin()) for d in (skipped, skipped + _DIRECTION_MM))
    way = points[far] - points[near]
    length = float(np.linalg.norm(way))
    direction: FloatArray = way / max(length, 1e-12)
    return direction


def _evened(points: FloatArray) -> FloatArray:
    """Voxel steps evened out; the ends stay."""
    for _ in range(3):
        if len(points) > 2:
            points = np.vstack([points[:1], 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:], points[-1:]])
    return points
