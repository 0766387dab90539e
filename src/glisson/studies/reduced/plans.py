"""How much `glisson benchmark reduced` does, on the public liver and, in its quick form, on an egg."""

from pathlib import Path

from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.mechanics.reduced.building import Sizes
from glisson.studies.reduced.benchmark import Plan
from glisson.studies.reduced.egg import egg
from glisson.studies.reduced.liver import sofa_liver

WHOLE = Plan(
    pulls=40,
    training=450,
    calibration=400,
    loads=1000,
    checked=20,
    first=Sizes(40, 250, 40, 250, 1e-3),
    sizes=Sizes(60, 450, 140, 800, 2e-4),
    largest_mm=0.3,
)
QUICK = Plan(
    pulls=15,
    training=90,
    calibration=15,
    loads=25,
    checked=3,
    first=Sizes(20, 120, 20, 120, 1e-3),
    sizes=Sizes(40, 300, 80, 500, 5e-4),
    largest_mm=1.0,
)


def plan_and_model(quick: bool, shared: Path) -> tuple[Plan, Model]:
    """The plan and the organ; `shared` is the folder of public data, which the quick form does without.

    Raises:
        BadInput: the liver is not there.
    """
    if quick:
        return QUICK, egg()
    folder = shared / "open" / "sofa-mor-liverfine"
    if not folder.is_dir():
        raise BadInput(
            f"The liver of this benchmark is not at {folder}; set GLISSON_SHARED_DATA to the folder of the public "
            "data, or take --quick, which needs none."
        )
    return WHOLE, sofa_liver(folder)
