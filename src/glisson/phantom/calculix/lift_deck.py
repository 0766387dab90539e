"""The lever lift as a deck: an organ of neo-Hookean elements, board and lever, CalculiX's own contact.

Steps: gravity on the board (rest → A), the lever in steps of a few degrees with sticky contact (A → B',
stage 1), then friction lowered in steps with the lever held (B' → B, stage 2). CalculiX has no cohesion:
where a scenario says µ p + c with a large c, a coefficient `LiftSettings.sticky` above the tangent of the
lever's angle stands for it, which holds the lobe as well. A coefficient of 5 does not converge, nor does a
large change at once.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TET_FACES, TetMesh
from glisson.core.model import Material
from glisson.core.tools import Lever
from glisson.phantom.calculix.deck import FACE_OPPOSITE_CORNER, Deck, Increments, PenaltyContact
from glisson.phantom.calculix.rigid_bodies import board_panels, lever_mesh, turned
from glisson.phantom.heterogeneity import stiffness_levels

_LEVELS = 14
_RIGID = Material("linear-elastic", 1e4, 0.3, 0.0)


@dataclass(frozen=True)
class LiftSettings:
    """How far and with what contact. Stiffnesses in kPa/mm; some 10 E per mm keeps penetration small.

    `settling` are the coefficients of friction of stage 2 in turn, before the true one. The lever turns in steps
    of about `step_deg` along chords, in increments of at most `largest_deg`, the first a tenth of that; more, and
    contact is thrown far off. `settling_part` is the first increment of a step of stage 2, as a fraction.
    """

    angle_deg: float
    friction: float = 0.1
    sticky: float = 0.5
    settling: tuple[float, ...] = (0.4, 0.3, 0.22, 0.16, 0.13)
    step_deg: float = 5.5
    largest_deg: float = 1.0
    settling_part: float = 0.2
    normal_kpa_mm: float = 60.0
    tangent_kpa_mm: float = 12.0
    residual: float = 0.005

    def law(self, friction: float) -> PenaltyContact:
        """The contact law with this coefficient."""
        return PenaltyContact(self.normal_kpa_mm, self.tangent_kpa_mm, friction)


@dataclass(frozen=True, eq=False)
class LiftOrgan:
    """Mesh (T4 or T10) of the rest shape on the board y = 0, Young's moduli (m,) in kPa, the corner nodes held."""

    mesh: TetMesh
    young_moduli_kpa: FloatArray
    poisson_ratio: float
    density_kg_m3: float
    held: IntArray


@dataclass(frozen=True)
class LiftSteps:
    """CalculiX's step time (the number of the step) at the end of the gravity, of stage 1 and of stage 2."""

    scanned: int
    stage1: int
    stage2: int


def write_lift_deck(path: Path, organ: LiftOrgan, lever: Lever, settings: LiftSettings) -> LiftSteps:
    """Write the deck; its first nodes are those of the organ's mesh in their order."""
    deck = Deck("Lever lift: mm, kPa, mN, kg")
    _add_organ(deck, organ)
    under, lifted = _touching_faces(organ.mesh, lever)
    deck.surface("UNDER", *under)
    deck.surface("LIFTED", *lifted)
    lever_nodes, bar = _add_tools(deck, lever)
    deck.contact("TOUCH", settings.law(settings.friction), [("UNDER", "SBOARD"), ("LIFTED", "SLEVER")])
    deck.fix("BACK")

    def step(increments: Increments, angle_deg: float, friction: float | None, gravity: bool = False) -> None:
        deck.begin_step(increments)
        deck.residual(settings.residual)
        if friction is not None:
            deck.change_friction("TOUCH", settings.law(friction))
        if gravity:
            deck.gravity("EORGAN", np.array([0.0, 1.0, 0.0]))
        deck.displace(lever_nodes, turned(bar.nodes, lever, float(np.deg2rad(angle_deg))) - bar.nodes)
        deck.end_step(["U", "RF"], contact_results=True)

    step(Increments(first=0.1), 0.0, None, gravity=True)
    angles = np.linspace(0.0, settings.angle_deg, max(1, round(settings.angle_deg / settings.step_deg)) + 1)[1:]
    turning = Increments(
        first=0.1 * settings.largest_deg / settings.step_deg,
        largest=min(1.0, settings.largest_deg / settings.step_deg),
    )
    for number, angle in enumerate(angles):
        step(turning, float(angle), settings.sticky if number == 0 else None)
    lowered = (*settings.settling, settings.friction)
    settling = Increments(first=settings.settling_part, largest=min(1.0, 1.5 * settings.settling_part))
    for friction in lowered:
        step(settling, settings.angle_deg, friction)
    path.write_text(deck.text)
    return LiftSteps(1, 1 + len(angles), 1 + len(angles) + len(lowered))


