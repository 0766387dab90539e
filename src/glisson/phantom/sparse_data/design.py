"""Which cases there are: livers, how each is deformed, and what is seen of it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glisson.core.errors import BadInput

FIRST_MEMBER, FIRST_TUNING_MEMBER = 700, 600
"""Members of the phantom family from here on are reported; sizes and techniques are tuned on others."""

BINS = ((0.20, 0.28), (0.28, 0.36), (0.36, 0.44))
"""Shares of the organ's surface that are seen, as the challenge sorts them."""

NOISES_MM = (0.0, 2.0)
OUTLIERS = (0.05, 0.2)
_WITH_OUTLIERS = 4
"""One in so many cases has outliers, by a share in that range."""

Origin = Literal["packed", "closed-form"]
"""Where a truth comes from: the liver packed from below, by finite elements; or a bend and twist in closed form."""


@dataclass(frozen=True)
class CaseDesign:
    """One case, in plain values. `deformation` counts those of a liver by their origin.

    `coverage` is the share of the surface that is seen, `bin` the number of its range among `BINS`.
    """

    number: int
    seed: int
    member: int
    origin: Origin
    deformation: int
    bin: int
    coverage: float
    noise_mm: float
    outlier_share: float


@dataclass(frozen=True)
class Design:
    """So many livers with `packings` each, seen `views` times, and `bends` over all livers, each seen once.

    By default 112 cases, as many as the challenge has, 24 of them with a truth in closed form.
    """

    seed: int = 0
    first_member: int = FIRST_MEMBER
    livers: int = 11
    packings: int = 2
    views: int = 4
    bends: int = 24

    def __post_init__(self) -> None:
        if min(self.livers, self.views) < 1 or min(self.seed, self.first_member, self.packings, self.bends) < 0:
            raise BadInput(
                "A design of sparse-data cases needs at least one liver and one view, and no negative number."
            )

    @property
    def members(self) -> tuple[int, ...]:
        """The livers."""
        return tuple(range(self.first_member, self.first_member + self.livers))

    def cases(self) -> tuple[CaseDesign, ...]:
        """All cases: the packed ones liver by liver, then those in closed form; bins and noises take turns."""
        packed = [
            (member, deformation)
            for member in self.members
            for deformation in range(self.packings)
            for _ in range(self.views)
        ]
        bent = [(self.members[n % self.livers], n // self.livers) for n in range(self.bends)]
        made = [self._case(n, n, *which, "packed") for n, which in enumerate(packed)]
        return (*made, *(self._case(len(made) + n, n, *which, "closed-form") for n, which in enumerate(bent)))

    def _case(self, number: int, turn: int, member: int, deformation: int, origin: Origin) -> CaseDesign:
        random = np.random.default_rng([self.seed, self.first_member, number, 1])
        bin_number, noise = turn % len(BINS), NOISES_MM[turn // len(BINS) % len(NOISES_MM)]
        wrong = turn // (len(BINS) * len(NOISES_MM)) % _WITH_OUTLIERS == _WITH_OUTLIERS - 1
        coverage, share = random.uniform(*BINS[bin_number]), random.uniform(*OUTLIERS)
        return CaseDesign(
            number, self.seed, member, origin, deformation, bin_number, float(coverage), noise,
            float(share) if wrong else 0.0,
        )  # fmt: skip
