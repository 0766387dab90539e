"""Whether this installation works: what `glisson doctor` looks at."""

import platform
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import requires
from itertools import permutations
from pathlib import Path

import numpy as np

from glisson.core.mesh import TetMesh, signed_volumes
from glisson.core.model import Material, Model
from glisson.core.registry import list_techniques, make_technique
from glisson.core.scenario import ContactLaw, Scenario, Stage
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3
from glisson.framework.hashing import package_version

_LEAST_FREE_GB = 2.0


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at; Glisson works without what is not `needed`."""

    name: str
    is_good: bool
    detail: str
    needed: bool = True


def check_installation(folder: Path) -> Iterator[Finding]:
    """All findings, one after the other; `folder` is where cases would be written."""
    yield _python()
    yield from _packages()
    yield from _techniques()
    yield _mkl()
    yield _dask()
    yield _threads()
    yield _calculix()
    yield _disk(folder)
    yield _guarded("self-check solve", _column_under_its_weight)


def _python() -> Finding:
    detail = f"{platform.python_version()} on {platform.platform(terse=True)}"
    return Finding("Python", sys.version_info >= (3, 11), detail)


def _packages() -> Iterator[Finding]:
    for requirement in requires("glisson") or []:
        name = re.match(r"[A-Za-z0-9._-]+", requirement)
        if name is None or "extra ==" in requirement:
            continue
        version = package_version(name[0])
        yield Finding(name[0], version is not None, version or "not installed; run: pip install glisson")


def _techniques() -> Iterator[Finding]:
    for listing in list_techniques():
        ours = listing.package == "glisson"
        trouble = listing.broken or (f"needs {', '.join(listing.missing)}" if listing.missing else "")
        where = "" if ours else f" (of {listing.package})"
        # What Glisson itself needs is among the packages; techniques that bring in another program are extras.
        needed = ours and not listing.missing
        yield Finding(f"{listing.kind} {listing.name}", not trouble, (trouble or "ready") + where, needed=needed)


def _mkl() -> Finding:
    version = package_version("mkl")
    detail = version or "absent: solves take longer; install with: pip install glisson[mkl]"
    return Finding("MKL", version is not None, detail, needed=False)


def _dask() -> Finding:
    version = package_version("distributed")
    detail = version or "absent: only studies on a cluster need it; install with: pip install glisson[dask]"
    return Finding("Dask", version is not None, detail, needed=False)


def _threads() -> Finding:
    def count() -> str:
        import numba

        return str(numba.get_num_threads())

    return _guarded("numba threads", count)


def _calculix() -> Finding:
    path = shutil.which("ccx")
    detail = path or "absent: only scripts that compute reference solutions need it"
    return Finding("CalculiX (ccx)", path is not None, detail, needed=False)


def _disk(folder: Path) -> Finding:
    free = shutil.disk_usage(folder).free / 1e9
    advice = "" if free >= _LEAST_FREE_GB else f"; a case may need {_LEAST_FREE_GB:.0f} GB, free some space"
    return Finding("free disk", free >= _LEAST_FREE_GB, f"{free:.0f} GB at {folder}{advice}")


def _guarded(name: str, check: Callable[[], str]) -> Finding:
    try:
        return Finding(name, True, check())
    except Exception as error:  # whatever is broken is what people ask the doctor about
        return Finding(name, False, " ".join(f"{type(error).__name__}: {error}".split()))


def _column_under_its_weight() -> str:
    """A column with ν = 0 that hangs from its top gets longer by ρ g L² / (2 E)."""
    length, material = 40.0, Material("linear-elastic", 1000.0, 0.0, 1000.0)
    model = _column(length, material)
    down = np.array([0.0, 0.0, -1.0])
    hang = Stage("hang", ContactLaw(), fixed=("top",))
    solver = make_technique("solver", "quasi-static", {}, "the self-check")
    solved = solver.solve(model, Scenario((), (hang,), surgery_gravity=down, rest_shape="as-scanned"))
    found = -float(solved.displacement[: len(model.mesh.nodes)][model.node_set("bottom"), 2].mean())
    weight_mn_mm3 = density_from_kg_m3(material.density_kg_m3) * STANDARD_GRAVITY_MM_S2
    expected = weight_mn_mm3 * length**2 / (2.0 * material.young_modulus_kpa)
    if not solved.status.is_good or abs(found / expected - 1.0) > 1e-4:
        raise ArithmeticError(f"a hanging column grew by {found:.6f} mm, not {expected:.6f} mm ({solved.message})")
    return f"a hanging column grows by {found:.6f} mm, as it must"


def _column(length: float, material: Material) -> Model:
    """A square column of four cubes along z, each cut into the six tetrahedra between two opposite corners."""
    nodes = length / 4.0 * np.array([(i, j, k) for k in range(5) for j in (0, 1) for i in (0, 1)], dtype=float)
    paths = np.array([(0, a, a + b, 7) for a, b, _ in permutations((1, 2, 4))])
    cells = np.concatenate([paths + 4 * layer for layer in range(4)])
    turned = signed_volumes(nodes, cells) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    sets = {"top": np.arange(16, 20), "bottom": np.arange(4)}
    return Model(TetMesh(nodes, cells), {0: material}, {0: "column"}, sets)
