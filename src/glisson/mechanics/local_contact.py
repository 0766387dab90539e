"""Contact with moving tools, solved for itself against the linearised organ.

Points at a tool's edge come and go within hundredths of a millimetre, and Newton's method on the whole organ
pays a factorisation for each such change. Here the organ's tangent is condensed onto the patch of surface near
the tools (its Schur complement: a small dense spring), against which gaps, friction and cohesion are solved
exactly, the tools moving in as many small steps as they need. To the whole organ only its own nonlinearity
is left, on which Newton's method converges in a few iterations.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, lu_factor, lu_solve
from threadpoolctl import threadpool_limits

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.scenario import ContactLaw
from glisson.mechanics.body import ToolState, scatter_blocks
from glisson.mechanics.contact import ToolContact, Touch
from glisson.mechanics.patch import Patch
from glisson.mechanics.spring import Spring

_Pushes = tuple[IntArray, FloatArray]
"""Points (p,) of the patch and the stiffness (p, 3, 3) in mN/mm with which a tool meets them."""

_ITERATIONS = 40
_FARTHEST_MM = 100.0  # displacements beyond it are no answer of a linearised organ
_HALVINGS = 30
_ARMIJO = 1e-4
_ROUND_OFF = 1e-13
_FAILURES = 4  # of the small steps: beyond them a smaller step of the whole organ costs less
_ROUGH_TOLERANCE = 1e-2  # of the load, while the points that cohere are sought
_COUPLED_RESIDUAL = 0.1
_COUPLED_GAIN = 0.3  # share of what the linearisation promises that such a step must gain
_COUPLED_LENGTHS = (1.0, 0.5, 0.25, 0.125)
_RENEWALS = 40
_FIRST_WAY_MM = 2.0  # of the tools, in the first of the small steps
_SHIFTS = (1e-6, 1e-4, 1e-2, 0.1, 1.0)  # shares of the mean diagonal, for a spring that is not definite


@dataclass(frozen=True, eq=False)
class Settled:
    """Displacement (k,) of the patch's free unknowns in mm, and by how much it lowers the energy (µJ)."""

    displacement: FloatArray
    gain: float


