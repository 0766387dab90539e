"""The verification suite: every quick case passes, and what it says about failures and orders."""

import numpy as np
import pytest

from glisson.core import BadInput, Material
from glisson.geometry.boxes import box_mesh
from glisson.verification.bodies import body_of, equilibrium
from glisson.verification.check import PREFIXES, Case, Check, NoSolution, Unavailable, order_check, taylor_check
from glisson.verification.suite import CASES, chosen_cases

QUICK = [case for case in CASES if not case.slow]


@pytest.mark.parametrize("case", QUICK, ids=lambda case: case.name)
def test_quick_case(case: Case) -> None:
    try:
        checks = case.run()
    except Unavailable as absent:
        pytest.skip(str(absent))
    assert checks
    for check in checks:
        assert check.name.startswith(f"{case.name}/")
        assert check.passed, check


def test_names_begin_with_known_prefixes_and_differ() -> None:
    assert {case.prefix for case in CASES} == set(PREFIXES)
    assert len({case.name for case in CASES}) == len(CASES)


def test_cases_are_chosen_by_how_their_names_begin() -> None:
    assert {case.prefix for case in chosen_cases("taylor/law")} == {"taylor"}
    with pytest.raises(BadInput, match=r"No check begins with 'nothing'.*patch"):
        chosen_cases("nothing")


def test_a_case_without_an_engine_is_a_failed_check_with_the_reason() -> None:
    def absent() -> list[Check]:
        raise Unavailable("CalculiX is not installed")

    (check,) = Case("calculix/x", "", absent).checks()
    assert not check.passed
    assert check.value is None
    assert check.reason == "CalculiX is not installed"


def test_a_case_without_a_solution_fails_and_is_not_skipped() -> None:
    mesh = box_mesh((1.0, 1.0, 1.0), (1, 1, 1))
    body = body_of(mesh, Material("neo-hookean", 7.0, 0.3))
    body.external = np.ones_like(mesh.nodes)
    with pytest.raises(NoSolution, match="no equilibrium"):
        equilibrium(body, np.array(mesh.nodes), limit=20)


def test_a_value_that_is_not_finite_fails() -> None:
    (check,) = Case("mms/x", "", lambda: [Check("mms/x/y", float("nan"), 1.0, 0.1)]).checks()
    assert not check.passed
    assert check.value is None
    assert check.reason == "the value is not finite"


def test_orders_are_slopes() -> None:
    check = order_check("mms/x", (4.0, 2.0, 1.0), (0.5, 0.08, 0.01), 3.0, "")
    assert check.value == pytest.approx(3.0)
    assert check.passed
    wrong = taylor_check("taylor/x", lambda h: h + h**2, (1e-3, 1e-4))
    assert wrong.value == pytest.approx(1.0, abs=0.01)
    assert not wrong.passed
