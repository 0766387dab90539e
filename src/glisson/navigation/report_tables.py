"""What the report says in words and numbers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.guidance import Guidance, PlaneGuidance
from glisson.navigation.survey import Survey

UNKNOWN = "–"


@dataclass(frozen=True)
class Headline:
    """One figure to be read first: what it is, its value, and a few words below it."""

    name: str
    value: str
    remark: str = ""


@dataclass(frozen=True)
class TumourRow:
    """A tumour's motion; errors where the truth is known, `uncorrected_mm` being that of the scan itself."""

    name: str
    is_target: bool
    before_mm: Any
    after_mm: Any
    moved_mm: float
    radius95_mm: float | None
    error_mm: float | None
    uncorrected_mm: float | None


@dataclass(frozen=True)
class PlaneRow:
    """A resection plane's motion and removed parts (fractions)."""

    name: str
    plane: PlaneGuidance
    removed_before: float | None
    removed_after: float | None
    removed_true: float | None


def warnings(deformation: Deformation, guidance: Guidance) -> list[str]:
    """Sentences for the top of the report: events on the way, then what is missing and why."""
    return [event.sentence for event in deformation.events] + list(guidance.notes)


def headlines(guidance: Guidance) -> list[Headline]:
    """The figures to be read first; only those that are known."""
    found = []
    target = next((tumour for tumour in guidance.tumours if tumour.name == guidance.target), None)
    if target is not None:
        moved = float(np.linalg.norm(target.after_mm - target.before_mm))
        error = "" if target.error_mm is None else f"{target.error_mm:.1f} mm from the truth"
        found.append(Headline(f"{target.name} moved by", f"{moved:.1f} mm", error))
    plane = guidance.rule or guidance.carried
    if plane is not None:
        error = "" if plane.error_deg is None else f"{plane.error_deg:.1f}° from the truth"
        found.append(Headline("Plane turned by", f"{plane.angle_deg:.1f}°", error))
    if guidance.volume is not None:
        before, after = 100.0 * guidance.volume.removed_before, 100.0 * guidance.volume.removed_after
        points = None if plane is None else plane.error_points
        error = "" if points is None else f"{points:.1f} points from the truth"
        found.append(Headline("Removed part", f"{before:.1f} → {after:.1f} %", error))
    if guidance.margin_mm is not None:
        remark = "the plane cuts the tumour" if guidance.margin_mm < 0.0 else "tumour surface to carried plane"
        found.append(Headline("Margin", f"{guidance.margin_mm:.1f} mm", remark))
    if guidance.wire is not None:
        inward = "inward" if guidance.wire.slide_mm >= 0.0 else "outward"
        found.append(Headline("Wire tip slid", f"{abs(guidance.wire.slide_mm):.1f} mm", f"{inward} along the duct"))
    return found


def tumour_rows(guidance: Guidance, true: Survey | None) -> list[TumourRow]:
    """One row for each tumour."""
    rows = []
    for tumour in guidance.tumours:
        uncorrected = None
        if true is not None:
            uncorrected = float(np.linalg.norm(true.tumour(tumour.name).centroid_mm - tumour.before_mm))
        moved = float(np.linalg.norm(tumour.after_mm - tumour.before_mm))
        rows.append(
            TumourRow(
                tumour.name,
                tumour.name == guidance.target,
                tumour.before_mm,
                tumour.after_mm,
                moved,
                tumour.radius95_mm,
                tumour.error_mm,
                uncorrected,
            )
        )
    return rows


def plane_rows(guidance: Guidance, found: Survey | None, true: Survey | None) -> list[PlaneRow]:
    """The plane by the rule and the carried one, each where it is known."""
    rows = []
    before = None if found is None else found.removed_before
    if guidance.rule is not None:
        after, known = (None if seen is None else seen.removed_by_rule for seen in (found, true))
        rows.append(PlaneRow("by the rule", guidance.rule, before, after, known))
    if guidance.carried is not None:
        after, known = (None if seen is None else seen.removed_by_carried for seen in (found, true))
        rows.append(PlaneRow("carried", guidance.carried, before, after, known))
    return rows


def number(value: float | None, decimals: int = 1, unit: str = "") -> str:
    """A number with a unit, or a dash where it is not known."""
    if value is None:
        return UNKNOWN
    # Adding zero takes the sign off a number that rounds to nothing.
    return f"{round(value, decimals) + 0.0:.{decimals}f}{unit}".replace("-", "−")


def percent(value: float | None, decimals: int = 1) -> str:
    """A fraction in per cent, or a dash."""
    return UNKNOWN if value is None else number(100.0 * value, decimals, " %")


def point(value: Any) -> str:
    """A place or direction as three numbers."""
    decimals = 3 if np.abs(value).max() <= 1.0 else 1
    return ", ".join(number(float(part), decimals) for part in value)


def scientific(value: float) -> str:
    """A small positive number such as a residual."""
    return f"{value:.1e}".replace("-", "−")


def shortened(value: Any) -> str:
    """A plain value for the provenance table; long hashes are cut to 12 characters."""
    text = UNKNOWN if value is None else str(value)
    is_hash = len(text) >= 32 and all(letter in "0123456789abcdef" for letter in text.rpartition(":")[2])
    return text[: text.rfind(":") + 13] + "…" if is_hash else text


FILTERS = {
    "number": number,
    "percent": percent,
    "point": point,
    "scientific": scientific,
    "shortened": shortened,
}