def _add_organ(deck: Deck, organ: LiftOrgan) -> None:
    """The organ with its materials in `_LEVELS` levels of stiffness, and what is held ("BACK")."""
    deck.add_mesh(organ.mesh, "ORGAN")
    level, means = stiffness_levels(organ.young_moduli_kpa, _LEVELS)
    for number, modulus in enumerate(means):
        deck.element_set(f"E{number}", np.flatnonzero(level == number))
        material = Material("neo-hookean", float(modulus), organ.poisson_ratio, organ.density_kg_m3)
        deck.neo_hooke(f"M{number}", f"E{number}", material)
    deck.node_set("BACK", with_middles(organ.mesh, organ.held))


def with_middles(mesh: TetMesh, corners: IntArray) -> IntArray:
    """Boundary corner nodes, and the middle nodes (where there are any) of boundary edges between two of them."""
    if not mesh.is_quadratic:
        return np.sort(corners)
    chosen = np.zeros(len(mesh.nodes), dtype=bool)
    chosen[corners] = True
    outer = np.zeros(len(mesh.nodes), dtype=bool)
    elements, sides = _boundary_sides(mesh)
    for edge, (a, b) in enumerate(TET_EDGES):
        on_side = (sides != a) & (sides != b)
        outer[mesh.tetrahedra[elements[on_side], 4 + edge]] = True
    for edge, (a, b) in enumerate(TET_EDGES):
        both = chosen[mesh.tetrahedra[:, a]] & chosen[mesh.tetrahedra[:, b]]
        middles = mesh.tetrahedra[both, 4 + edge]
        chosen[middles[outer[middles]]] = True
    return np.flatnonzero(chosen)


def _boundary_sides(mesh: TetMesh) -> tuple[IntArray, IntArray]:
    """Element and side (the opposite corner, 0 to 3) of every boundary face."""
    faces = np.sort(mesh.corners[:, TET_FACES].reshape(-1, 3), axis=1)
    _, index, counts = np.unique(faces, axis=0, return_index=True, return_counts=True)
    outer = np.sort(index[counts == 1])
    return outer // 4, outer % 4


def _touching_faces(mesh: TetMesh, lever: Lever) -> tuple[tuple[IntArray, IntArray], tuple[IntArray, IntArray]]:
    """(elements, CalculiX faces) of what may touch the board, and of what may touch the lever."""
    elements, sides = _boundary_sides(mesh)
    corners = np.take_along_axis(mesh.corners[elements], TET_FACES[sides], axis=1)
    a, b, c = (mesh.nodes[corners[:, n]] for n in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    middle = (a + b + c) / 3.0
    # The rims of the hollows roll onto the board when the organ settles.
    down = (normals[:, 1] > -0.3) & (middle[:, 1] > -8.0)
    offset = middle - lever.hinge_mm
    near = np.abs(offset @ lever.axis) < lever.width_mm / 2.0 + 25.0
    lifted = down & near & (offset @ lever.arm > -12.0)

    def picked(chosen: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
        return elements[chosen], FACE_OPPOSITE_CORNER[sides[chosen]]

    return picked(down), picked(lifted)


def _add_tools(deck: Deck, lever: Lever) -> tuple[IntArray, TetMesh]:
    """Board (fixed) and lever (prescribed); returns the lever's node numbers and its mesh."""
    nodes, bricks = board_panels(np.array([-20.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]), 170.0, 4)
    numbers = deck.add_nodes(nodes, "NBOARD")
    elements = deck.add_elements("C3D8", numbers[bricks], "EBOARD")
    deck.elastic("MBOARD", "EBOARD", _RIGID)
    deck.fix("NBOARD")
    deck.surface("SBOARD", elements, np.full(len(elements), 2))
    bar = lever_mesh(lever)
    lever_nodes, lever_elements = deck.add_mesh(bar, "LEVER")
    deck.elastic("MLEVER", "ELEVER", _RIGID)
    # The outer face of each of its tetrahedra is corners 0, 1, 2, which CalculiX calls S1.
    deck.surface("SLEVER", lever_elements, np.ones(len(lever_elements), dtype=np.int64))
    return lever_nodes, bar
