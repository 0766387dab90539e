"""The table: each model against each truth, and what each parameter does to the error."""

from collections.abc import Iterable, Mapping, Sequence
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


def effects(rows: Sequence[Row], truths: Sequence[Truth]) -> list[dict[str, Any]]:
    """What each parameter does to the error: for each truth, parameter and level two medians (mm).

    `own_mm` is over the meshes, for models that have the truth's parameters otherwise (the charts' bars).
    `matched_mm` is over all models for which there is a converged one with every other level of the
    parameter and the same rest, `matched` in number: so that levels are compared on the same models.
    """
    found = []
    for truth in truths:
        against = [row for row in rows if row["tumour_mm"] is not None and _is_against(row, truth)]
        for factor in _FACTORS:
            own = [row for row in against if _is_own(row, truth, factor)]
            for level, matched in _matched(against, factor).items():
                found.append(
                    {
                        "truth": truth.kind,
                        "truth_young_modulus_kpa": truth.tissue.young_modulus_kpa,
                        "parameter": factor,
                        "level": level,
                        "own_mm": _median(row["tumour_mm"] for row in own if row[factor] == level),
                        "matched_mm": _median(matched),
                        "matched": len(matched),
                    }
                )
    return found


def _is_against(row: Row, truth: Truth) -> bool:
    return (row["truth"], row["truth_young_modulus_kpa"]) == (truth.kind, truth.tissue.young_modulus_kpa)


def _is_own(row: Row, truth: Truth, factor: str) -> bool:
    """Whether a row's model has the truth's parameters but for one."""
    own = truth.tissue.choice(row["mesh"]).parameters
    return all(row[name] == value for name, value in own.items() if name != factor)


def _matched(rows: Sequence[Row], factor: str) -> dict[Any, list[float]]:
    """Errors by level of a parameter, of those models that are there with every level."""
    levels = dict.fromkeys(row[factor] for row in rows)
    families: dict[tuple[Any, ...], dict[Any, float]] = {}
    for row in rows:
        rest = tuple(row[name] for name in _FACTORS if name != factor)
        families.setdefault(rest, {})[row[factor]] = row["tumour_mm"]
    whole = [family for family in families.values() if len(family) == len(levels)]
    return {level: [family[level] for family in whole] for level in levels}


def _median(errors: Iterable[float]) -> float | None:
    found = list(errors)
    return float(np.median(found)) if found else None


def _distance_mm(lift: Outcome, truth: Outcome) -> float | None:
    if not (lift.is_good and truth.is_good):
        return None
    return float(np.linalg.norm(np.subtract(lift.values["centroid_mm"], truth.values["centroid_mm"])))
