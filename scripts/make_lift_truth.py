"""Make the deformed truth of a lever lift with CalculiX, and ship it with the package.

The procedural rest shape is meshed (C3D10), loaded by gravity on the board (rest → A), lifted by the lever
with sticky contact (A → B', stage 1) and left to settle under plain Coulomb friction (B' → B, stage 2).
Contact is CalculiX's own face-to-face penalty with friction. What differs on purpose from the model that
the demo solves: engine, element, mesh, parenchyma that varies by ±15 %, a tumour three times as stiff, an
attachment of another extent. CalculiX has no cohesion; see `glisson.phantom.calculix.lift_deck`.

    .venv/bin/python scripts/make_lift_truth.py demo --work /tmp/truth

A truth is named, with its seed and its parameters, in `glisson.phantom.lift_truths`. The mesh is kept in the
work folder.

Debian's `ccx` 2.20 (SPOOLES, one thread) takes 6 to 8 s an iteration with edges of 18 mm, an hour or so a truth, and
increments of `LiftSettings`' own sizes. The unseen truths, with edges of 24 mm (700: 22 mm), are of the same source
built with MKL's PARDISO, the ordering kept as long as the matrix has the same structure: 150 to 230 iterations of some
1.3 s, 4 to 8 minutes a truth. Two places of CalculiX were repaired for them, and the larger increments of `--repaired`
need that. `plane_eq.f` carries the state of contact over to the next increment's points and divides by zero where
three of the old ones lie in a line, so that the matrix is singular; it takes the nearest one's state. `nonlingeo.c`
begins a step with an iteration that is linear (`ilin`), also in contact, which throws a lifted organ off; with contact
it begins as in any other increment. A block lifted and settled in nine steps ends at the same displacements as with
Debian's `ccx` to 1e-5 mm.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.tools import Board, Lever
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3, radians
from glisson.phantom.calculix.lift_deck import LiftOrgan, LiftSettings, LiftSteps, with_middles, write_lift_deck
from glisson.phantom.calculix.results import read_frd, run_calculix
from glisson.phantom.calculix.rigid_bodies import lever_mesh
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.heterogeneity import VARIATION, Contains, uneven_moduli
from glisson.phantom.implicit import Solid
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.lift_truths import LIFT_TRUTHS, LiftTruth, lift_truth
from glisson.phantom.scan import Anatomy
from glisson.phantom.solid_surface import solid_surface
from glisson.phantom.truth import write_truth
from glisson.phantom.truth_checks import (
    gap_to_lever,
    height_over_board,
    smallest_jacobian,
    surface_nodes,
    tumour_motion,
)
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.model.attachments import DirectionAttachment, node_sets

DENSITY_KG_M3 = 1150.0
ATTACHMENT = DirectionAttachment(reach=0.25, left_limit=0.5)
"""The models under test take 0.3 and 0.55."""


def rest_mesh(anatomy: Anatomy, edge_mm: float, folder: Path) -> TetMesh:
    """T10 mesh of the rest shape, kept in `folder`."""
    kept = folder / f"mesh{edge_mm:g}.npz"
    if not kept.is_file():
        surface = solid_surface(anatomy.shape.liver, 2.5)
        mesh = Mmg(MmgParameters(edge_length_mm=edge_mm, envelope_mm=edge_mm / 30.0)).mesh(surface)
        np.savez(kept, nodes=mesh.nodes.astype(np.float32), tetrahedra=mesh.tetrahedra)
        say(f"surface {surface.volume_mm3 * 1e-3:.1f} ml, mesh {mesh.volume_mm3 * 1e-3:.1f} ml")
    with np.load(kept) as stored:
        return TetMesh(stored["nodes"].astype(np.float32), stored["tetrahedra"]).as_quadratic()


def young_moduli(mesh: TetMesh, anatomy: Anatomy, modulus_kpa: float) -> FloatArray:
    """Young's modulus (m,) in kPa: uneven parenchyma, and the tumours by the part of each element they fill."""

    def contains(solid: Solid) -> Contains:
        return lambda points: solid.distance(points) < 0.0

    return uneven_moduli(mesh, modulus_kpa, [contains(tumour.solid) for tumour in anatomy.interior.tumours])


def settings_of(truth: LiftTruth, repaired: bool) -> LiftSettings:
    """Contact some 8 times as stiff per mm as the tissue, and the steps of the manoeuvre."""
    normal = 60.0 / 7.0 * truth.young_modulus_kpa
    settings = LiftSettings(truth.angle_deg, truth.friction, normal_kpa_mm=normal, tangent_kpa_mm=0.2 * normal)
    return replace(settings, step_deg=8.0, largest_deg=4.0, settling_part=1.0) if repaired else settings


def weights_of(mesh: TetMesh) -> FloatArray:
    """Consistent nodal loads (N,) of gravity on straight T10 elements, mN: −1/20 a corner, 1/5 a middle."""
    loads = np.zeros(len(mesh.nodes))
    own = mesh.corner_volumes_mm3 * density_from_kg_m3(DENSITY_KG_M3) * STANDARD_GRAVITY_MM_S2
    np.add.at(loads, mesh.corners, -own[:, None] / 20.0)
    np.add.at(loads, mesh.tetrahedra[:, 4:], own[:, None] / 5.0)
    return loads


