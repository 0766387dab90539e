"""A block on an incline and a block that is pulled: |τ| ≤ µ p + c, as a whole body feels it."""

from functools import partial
from math import cos, degrees, radians, sin

import numpy as np
from scipy.optimize import brentq

from glisson.core.deformation import Deformation
from glisson.core.model import Material
from glisson.core.scenario import ContactLaw, Scenario, Stage
from glisson.core.status import Status
from glisson.core.tools import Board
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.verification.bodies import body_of, box_model, equilibrium, floor
from glisson.verification.check import Case, Check, NoSolution, relative, vanishing

BLOCK = Material("neo-hookean", 50.0, 0.3, 1150.0)
SIZES = (40.0, 30.0, 10.0)  # low, so that it does not begin to tip before it slides
_AREA = SIZES[0] * SIZES[1]
_WEIGHT = density_from_kg_m3(1150.0) * STANDARD_GRAVITY_MM_S2 * _AREA * SIZES[2]  # mN
_FRICTION = 0.3
_BISECTIONS = 9
_COULOMB = "|τ| ≤ µ p + c"


def incline(angle_deg: float, law: ContactLaw, stages: int = 1) -> Deformation:
    """A block on a board, gravity tilted by the angle towards +x; nothing else holds it."""
    gravity = np.array([sin(radians(angle_deg)), 0.0, -cos(radians(angle_deg))])
    board = Board("board", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    held = tuple(Stage(f"stage {number}", law, fixed=()) for number in range(stages))
    scenario = Scenario((board,), held, surgery_gravity=gravity, rest_shape="as-scanned")
    model = box_model(box_mesh(SIZES, (4, 3, 2)), BLOCK)
    return QuasiStatic(QuasiStaticParameters(element="T4")).solve(model, scenario)


def _stick(name: str) -> list[Check]:
    """Well below the friction angle the board carries the block's weight, along and across it."""
    angle = 0.8 * degrees(np.arctan(_FRICTION))
    answer = incline(angle, ContactLaw(_FRICTION))
    if not answer.status.is_good:
        raise NoSolution(answer.message)
    force = 1e3 * np.array(answer.stages[-1].contacts[0].force_n)
    return [
        relative(f"{name}/normal-force", force[2], _WEIGHT * cos(radians(angle)), 0.01, "mN", "weight"),
        relative(f"{name}/shear-force", -force[0], _WEIGHT * sin(radians(angle)), 0.01, "mN", "weight"),
    ]


def _slip(name: str, cohesion_kpa: float) -> list[Check]:
    """The angle at which the block begins to slide for good, by bisection."""

    def excess(angle_deg: float) -> float:
        angle = radians(angle_deg)
        return _WEIGHT * (sin(angle) - _FRICTION * cos(angle)) - cohesion_kpa * _AREA

    expected = float(brentq(excess, 1.0, 89.0))
    low, high = 0.9 * expected, 1.1 * expected
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        status = incline(middle, ContactLaw(_FRICTION, cohesion_kpa)).status
        if status is Status.CONVERGED:
            low = middle
        elif status is Status.SINGULAR:
            high = middle
        else:
            raise NoSolution(f"at {middle:.2f}° the solver ended with {status}")
    return [relative(f"{name}/angle", 0.5 * (low + high), expected, 0.01, "deg", _COULOMB)]


def _pulled(name: str, cohesion_kpa: float) -> list[Check]:
    """Pulled along the floor until it slides everywhere, the floor reacts with µ N + c A."""
    mesh = box_mesh(SIZES, (4, 3, 2))
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[:, 0] = True  # every node is pulled, so that the whole base slides at once
    body = body_of(mesh, Material("neo-hookean", 5000.0, 0.3), fixed, boards=[floor(-0.05)])
    body.law = ContactLaw(_FRICTION, cohesion_kpa)
    pressed = 12.0e3  # mN, 10 kPa on the base
    body.external = np.zeros_like(mesh.nodes)
    body.external[:, 2] = -pressed / len(mesh.nodes)
    positions = equilibrium(body, np.array(mesh.nodes))
    body.renew_cohesion(positions)
    for _ in range(5):
        positions = equilibrium(body, positions + [0.05, 0.0, 0.0])
        body.accept(positions)
        body.renew_cohesion(positions)
    force = body.balance(positions, body.touches(positions)).contact.sum(axis=0)
    return [
        relative(f"{name}/normal-force", force[2], pressed, 0.01, "mN", "applied force"),
        relative(f"{name}/shear-force", -force[0], _FRICTION * pressed + cohesion_kpa * _AREA, 0.01, "mN", _COULOMB),
    ]


def _creep(name: str) -> list[Check]:
    """Ten load steps on a slope without change move a held block by less than 0.01 mm."""
    answer = incline(degrees(0.2), ContactLaw(_FRICTION), stages=11)
    if not answer.status.is_good:
        raise NoSolution(answer.message)
    drift = answer.stages[-1].displacement - answer.stages[0].displacement
    return [vanishing(f"{name}/drift", np.abs(drift).max(), 0.01, "mm", "a held block stays where it is")]


_COHESION = _WEIGHT * (sin(radians(45.0)) - _FRICTION * cos(radians(45.0))) / _AREA  # holds up to 45°

CASES = (
    Case(
        "friction/stick",
        f"block on an incline below the friction angle, µ = {_FRICTION}",
        partial(_stick, "friction/stick"),
    ),
    Case(
        "friction/slip",
        f"block on an incline that is tilted until it slides, µ = {_FRICTION}",
        partial(_slip, "friction/slip", 0.0),
    ),
    Case(
        "friction/slip-cohesion",
        f"block on an incline that is tilted until it slides, µ = {_FRICTION}, c = {1e3 * _COHESION:.0f} Pa",
        partial(_slip, "friction/slip-cohesion", _COHESION),
    ),
    *(
        Case(name, f"block pulled along a floor, µ = {_FRICTION}, c = {kpa:g} kPa", partial(_pulled, name, kpa))
        for kpa in (0.0, 0.5, 10.0)
        for name in [f"friction/pulled-{kpa:g}kpa"]
    ),
    Case("friction/creep", "held block on an incline, ten steps without change", partial(_creep, "friction/creep")),
)
