"""Tetrahedra by fTetWild (Hu, Schneider, Wang, Zorin, Panozzo 2020, "Fast tetrahedral meshing in the wild").

It takes any triangle surface and keeps within an envelope around it. The library runs in a child
process (`ftetwild_process`), so that what it prints is kept off stdout, a crash is a sentence and
Ctrl-C ends it at once. The library seeds itself from the machine's entropy, even with one thread, so
the same surface gives a slightly different mesh each time; a case keeps the mesh it was solved on.
"""

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.mesh import TetMesh, TriangleSurface, signed_volumes
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.status import Status
from glisson.preoperative.mesh_quality import face_connected_parts

LARGEST_VOLUME_ERROR = 0.01
"""A mesh whose volume differs by more than this fraction from its surface's is refused."""

LARGEST_CRUMB = 0.001
"""Parts that hang on by an edge or a node only are dropped when smaller than this fraction of the mesh."""


@dataclass(frozen=True)
class FTetWildParameters:
    """Size and closeness of the mesh, and how long it may take."""

    edge_length_mm: float = parameter(16.0, "Edge length aimed at inside the organ in mm.", 0.5, 100.0)
    envelope_mm: float = parameter(
        0.6, "How far the mesh may stray from the surface in mm; halving it doubles the elements.", 0.01, 10.0
    )
    stop_energy: float = parameter(10.0, "Conformal AMIPS energy at which optimisation stops (3 is ideal).", 3.0, 1e3)
    time_limit_s: float = parameter(600.0, "Seconds after which meshing is given up.", 1.0, 86400.0)


class FTetWild:
    """T4 meshes by fTetWild (MPL 2.0)."""

    name: ClassVar[str] = "ftetwild"
    summary: ClassVar[str] = "fTetWild: robust tetrahedra within an envelope of the surface."
    Parameters: ClassVar[type[FTetWildParameters]] = FTetWildParameters

    def __init__(self, parameters: FTetWildParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """pytetwild, where it is not installed."""
        return () if find_spec("pytetwild") else ("pytetwild",)

    def mesh(self, surface: TriangleSurface, progress: Progress = silent) -> TetMesh:
        """T4 mesh of the inside of a closed surface, its volume within 1 % of the surface's.

        Raises:
            BadInput: the surface is open or encloses nothing.
            StageFailed: fTetWild crashed, took too long, or gave a mesh that is not usable.
        """
        _check_surface(surface)
        nodes, tetrahedra = self._run(surface, progress)
        mesh = _largest_part(nodes, tetrahedra)
        error = mesh.volume_mm3 / surface.volume_mm3 - 1.0
        if abs(error) > LARGEST_VOLUME_ERROR:
            raise StageFailed(
                f"The mesh's volume is {100.0 * error:+.1f} % off its surface's; choose a smaller envelope_mm "
                f"than {self._parameters.envelope_mm:g}.",
                Status.STAGNATED,
            )
        return mesh

    def _run(self, surface: TriangleSurface, progress: Progress) -> tuple[FloatArray, IntArray]:
        diagonal = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
        with tempfile.TemporaryDirectory(prefix="glisson-mesh-") as folder:
            source, target = Path(folder) / "surface.npz", Path(folder) / "mesh.npz"
            np.savez(
                source,
                vertices=surface.vertices,
                triangles=surface.triangles,
                edge_length_mm=self._parameters.edge_length_mm,
                epsilon=self._parameters.envelope_mm / diagonal,
                stop_energy=self._parameters.stop_energy,
            )
            self._wait(source, target, progress)
            with np.load(target) as made:
                return made["nodes"].astype(np.float64), made["tetrahedra"].astype(np.int64)

    def _wait(self, source: Path, target: Path, progress: Progress) -> None:
        """Run the child to its end; it is killed when this process is interrupted."""
        log_path = target.with_name("log.txt")
        command = [sys.executable, "-m", "glisson.preoperative.ftetwild_process", str(source), str(target)]
        start = time.monotonic()
        # The library leaves a file of its own in the folder where it runs.
        with (
            log_path.open("wb") as log,
            subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=target.parent) as child,
        ):
            try:
                while child.poll() is None:
                    seconds = time.monotonic() - start
                    if seconds > self._parameters.time_limit_s:
                        raise StageFailed(
                            f"fTetWild was given up after {seconds:.0f} s; choose a larger envelope_mm.",
                            Status.ITERATION_LIMIT,
                        )
                    progress(None, f"tetrahedra, {seconds:.0f} s")
                    time.sleep(0.1)
            finally:
                child.kill()
        if child.returncode != 0 or not target.is_file():
            raise StageFailed(_crash_sentence(child.returncode, log_path), Status.STAGNATED)


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


def _crash_sentence(code: int, log_path: Path) -> str:
    lines = log_path.read_text(errors="replace").strip().splitlines()
    reason = lines[-1].strip()[:200] if lines else f"exit code {code}"
    return f"fTetWild could not mesh the surface ({reason}); smooth the mask or choose a larger edge_length_mm."


def _largest_part(nodes: FloatArray, tetrahedra: IntArray) -> TetMesh:
    """The mesh with positive orientation, without crumbs and unused nodes."""
    if len(tetrahedra) == 0:
        raise StageFailed("fTetWild found no inside; check that the surface is closed.", Status.STAGNATED)
    volumes = signed_volumes(nodes, tetrahedra)
    if volumes.sum() < 0.0:  # fTetWild numbers its corners the other way round
        tetrahedra, volumes = tetrahedra[:, [0, 2, 1, 3]], -volumes
    count, part = face_connected_parts(tetrahedra)
    sizes = np.bincount(part, weights=volumes, minlength=count)
    largest = int(np.argmax(sizes))
    if 1.0 - sizes[largest] / sizes.sum() > LARGEST_CRUMB:
        others = ", ".join(f"{s * 1e-3:.1f}" for s in sorted(sizes, reverse=True)[:4])
        raise StageFailed(
            f"The mesh falls into {count} parts ({others} ml, the largest first); close the mask's gaps or keep one.",
            Status.STAGNATED,
        )
    kept = tetrahedra[part == largest]
    if float(volumes[part == largest].min()) <= 0.0:
        raise StageFailed("fTetWild left flat or inverted elements; choose a larger envelope_mm.", Status.INVERTED)
    used, renumbered = np.unique(kept, return_inverse=True)
    return TetMesh(nodes[used], renumbered.reshape(-1, 4))