class LocalContact:
    """Equilibrium of a patch on its spring with the moving tools.

    Args:
        contacts: the tools over the patch's points, with their states; they are changed.
        patch: the patch.
        points_mm: the points (p, 3) before the patch moves.
        drift_mm: how far (p, 3) what is carried moves them in this step, in even measure with the tools.
        spring: the organ.
        load: (k,) force in mN on the patch before it moves, of everything but these tools.
        change: (k,) the part of `load` that is new in this step, and comes on with the tools' motion.
        scale: force in mN to which residuals relate.
    """

    def __init__(
        self,
        contacts: Sequence[ToolContact],
        patch: Patch,
        points_mm: FloatArray,
        drift_mm: FloatArray,
        spring: Spring,
        load: FloatArray,
        change: FloatArray,
        scale: float,
    ) -> None:
        self._contacts, self._patch = tuple(contacts), patch
        self._start, self._drift, self._points = points_mm, drift_mm, points_mm
        self._spring, self._full_load, self._change, self._scale = spring, load, change, scale
        self._load = load
        self._numbers = np.full(3 * len(patch.nodes), -1)  # of the unknowns
        self._numbers[patch.unknowns] = np.arange(len(patch.unknowns))
        self._last_touched: tuple[IntArray, FloatArray] | None = None
        self._law = ContactLaw()

    def settle(self, start: ToolState, goal: ToolState, tolerance: float) -> Settled | None:
        """Follow the tools from `start` to `goal`; None where that fails even in small steps."""
        with threadpool_limits(1):  # these matrices are small, and the factorisation's threads are still about
            return self._follow(start, goal, tolerance)

    def _follow(self, start: ToolState, goal: ToolState, tolerance: float) -> Settled | None:
        still = start == goal and not self._change.any() and not self._drift.any()
        displacement = np.zeros(len(self._load))
        way = max(
            float(np.linalg.norm(contact.motion(self._points, angle), axis=1).max(initial=0.0))
            for contact, angle in zip(self._contacts, goal.angles, strict=True)
        )
        done, share, failures = 0.0, min(1.0, _FIRST_WAY_MM / max(way, 1e-300)), 0
        while done < 1.0:
            reach = min(done + share, 1.0)
            memories = [contact.memory() for contact in self._contacts]
            found = self._step(displacement, start.towards(goal, reach), reach, tolerance)
            if found is not None:
                displacement, done = found, 1.0 if reach > 1.0 - 1e-9 else reach
                share *= 2.0
                continue
            for contact, memory in zip(self._contacts, memories, strict=True):
                contact.recall(memory)
            share /= 2.0
            failures += 1
            if still or failures == _FAILURES:
                return None
        return Settled(displacement, self._energy(np.zeros_like(displacement)) - self._energy(displacement))

    def _step(self, displacement: FloatArray, state: ToolState, reach: float, tolerance: float) -> FloatArray | None:
        """Equilibrium at a state of the tools, in which exactly the touching points cohere."""
        predicted = displacement + self._predict(displacement, state)
        for contact, angle in zip(self._contacts, state.angles, strict=True):
            contact.angle = angle
        self._law = state.law
        self._load = self._full_load - (1.0 - reach) * self._change
        self._points = self._start + reach * self._drift
        if state.law.cohesion_kpa == 0.0:
            return self._balance(predicted, tolerance)
        found = self._balance(predicted, _ROUGH_TOLERANCE)
        for _ in range(_RENEWALS):
            if found is None:
                return None
            lost = self._renew_cohesion(found)
            found = self._balance(found, _ROUGH_TOLERANCE if lost else tolerance)
            if lost == 0 and found is not None and self._renew_cohesion(found) == 0:
                return found
        return found

    def _predict(self, displacement: FloatArray, state: ToolState) -> FloatArray:
        """First-order answer (k,) to the tools' motion, the contact being as it is."""
        touches = self._touches(displacement)
        points = self._moved(displacement)
        pushes = np.zeros_like(points)
        for contact, touch, angle in zip(self._contacts, touches, state.angles, strict=True):
            if angle != contact.angle:
                used, local = contact.stiffness(touch, points, project=True)
                pushes[used] += np.einsum("pij,pj->pi", local, contact.motion(points[used], angle))
        force = self._scatter(pushes)
        if not force.any():
            return np.zeros_like(displacement)
        step = self._solved(displacement, touches, force, project=True)
        return np.zeros_like(displacement) if step is None else step

    def _balance(self, displacement: FloatArray, tolerance: float) -> FloatArray | None:
        """Newton's method with an energy line search, and near the end with friction that follows the pressure."""
        for _ in range(_ITERATIONS):
            touches = self._touches(displacement)
            unbalanced = self._unbalanced(displacement, touches)
            residual = float(np.linalg.norm(unbalanced)) / self._scale
            if residual <= tolerance:
                return displacement
            coupled = self._coupled(displacement, touches, unbalanced, residual)
            moved = coupled if coupled is not None else self._descent(displacement, touches, unbalanced)
            if moved is None or float(np.abs(moved).max()) > _FARTHEST_MM:
                return None
            displacement = moved
        return None

    def _coupled(
        self, displacement: FloatArray, touches: Sequence[Touch], unbalanced: FloatArray, residual: float
    ) -> FloatArray | None:
        if residual > _COUPLED_RESIDUAL:
            return None
        points = self._moved(displacement)
        pushes = self._stiffness(displacement, touches, project=False)
        for contact, touch in zip(self._contacts, touches, strict=True):
            pushes.append(contact.friction_by_pressure(touch, points, self._law))
        step = self._unsymmetric_answer(*self._on_touched(pushes), unbalanced)
        for length in _COUPLED_LENGTHS:
            moved: FloatArray = displacement + length * step
            found = self._unbalanced(moved, self._touches(moved))
            if float(np.linalg.norm(found)) < (1.0 - _COUPLED_GAIN * length) * residual * self._scale:
                return moved
        self._touches(displacement)  # friction as it was
        return None

    def _descent(self, displacement: FloatArray, touches: Sequence[Touch], unbalanced: FloatArray) -> FloatArray | None:
        step = self._solved(displacement, touches, unbalanced, project=False)
        if step is None:
            return None
        start, slope = self._energy(displacement), -float(unbalanced @ step)
        if slope >= 0.0:
            return None
        scale, length = abs(start) + float(np.abs(self._load * displacement).sum()), 1.0
        for _ in range(_HALVINGS):
            moved: FloatArray = displacement + length * step
            if self._energy(moved) <= start + _ARMIJO * length * slope + _ROUND_OFF * scale:
                return moved
            length *= 0.5
        return None

    def _solved(
        self, displacement: FloatArray, touches: Sequence[Touch], force: FloatArray, project: bool
    ) -> FloatArray | None:
        """Displacement (k,) under a force (k,); the stiffness is made definite only when Cholesky refuses it."""
        for projected in (True,) if project else (False, True):
            touched, stiffness = self._on_touched(self._stiffness(displacement, touches, projected))
            step = self._answer(touched, stiffness, force)
            if step is not None:
                return step
        matrix = self._with_spring(touched, stiffness)
        diagonal = float(np.diag(matrix).mean())
        for share in _SHIFTS:
            step = _cholesky_solve(matrix + share * diagonal * np.eye(len(matrix)), force)
            if step is not None:
                return step
        return None

    def _moved(self, displacement: FloatArray) -> FloatArray:
        """The points (p, 3) after a displacement (k,)."""
        moved: FloatArray = self._points + self._patch.surface.positions(self._nodal(displacement))
        return moved

    def _nodal(self, values: FloatArray) -> FloatArray:
        nodal = np.zeros(3 * len(self._patch.nodes))
        nodal[self._patch.unknowns] = values
        return nodal.reshape(-1, 3)

    def _scatter(self, pushes: FloatArray) -> FloatArray:
        nodal = self._patch.surface.scatter(pushes)
        forces: FloatArray = nodal.ravel()[self._patch.unknowns]
        return forces

    def _touches(self, displacement: FloatArray) -> tuple[Touch, ...]:
        points = self._moved(displacement)
        touches = tuple(contact.touch(points) for contact in self._contacts)
        for contact, touch in zip(self._contacts, touches, strict=True):
            contact.update_friction(touch, self._law)
        return touches

    def _renew_cohesion(self, displacement: FloatArray) -> int:
        points = self._moved(displacement)
        return sum(contact.renew_cohesion(contact.touch(points)) for contact in self._contacts)

    def _unbalanced(self, displacement: FloatArray, touches: Sequence[Touch]) -> FloatArray:
        points = self._moved(displacement)
        pushes = np.zeros_like(points)
        for contact, touch in zip(self._contacts, touches, strict=True):
            pushes += contact.forces(touch, points)
        unbalanced: FloatArray = self._load - self._spring.stiffness @ displacement + self._scatter(pushes)
        return unbalanced

    def _energy(self, displacement: FloatArray) -> float:
        points = self._moved(displacement)
        touching = sum(contact.energy(points) for contact in self._contacts)
        return touching + float(displacement @ (0.5 * self._spring.stiffness @ displacement - self._load))

    def _stiffness(self, displacement: FloatArray, touches: Sequence[Touch], project: bool) -> list[_Pushes]:
        """That of the contacts alone."""
        points = self._moved(displacement)
        return [
            contact.stiffness(touch, points, project) for contact, touch in zip(self._contacts, touches, strict=True)
        ]

    def _on_touched(self, pushes: Sequence[_Pushes]) -> tuple[IntArray, FloatArray]:
        """The unknowns (t,) that are touched, and their dense stiffness (t, t)."""
        surface = self._patch.surface
        points = np.concatenate([used for used, _ in pushes])
        nodes, local = np.unique(surface.nodes[points], return_inverse=True)
        local = local.reshape(len(points), surface.shapes.shape[1])
        count = len(nodes)
        pairs = local[:, :, None] * count + local[:, None, :]
        blocks = np.zeros((count**2, 3, 3))
        values = np.concatenate([values for _, values in pushes])
        scatter_blocks(np.arange(len(points)), values, surface.shapes[points], pairs, blocks)
        matrix = blocks.reshape(count, count, 3, 3).transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
        numbers = self._numbers[(3 * nodes[:, None] + np.arange(3)).ravel()]
        free = np.flatnonzero(numbers >= 0)
        return numbers[free], matrix if len(free) == len(matrix) else matrix[np.ix_(free, free)]

    def _with_spring(self, touched: IntArray, stiffness: FloatArray) -> FloatArray:
        """The whole stiffness (k, k)."""
        matrix: FloatArray = self._spring.stiffness.copy()
        matrix[np.ix_(touched, touched)] += stiffness
        return matrix

    def _answer(self, touched: IntArray, stiffness: FloatArray, force: FloatArray) -> FloatArray | None:
        """Displacement (k,) under a force (k,); None where the stiffness is not definite.

        Where the spring has an inverse it is condensed further, onto what is touched.
        """
        compliance = self._spring.compliance
        if compliance is None:
            return _cholesky_solve(self._with_spring(touched, stiffness), force)
        free = compliance @ force
        if not len(touched):
            return free
        condensed = self._condensed(touched, compliance)
        moved = _cholesky_solve(condensed + stiffness, condensed @ free[touched])
        if moved is None:
            return None
        answer: FloatArray = free - compliance[:, touched] @ (stiffness @ moved)
        return answer

    def _condensed(self, touched: IntArray, compliance: FloatArray) -> FloatArray:
        """The spring (t, t) as what is touched feels it; kept for the next call, which mostly asks for the same."""
        if self._last_touched is None or not np.array_equal(self._last_touched[0], touched):
            condensed = np.linalg.inv(compliance[np.ix_(touched, touched)])
            self._last_touched = touched, 0.5 * (condensed + condensed.T)
        return self._last_touched[1]

    def _unsymmetric_answer(self, touched: IntArray, stiffness: FloatArray, force: FloatArray) -> FloatArray:
        """The same for a stiffness that is not symmetric; a singular one gives a useless displacement."""
        compliance = self._spring.compliance
        if compliance is None:
            return _lu_solve(self._with_spring(touched, stiffness), force)
        free: FloatArray = compliance @ force
        if not len(touched):
            return free
        matrix = compliance[np.ix_(touched, touched)] @ stiffness
        matrix[np.diag_indices(len(matrix))] += 1.0
        moved = _lu_solve(matrix, free[touched])
        answer: FloatArray = free - compliance[:, touched] @ (stiffness @ moved)
        return answer


def _lu_solve(matrix: FloatArray, force: FloatArray) -> FloatArray:
    solution: FloatArray = lu_solve(lu_factor(matrix, check_finite=False), force, check_finite=False)
    return solution


def _cholesky_solve(matrix: FloatArray, force: FloatArray) -> FloatArray | None:
    try:
        solution: FloatArray = cho_solve(cho_factor(matrix, check_finite=False), force, check_finite=False)
    except LinAlgError:
        return None
    return solution
