import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core import Material
from glisson.mechanics.materials.law import find_law
from glisson.verification.bodies import FRAME_INDIFFERENT, LAWS, material_of


def _gradients(count: int, size: float) -> np.ndarray:
    return np.eye(3) + np.random.default_rng(3).uniform(-size, size, (count, 3, 3))


@pytest.mark.parametrize("law_name", LAWS)
def test_laws_are_hookean_for_small_strain(law_name: str) -> None:
    material = material_of(law_name)
    strain = np.array([[1.0, 0.2, -0.3], [0.2, -0.4, 0.5], [-0.3, 0.5, 0.7]])
    hooke = material.lame_lambda_kpa * np.trace(strain) * np.eye(3) + 2 * material.shear_modulus_kpa * strain
    law = find_law(law_name)
    assert law.energy(np.eye(3)[None], material) == pytest.approx(0.0, abs=1e-15)
    stress = law.stress((np.eye(3) + 1e-7 * strain)[None], material)[0] / 1e-7
    np.testing.assert_allclose(stress, hooke, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("law_name", FRAME_INDIFFERENT)
def test_hyperelastic_laws_do_not_feel_rotation(law_name: str) -> None:
    law, material = find_law(law_name), material_of(law_name)
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


@pytest.mark.parametrize("law_name", FRAME_INDIFFERENT)
def test_inverted_elements_have_infinite_energy(law_name: str) -> None:
    law, material = find_law(law_name), material_of(law_name)
    assert np.isinf(law.energy(np.diag([1.0, 1.0, -0.1])[None], material)).all()
