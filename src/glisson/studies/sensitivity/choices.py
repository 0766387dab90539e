"""What is varied: the sizes, laws and parameters of the models, and the truths that they are held against."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import product
from types import MappingProxyType
from typing import Any

SIZES: Mapping[str, int] = MappingProxyType({"coarse": 4459, "normal": 7965, "fine": 18599})
"""Elements of the dissertation's three meshes (section 4.4)."""

LONG_SIZES: Mapping[str, int] = MappingProxyType({**SIZES, "finest": 240_000})
"""With the size of its own simulation (238,795 elements in section 4.3)."""

LEVELS: Mapping[str, tuple[Any, ...]] = MappingProxyType(
    {
        "model": ("neo-hookean", "linear-elastic"),
        "young_modulus_kpa": (700.0, 7.0),
        "poisson_ratio": (0.45, 0.3, 0.49),
        "friction": (0.1, 0.5),
        "cohesion_kpa": (10.0, 0.0),
    }
)
"""What each parameter takes; the first one is the dissertation's (section 4.3)."""


@dataclass(frozen=True)
class Choice:
    """One model: its mesh by name, law and parameters. Friction acts in both stages, cohesion in stage 1."""

    mesh: str
    model: str
    young_modulus_kpa: float
    poisson_ratio: float
    friction: float
    cohesion_kpa: float

    @property
    def parameters(self) -> dict[str, Any]:
        """All but the mesh."""
        values = asdict(self)
        del values["mesh"]
        return values


@dataclass(frozen=True)
class Tissue:
    """What a truth is made of and touched with; the modulus is the parenchyma's mean."""

    young_modulus_kpa: float
    poisson_ratio: float = 0.45
    friction: float = 0.1
    cohesion_kpa: float = 10.0

    def choice(self, mesh: str) -> Choice:
        """The model that knows the truth's parameters, though neither its unevenness nor its attachment."""
        first = LEVELS["model"][0]
        return Choice(mesh, first, self.young_modulus_kpa, self.poisson_ratio, self.friction, self.cohesion_kpa)


STIFF, SOFT = Tissue(700.0), Tissue(7.0)
"""The dissertation's parameters, and a liver as elastography finds it."""


def one_at_a_time(tissue: Tissue, meshes: Mapping[str, int]) -> Iterator[Choice]:
    """The model with a truth's parameters, and those in which one of them is another: what the charts show."""
    for mesh in meshes:
        base = tissue.choice(mesh)
        yield base
        for name, levels in LEVELS.items():
            for level in levels:
                if level != getattr(base, name):
                    yield replace(base, **{name: level})


def all_together(meshes: Mapping[str, int]) -> Iterator[Choice]:
    """Every combination."""
    for mesh, *levels in product(meshes, *LEVELS.values()):
        yield Choice(mesh, *levels)
