"""The table: each model against each truth, and what each parameter does to the error."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from glisson.studies.point import Outcome
from glisson.studies.sensitivity.choices import Choice, Tissue

MILLIMETRES_PER_PIXEL = 0.5
"""The dissertation's figures are in pixels of its CT."""

Row = Mapping[str, Any]

_FACTORS = ("mesh", "model", "young_modulus_kpa", "poisson_ratio", "friction", "cohesion_kpa")


@dataclass(frozen=True, eq=False)
class Truth:
    """A truth: its kind ("calculix" or "fine-t10"), its true parameters, and what came of it."""

    kind: str
    tissue: Tissue
    outcome: Outcome

    @property
    def name(self) -> str:
        """Kind and stiffness, for people."""
        return f"{self.kind}, {self.tissue.young_modulus_kpa:g} kPa"


def truth_values(truth: Truth) -> dict[str, Any]:
    """What is told of a truth: its parameters, and the error without any correction and with a rigid one."""
    found = truth.outcome
    told = {key: found.values.get(key) for key in ("uncorrected_mm", "rigid_mm", "elements")}
    about = {"status": found.status, "message": found.message, "seconds": found.seconds}
    return {"truth": truth.kind, **asdict(truth.tissue), **told, **about}


def compared(lifts: Sequence[tuple[Choice, int, Outcome]], truths: Sequence[Truth], element: str) -> list[Row]:
    """A row for each lift (choice, elements of its mesh, outcome) and truth.

    `tumour_mm` is the distance between the tumour's centroids after the manoeuvre; None where the lift or
    the truth did not converge.
    """
    return [
        {
            "elements": elements,
            "mesh": choice.mesh,
            "element": element,
            **choice.parameters,
            "truth": truth.kind,
            "truth_young_modulus_kpa": truth.tissue.young_modulus_kpa,
            "tumour_mm": _distance_mm(lift, truth.outcome),
            "status": lift.status,
            "message": lift.message,
            "events": lift.values.get("events", []),
            "seconds": lift.seconds,
        }
        for choice, elements, lift in lifts
        for truth in truths
    ]


def effects(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """For each truth, parameter and level the median error (mm) over all rows that have it, and their number."""
    found = []
    for kind, modulus in dict.fromkeys((row["truth"], row["truth_young_modulus_kpa"]) for row in rows):
        against = [row for row in rows if (row["truth"], row["truth_young_modulus_kpa"]) == (kind, modulus)]
        for factor in _FACTORS:
            for level in dict.fromkeys(row[factor] for row in against):
                errors = [r["tumour_mm"] for r in against if r[factor] == level and r["tumour_mm"] is not None]
                median = float(np.median(errors)) if errors else None
                found.append(
                    {
                        "truth": kind,
                        "truth_young_modulus_kpa": modulus,
                        "parameter": factor,
                        "level": level,
                        "median_mm": median,
                        "rows": len(errors),
                    }
                )
    return found


def _distance_mm(lift: Outcome, truth: Outcome) -> float | None:
    if not (lift.is_good and truth.is_good):
        return None
    return float(np.linalg.norm(np.subtract(lift.values["centroid_mm"], truth.values["centroid_mm"])))
