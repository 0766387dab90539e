"""Tetrahedra by Mmg (Dapogny, Dobrzynski, Frey 2014, "Three-dimensional adaptive domain remeshing").

A lattice cut at the surface's signed distance gives a fine mesh without slivers; Mmg makes it as coarse
as the sizes allow and its elements better. The same surface gives the same mesh. The library runs in a
child process (`mmg_process`), so that a crash is a sentence and Ctrl-C ends it at once.
"""

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.fine_zone import FineZone
from glisson.core.mesh import TetMesh, TriangleSurface, signed_volumes
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.status import Status
from glisson.geometry.distance import SurfaceTree
from glisson.preoperative.child_process import run_child
from glisson.preoperative.meshing.lattice import body_centred_lattice, inside_of_level
from glisson.preoperative.meshing.mesh_quality import face_connected_parts

LARGEST_VOLUME_ERROR = 0.01
"""A mesh whose volume differs by more than this fraction from its surface's is refused."""

LARGEST_CRUMB = 0.001
"""Parts that hang on by an edge or a node only are dropped when smaller than this fraction of the mesh."""

_ROUNDNESS_MM = 6.0
"""Radius of curvature that the surface's triangles follow within the envelope; a liver's edge is about so round."""

_COARSE_BANDS = 2.0
"""Spacing, in bands, of the points at which distances are found first."""

_LEFT_LONGER = 1.2
"""Mmg splits an edge only where it is √2 times as long as asked: in a zone the median comes to so many times that."""

_GOOD_VOLUME_ERROR = 0.001
_ROUNDS = 4


@dataclass(frozen=True)
class MmgParameters:
    """Size and closeness of the mesh, and how long it may take."""

    edge_length_mm: float = parameter(16.0, "Longest edge aimed at inside the organ in mm.", 0.5, 100.0)
    envelope_mm: float = parameter(
        0.6, "How far the mesh may stray from the surface in mm; halving it doubles the elements.", 0.01, 10.0
    )
    time_limit_s: float = parameter(600.0, "Seconds after which Mmg is given up.", 1.0, 86400.0)


