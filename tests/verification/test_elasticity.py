import numpy as np
import pytest
from bodies import body_of, box_mesh, distorted, solve
from scipy.spatial.transform import Rotation

from glisson.core import Material
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.materials.law import find_law
from glisson.mechanics.pattern import block_pattern

LAWS = ("linear-elastic", "co-rotational", "saint-venant-kirchhoff", "neo-hookean", "neo-hookean-log")
HYPERELASTIC = LAWS[1:]


def _gradients(count: int, size: float) -> np.ndarray:
    return np.eye(3) + np.random.default_rng(3).uniform(-size, size, (count, 3, 3))


@pytest.mark.parametrize("law_name", LAWS)
def test_stress_and_tangent_are_the_derivatives_of_the_energy(law_name: str) -> None:
    """Taylor tests: the remainders fall with the second (energy) and second (stress) power of the step."""
    law, material = find_law(law_name), Material(law_name, 7.0, 0.45)
    gradients, direction = _gradients(20, 0.2), np.random.default_rng(4).uniform(-1, 1, (20, 3, 3))
    stress = law.stress(gradients, material)
    tangent = law.tangent(gradients, material).reshape(-1, 3, 3, 3, 3)
    slope = np.einsum("nij,nij->n", stress, direction)
    change = np.einsum("nijkl,nkl->nij", tangent, direction)
    steps = np.array([1e-2, 1e-3])
    energy_rest, stress_rest = [], []
    for h in steps:
        moved = gradients + h * direction
        energy_rest.append(np.abs(law.energy(moved, material) - law.energy(gradients, material) - h * slope).max())
        stress_rest.append(np.abs(law.stress(moved, material) - stress - h * change).max())
    assert np.log10(energy_rest[0] / energy_rest[1]) == pytest.approx(2.0, abs=0.1)
    if law_name == "linear-elastic":
        assert max(stress_rest) < 1e-12  # linear: no remainder at all
    else:
        assert np.log10(stress_rest[0] / stress_rest[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("law_name", LAWS)
def test_laws_are_hookean_for_small_strain(law_name: str) -> None:
    material = Material(law_name, 7.0, 0.45)
    strain = np.array([[1.0, 0.2, -0.3], [0.2, -0.4, 0.5], [-0.3, 0.5, 0.7]])
    hooke = material.lame_lambda_kpa * np.trace(strain) * np.eye(3) + 2 * material.shear_modulus_kpa * strain
    law = find_law(law_name)
    assert law.energy(np.eye(3)[None], material) == pytest.approx(0.0, abs=1e-15)
    stress = law.stress((np.eye(3) + 1e-7 * strain)[None], material)[0] / 1e-7
    np.testing.assert_allclose(stress, hooke, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("law_name", HYPERELASTIC)
def test_hyperelastic_laws_do_not_feel_rotation(law_name: str) -> None:
    law, material = find_law(law_name), Material(law_name, 7.0, 0.45)
    gradients = _gradients(10, 0.2)
    rotation, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    rotation *= np.sign(np.linalg.det(rotation))
    np.testing.assert_allclose(law.energy(rotation @ gradients, material), law.energy(gradients, material), rtol=1e-12)
    assert np.abs(law.stress(rotation[None], material)).max() < 1e-12


@pytest.mark.parametrize(
    ("law_name", "stress"),
    [
        # Without lateral strain and with ν = 0: a cubic that softens below a stretch of 1/√3, and a straight line.
        ("saint-venant-kirchhoff", lambda stretch: 7.0 * 0.5 * stretch * (stretch**2 - 1.0)),
        ("co-rotational", lambda stretch: 7.0 * (stretch - 1.0)),
    ],
)
def test_uniaxial_stress_in_a_turned_frame(law_name: str, stress) -> None:
    law, material = find_law(law_name), Material(law_name, 7.0, 0.0)
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    stretches = np.array([0.4, 1.0 / np.sqrt(3.0), 0.9, 1.0, 1.3, 2.0])
    stretched = np.tile(np.eye(3), (len(stretches), 1, 1))
    stretched[:, 0, 0] = stretches
    expected = np.zeros_like(stretched)
    expected[:, 0, 0] = stress(stretches)
    np.testing.assert_allclose(law.stress(turn @ stretched, material), turn @ expected, atol=1e-12)


@pytest.mark.parametrize("law_name", HYPERELASTIC)
def test_inverted_elements_have_infinite_energy(law_name: str) -> None:
    law, material = find_law(law_name), Material(law_name, 7.0, 0.45)
    assert np.isinf(law.energy(np.diag([1.0, 1.0, -0.1])[None], material)).all()


@pytest.mark.parametrize("quadratic", [False, True], ids=["T4", "T10"])
@pytest.mark.parametrize("law_name", LAWS)
def test_patch_test(quadratic: bool, law_name: str) -> None:
    """An affine boundary displacement is reproduced inside, on a distorted mesh, to 1e-9."""
    coarse = distorted(box_mesh((30.0, 20.0, 10.0), (3, 3, 3)), 1.0)
    mesh = coarse.as_quadratic() if quadratic else coarse
    on_boundary = np.zeros(len(mesh.nodes), dtype=bool)
    on_boundary[(np.abs(mesh.nodes / [30, 20, 10] - 0.5) > 0.5 - 1e-9).any(axis=1)] = True
    gradient = np.array([[0.05, 0.02, -0.03], [0.04, -0.06, 0.01], [0.02, 0.03, 0.04]])
    affine = mesh.nodes + mesh.nodes @ gradient.T
    body = body_of(mesh, Material(law_name, 7.0, 0.45), np.repeat(on_boundary[:, None], 3, axis=1))
    start = np.where(on_boundary[:, None], affine, mesh.nodes + 0.9 * (affine - mesh.nodes))
    end = solve(body, start, tolerance=1e-13)
    error = np.abs(end.positions - affine).max() / np.abs(affine - mesh.nodes).max()
    assert error < 1e-9


def test_uniaxial_stretch_of_the_split_law() -> None:
    """Stretched bar with free sides against the closed form of W = µ/2 (J^(−2/3) I1 − 3) + κ/2 (J − 1)²."""
    material = Material("neo-hookean", 7.0, 0.45)
    mesh = box_mesh((20.0, 10.0, 10.0), (4, 2, 2), quadratic=True)
    stretch = 1.3
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    ends = (mesh.nodes[:, 0] < 1e-9) | (mesh.nodes[:, 0] > 20.0 - 1e-9)
    fixed[ends, 0] = True
    for axis in (1, 2):
        fixed[mesh.nodes[:, axis] < 1e-9, axis] = True
    start = mesh.nodes * [stretch, 0.9, 0.9]
    end = solve(body_of(mesh, material, fixed), start, tolerance=1e-12)
    mu, kappa = material.shear_modulus_kpa, material.bulk_modulus_kpa
    side = _root(lambda b: _lateral_stress(stretch, b, mu, kappa), 0.7, 1.0)
    jacobian = stretch * side**2
    first = stretch**2 + 2 * side**2
    pull = mu * jacobian ** (-2 / 3) * (stretch - first / (3 * stretch)) + kappa * (jacobian - 1) * jacobian / stretch
    body = body_of(mesh, material)
    force = body.elasticity.forces(end.positions)[mesh.nodes[:, 0] > 20.0 - 1e-9, 0].sum()
    assert force == pytest.approx(pull * 100.0, rel=1e-8)
    assert np.ptp(end.positions[:, 1]) == pytest.approx(10.0 * side, rel=1e-8)


def _lateral_stress(stretch: float, side: float, mu: float, kappa: float) -> float:
    jacobian = stretch * side**2
    first = stretch**2 + 2 * side**2
    return mu * jacobian ** (-2 / 3) * (side - first / (3 * side)) + kappa * (jacobian - 1) * jacobian / side


def _root(function, low: float, high: float) -> float:
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) * function(high) < 0 else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize("law_name", HYPERELASTIC)
def test_body_forces_and_stiffness_are_derivatives(law_name: str) -> None:
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (3, 2, 2)), 0.5).as_quadratic()
    body = body_of(mesh, Material(law_name, 7.0, 0.45))
    rng = np.random.default_rng(1)
    positions = mesh.nodes + rng.uniform(-0.3, 0.3, mesh.nodes.shape)
    direction = rng.uniform(-1, 1, mesh.nodes.shape)
    forces = body.elasticity.forces(positions)
    blocks = body.stiffness(positions, body.touches(positions), project=False)
    change = (body.matrix(blocks) @ direction.ravel()).reshape(direction.shape)
    rest = []
    for h in (1e-3, 1e-4):
        moved = body.elasticity.forces(positions + h * direction)
        rest.append(np.abs(moved - forces - h * change).max())
        numeric = (body.elasticity.energy(positions + h * direction) - body.elasticity.energy(positions)) / h
        assert numeric == pytest.approx(float(np.vdot(forces, direction)), rel=50 * h)
    assert np.log10(rest[0] / rest[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("quadratic", [False, True], ids=["T4", "T10"])
@pytest.mark.parametrize("law_name", HYPERELASTIC)
def test_derivative_by_the_unloaded_shape(quadratic: bool, law_name: str) -> None:
    """Taylor test of the internal forces at deformed positions that are held while the unloaded ones move."""
    mesh = distorted(box_mesh((30.0, 20.0, 10.0), (2, 2, 1)), 1.0)
    mesh = mesh.as_quadratic() if quadratic else mesh
    materials = {int(mesh.region_numbers[0]): Material(law_name, 7.0, 0.45)}
    rng = np.random.default_rng(6)
    rest = mesh.nodes + rng.uniform(-0.5, 0.5, mesh.nodes.shape)
    direction = rng.uniform(-1, 1, mesh.nodes.shape)
    pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
    blocks = np.zeros((pattern.block_count, 3, 3))
    at_rest = Elasticity(mesh, materials, rest)
    at_rest.add_rest_derivative(mesh.nodes, pattern, blocks)
    change = (pattern.matrix(blocks) @ direction.ravel()).reshape(direction.shape)
    remainders = [
        np.abs(
            Elasticity(mesh, materials, rest + h * direction).forces(mesh.nodes)
            - at_rest.forces(mesh.nodes)
            - h * change
        ).max()
        for h in (1e-2, 1e-3)
    ]
    assert np.log10(remainders[0] / remainders[1]) == pytest.approx(2.0, abs=0.1)
