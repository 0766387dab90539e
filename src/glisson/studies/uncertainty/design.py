"""Many livers with few cases each, so that cases are as independent as can be paid for."""

from dataclasses import dataclass

import numpy as np

from glisson.phantom.sparse_data.design import (
    FIRST_MEMBER,
    FIRST_TUNING_MEMBER,
    NOISES_MM,
    OUTLIERS,
    CaseDesign,
    Origin,
)

COVERAGES = ((0.06, 0.12), (0.12, 0.20), (0.20, 0.28), (0.28, 0.36), (0.36, 0.44))
"""Shares of the surface that are seen: the sparse-data study's, and less, where an error bar matters most."""

SPARSE = 2
"""In the first so many ranges little is seen: that is when one asks where to touch next."""

PACKED_VIEWS, BENDS = 3, 7
"""Cases of each liver: views of the liver packed in one way, and bends, each seen once."""

_WITH_OUTLIERS = 4
"""One in so many cases has outliers, by a share in the sparse-data study's range."""

_STREAM = 6


@dataclass(frozen=True)
class UncertaintyDesign:
    """So many livers that are reported, others that the inflation is fitted on, and of each the first few cases."""

    seed: int = 0
    livers: int = 101
    tuning_livers: int = 20
    cases_each: int = PACKED_VIEWS + BENDS

    @property
    def reported(self) -> tuple[int, ...]:
        """Members of the phantom family that are reported."""
        return tuple(range(FIRST_MEMBER, FIRST_MEMBER + self.livers))

    @property
    def tuning(self) -> tuple[int, ...]:
        """Members that are not."""
        return tuple(range(FIRST_TUNING_MEMBER, FIRST_TUNING_MEMBER + self.tuning_livers))

    def cases(self, member: int) -> tuple[CaseDesign, ...]:
        """The cases of a liver, packed and bent in turn while there are both; `bin` counts in `COVERAGES`."""
        kinds: list[tuple[Origin, int]] = []
        for turn in range(BENDS):
            if turn < PACKED_VIEWS:
                kinds.append(("packed", 0))
            kinds.append(("closed-form", turn))
        return tuple(self._case(member, number, *kind) for number, kind in enumerate(kinds[: self.cases_each]))

    def touched(self, member: int) -> tuple[int, ...]:
        """Numbers of a liver's cases that are touched once more: all of which little is seen, and one other."""
        if member not in self.reported:
            return ()
        sparse, other = ([c.number for c in self.cases(member) if (c.bin < SPARSE) == few] for few in (True, False))
        return (*sparse, *other[:1])

    def _case(self, member: int, number: int, origin: Origin, deformation: int) -> CaseDesign:
        random = np.random.default_rng([self.seed, member, number, _STREAM])
        turn = number + member
        coverage, share = random.uniform(*COVERAGES[turn % len(COVERAGES)]), random.uniform(*OUTLIERS)
        noise, wrong = random.choice(NOISES_MM), random.integers(_WITH_OUTLIERS) == 0
        return CaseDesign(
            number, self.seed, member, origin, deformation, turn % len(COVERAGES), float(coverage), float(noise),
            float(share) if wrong else 0.0,
        )  # fmt: skip