def report_balance(forces: FloatArray, mesh: TetMesh, held: IntArray, bar_nodes: int, name: str) -> None:
    """Say what is left over at the free nodes, and who carries the organ's weight.

    `forces` (n, 3) are CalculiX's nodal forces in mN: the organ's nodes, the board's, the lever's.
    """
    count = len(mesh.nodes)
    rest = forces[:count] - np.outer(weights_of(mesh), [0.0, 1.0, 0.0])
    free = np.ones(count, dtype=bool)
    free[held] = False
    left = np.linalg.norm(rest[free], axis=1).max()
    on_lever = forces[-bar_nodes:].sum(axis=0) * 1e-3
    on_board = forces[count:-bar_nodes].sum(axis=0) * 1e-3
    on_back = rest[held].sum(axis=0) * 1e-3
    total = weights_of(mesh).sum() * 1e-3
    say(
        f"{name}: largest force left over {left:.2g} mN (weight {total:.2f} N); from the lever {on_lever.round(3)} N, "
        f"the board {on_board.round(3)} N, the back {on_back.round(3)} N"
    )


def export(
    work: Path, truth: LiftTruth, organ: LiftOrgan, lever: Lever, steps: LiftSteps, settings: LiftSettings
) -> None:
    """Report the forces' balance and write the package's truth from CalculiX's results."""
    mesh = organ.mesh
    results = work / "lift.frd"
    places = {round(field.time): field.values[: len(mesh.nodes)] for field in read_frd(results, "DISP")}
    forces = {round(field.time): field.values for field in read_frd(results, "FORC")}
    held, bar_nodes = with_middles(mesh, organ.held), len(lever_mesh(lever).nodes)
    for step, name in ((steps.scanned, "A"), (steps.stage1, "stage 1"), (steps.stage2, "stage 2")):
        report_balance(forces[step], mesh, held, bar_nodes, name)
    scanned = places[steps.scanned]
    stages = {"stage 1": places[steps.stage1] - scanned, "stage 2": places[steps.stage2] - scanned}
    note = (
        f"CalculiX 2.20, {len(mesh.tetrahedra)} C3D10, neo-Hookean {truth.young_modulus_kpa:g} kPa ± "
        f"{100 * VARIATION:g} %, own contact with friction {settings.sticky:g} in stage 1 and "
        f"{settings.friction:g} in stage 2, made by scripts/make_lift_truth.py."
    )
    write_truth(truth.path, mesh, scanned, stages, note)


def report(truth: LiftTruth, anatomy: Anatomy, board: Board, lever: Lever) -> None:
    """Say what the written truth is worth."""
    written = truth.read()
    deformation, loading = written.deformation, written.loading
    rest, scanned = loading.mesh, deformation.mesh
    say(f"{truth.file}: {truth.path.stat().st_size / 1e6:.2f} MB, {len(rest.tetrahedra)} elements")
    say(f"volume: rest {rest.volume_mm3 * 1e-3:.1f} ml, A {scanned.volume_mm3 * 1e-3:.1f} ml")
    say(f"smallest relative Jacobian: A {smallest_jacobian(rest, scanned.nodes):.3f}")
    outer = surface_nodes(rest)
    for stage in deformation.stages:
        nodes = scanned.moved(stage.displacement)
        gap = gap_to_lever(nodes[outer], lever, radians(truth.angle_deg))
        height = height_over_board(nodes[outer], board)
        say(
            f"{stage.name}: smallest Jacobian {smallest_jacobian(rest, nodes):.3f}, largest displacement "
            f"{np.linalg.norm(stage.displacement, axis=1).max():.1f} mm, least gap to the lever {gap.min():.3f} mm "
            f"({(gap < 0.1).sum()} nodes within 0.1 mm), to the board {height.min():.3f} mm"
        )
    for tumour in scanned_structures(anatomy.interior, loading).tumours:
        motion = tumour_motion(deformation, tumour)
        say(f"{tumour.name}: moved {motion.moved_mm:.1f} mm, volume × {motion.volume_ratio:.4f}")


def say(sentence: str) -> None:
    """A line for people."""
    print(sentence, file=sys.stderr)


def main() -> int:
    """Mesh, deck, CalculiX, truth file, checks."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=[truth.name for truth in LIFT_TRUTHS], help="which truth to make")
    parser.add_argument("--work", type=Path, required=True, help="folder for the mesh, the deck and the results")
    parser.add_argument("--edge-mm", type=float, default=18.0, help="edge length aimed at (default 18)")
    parser.add_argument("--threads", type=int, default=1, help="threads for CalculiX (default 1)")
    parser.add_argument("--repaired", action="store_true", help="larger increments, for a CalculiX repaired as above")
    parser.add_argument("--export-only", action="store_true", help="take the results that are there")
    options = parser.parse_args()
    work: Path = options.work
    work.mkdir(parents=True, exist_ok=True)
    truth = lift_truth(options.name)
    anatomy = build_anatomy(truth.seed)
    board, lever = lever_lift(anatomy.proportions).tools
    assert isinstance(board, Board)
    assert isinstance(lever, Lever)
    mesh = rest_mesh(anatomy, options.edge_mm, work)
    held = node_sets(TetMesh(mesh.nodes, mesh.corners), [ATTACHMENT])["back"]
    organ = LiftOrgan(
        mesh, young_moduli(mesh, anatomy, truth.young_modulus_kpa), truth.poisson_ratio, DENSITY_KG_M3, held
    )
    settings = settings_of(truth, options.repaired)
    deck = work / ("again.inp" if options.export_only else "lift.inp")
    steps = write_lift_deck(deck, organ, lever, settings)
    say(f"{len(mesh.nodes)} nodes, {len(mesh.tetrahedra)} C3D10, {len(held)} corners held: {deck}")
    start = time.monotonic()
    if not options.export_only and not run_calculix(deck, options.threads):
        say(f"CalculiX did not finish; see {deck.with_suffix('.log')}.")
        return 1
    say(f"CalculiX: {time.monotonic() - start:.0f} s")
    export(work, truth, organ, lever, steps, settings)
    report(truth, anatomy, board, lever)
    return 0


if __name__ == "__main__":
    sys.exit(main())