class Mmg:
    """T4 meshes by Mmg (LGPL 3, a separate library)."""

    name: ClassVar[str] = "mmg"
    summary: ClassVar[str] = "Mmg: good tetrahedra near the surface, coarse ones inside; the same mesh each time."
    Parameters: ClassVar[type[MmgParameters]] = MmgParameters

    def __init__(self, parameters: MmgParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """mmgpy, where it is not installed."""
        return () if find_spec("mmgpy") else ("mmgpy",)

    def mesh(self, surface: TriangleSurface, progress: Progress = silent, finer: Sequence[FineZone] = ()) -> TetMesh:
        """T4 mesh of the inside of a closed surface, its volume within 1 % of the surface's.

        Flat triangles cut the corners of a round body; the level that is meshed lies as much further out
        as the volume asks for.

        Raises:
            BadInput: the surface is open or encloses nothing.
            StageFailed: Mmg crashed, took too long, or gave a mesh that is not usable.
        """
        _check_surface(surface)
        progress(None, "lattice")
        nodes, lattice = self._lattice(surface)
        level = _signed_distance(surface, nodes, 2.0 * self._spacing_mm)
        area = float(surface.triangle_areas_mm2.sum())
        tried: list[tuple[float, TetMesh]] = []
        outward_mm = 0.0
        for _ in range(_ROUNDS):
            cut = _largest_part(*inside_of_level(nodes, lattice, level - outward_mm))
            mesh = _largest_part(*self._remeshed(cut, finer, progress))
            error = mesh.volume_mm3 / surface.volume_mm3 - 1.0
            tried.append((abs(error), mesh))
            if abs(error) < _GOOD_VOLUME_ERROR:
                break
            outward_mm -= error * surface.volume_mm3 / area
        error, mesh = min(tried, key=lambda made: made[0])
        if error > LARGEST_VOLUME_ERROR:
            raise StageFailed(
                f"The mesh's volume is {100.0 * error:.1f} % off its surface's; choose a smaller envelope_mm "
                f"than {self._parameters.envelope_mm:g}.",
                Status.STAGNATED,
            )
        return mesh

    @property
    def _spacing_mm(self) -> float:
        """Spacing of the lattice: a chord of this length strays from a round edge by the envelope."""
        return min(self._parameters.edge_length_mm, float(np.sqrt(8.0 * _ROUNDNESS_MM * self._parameters.envelope_mm)))

    def _lattice(self, surface: TriangleSurface) -> tuple[FloatArray, IntArray]:
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        return body_centred_lattice(low, high, self._spacing_mm)

    def _remeshed(self, mesh: TetMesh, finer: Sequence[FineZone], progress: Progress) -> tuple[FloatArray, IntArray]:
        with tempfile.TemporaryDirectory(prefix="glisson-mesh-") as folder:
            source, target = Path(folder) / "cut.npz", Path(folder) / "mesh.npz"
            np.savez(
                source,
                nodes=mesh.nodes,
                tetrahedra=mesh.tetrahedra,
                sizes_mm=_sizes(mesh.nodes, self._parameters.edge_length_mm, finer),
                shortest_mm=0.5 * min([self._spacing_mm, *map(_asked_mm, finer)]),
                envelope_mm=self._parameters.envelope_mm,
            )
            self._run(source, target, progress)
            with np.load(target) as made:
                return made["nodes"].astype(np.float64), made["tetrahedra"].astype(np.int64)

    def _run(self, source: Path, target: Path, progress: Progress) -> None:
        command = [sys.executable, "-m", "glisson.preoperative.meshing.mmg_process", str(source), str(target)]
        try:
            code, said = run_child(command, target.parent, "tetrahedra", progress, self._parameters.time_limit_s)
        except TimeoutError as error:
            raise StageFailed(f"Mmg was {error}; choose a larger envelope_mm.", Status.ITERATION_LIMIT) from None
        if code != 0 or not target.is_file():
            raise StageFailed(
                f"Mmg could not mesh the surface ({said[:200] or f'exit code {code}'}); smooth the mask or choose "
                "another envelope_mm.",
                Status.STAGNATED,
            )


def _check_surface(surface: TriangleSurface) -> None:
    if len(surface.triangles) < 4:
        raise BadInput(f"A surface of {len(surface.triangles)} triangles encloses nothing; at least four are needed.")
    if not surface.is_closed:
        raise BadInput("The surface is open or has edges with more than two triangles; close it before meshing.")
    extent = np.ptp(surface.vertices, axis=0)
    if surface.volume_mm3 <= 1e-9 * float(np.prod(np.maximum(extent, 1e-6))) or float(extent.min()) <= 0.0:
        raise BadInput(
            f"The surface encloses {surface.volume_mm3:.3g} mm³; it is flat or its triangles point inward, so turn "
            "them outward or give another surface."
        )


def _signed_distance(surface: TriangleSurface, points: FloatArray, band_mm: float) -> FloatArray:
    """Distance (n,) in mm of points (n, 3) to the surface, negative inside; beyond ±`band_mm` only roughly.

    A distance changes by no more than the way between two points, so that most points far from the surface
    are settled by a few.
    """
    tree = SurfaceTree(surface.vertices, surface.triangles)

    def exactly(places: FloatArray) -> FloatArray:
        distance = tree.nearest(places).distance_mm
        return np.where(tree.contains(places), -distance, distance)

    side = _COARSE_BANDS * band_mm
    cells, cell = np.unique(np.round(points / side), axis=0, return_inverse=True)
    coarse = exactly(cells * side)[cell]
    way = np.linalg.norm(points - cells[cell] * side, axis=1)
    near = np.abs(coarse) - way < band_mm
    coarse[near] = exactly(points[near])
    return coarse


def _sizes(nodes: FloatArray, longest_mm: float, finer: Sequence[FineZone]) -> FloatArray:
    """Edge length (n,) aimed at near each node: the shortest of the zones that it lies in."""
    sizes = np.full(len(nodes), longest_mm)
    for zone in finer:
        distance, _ = cKDTree(zone.points_mm).query(nodes)
        sizes[distance <= zone.reach_mm] = np.minimum(sizes[distance <= zone.reach_mm], _asked_mm(zone))
    return sizes


def _asked_mm(zone: FineZone) -> float:
    """What Mmg is asked for, so that edges come to the zone's length."""
    return zone.edge_length_mm / _LEFT_LONGER


def _largest_part(nodes: FloatArray, tetrahedra: IntArray) -> TetMesh:
    """The mesh without crumbs and unused nodes."""
    if len(tetrahedra) == 0:
        raise StageFailed(
            "The body is thinner than the lattice that it is meshed from; choose a smaller envelope_mm.",
            Status.STAGNATED,
        )
    volumes = signed_volumes(nodes, tetrahedra)
    count, part = face_connected_parts(tetrahedra)
    sizes = np.bincount(part, weights=volumes, minlength=count)
    largest = int(np.argmax(sizes))
    if 1.0 - sizes[largest] / sizes.sum() > LARGEST_CRUMB:
        others = ", ".join(f"{s * 1e-3:.1f}" for s in sorted(sizes, reverse=True)[:4])
        raise StageFailed(
            f"The mesh falls into {count} parts ({others} ml, the largest first); choose a smaller envelope_mm, or "
            "close the mask's gaps.",
            Status.STAGNATED,
        )
    kept = tetrahedra[part == largest]
    if float(volumes[part == largest].min()) <= 0.0:
        raise StageFailed("Mmg left flat or inverted elements; choose another envelope_mm.", Status.INVERTED)
    used, renumbered = np.unique(kept, return_inverse=True)
    return TetMesh(nodes[used], renumbered.reshape(-1, 4))
