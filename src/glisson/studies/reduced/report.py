"""What `glisson benchmark reduced` says, for machines and for people."""

from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.studies.reduced.benchmark import Result
from glisson.studies.reduced.following import UPDATES
from glisson.studies.tables import distribution

_ANCHOR = "SOFA's model reduction on the same mesh: 0.62 frames/s full, 262 reduced, without contact or a bound"
_SAME_MM = 0.1


def values_of(result: Result) -> dict[str, Any]:
    """The keys of the design and some beside them."""
    followed, errors = result.followed, result.errors_mm
    own = ~followed.fell_back[:, -1]  # a full answer has no bound
    ratios = followed.bounds_mm[own] / np.maximum(errors[own], 1e-6)
    return {
        "updates_per_s": float(1.0 / followed.seconds.mean()),
        "error_mm": _of_some(errors),
        "bound_violations": int((errors[own] > followed.bounds_mm[own]).sum()),
        "effectivity": _of_some(ratios),
        "fallbacks": float(followed.fell_back.mean()),
        "loads": len(errors),
        "loads_without_answer": int(np.isnan(errors).sum()),
        "fallbacks_at_end": int((~own).sum()),
        "touching": float(result.touching.mean()),
        "tip_mm": _of_some(result.tip_mm),
        "update_ms": _of_some(1e3 * followed.seconds.ravel()),
        "full_seconds": float(np.median(result.full_seconds)),
        "other_branches": int((result.apart_mm > np.maximum(_SAME_MM, 2.0 * followed.bounds_mm.max())).sum()),
        "elements": result.elements,
        "unknowns": result.reduced.size,
        "points": len(result.reduced.points.weights),
        "bound_factor": result.reduced.estimate.factor,
        "seconds": result.seconds,
    }


def text_of(values: dict[str, Any]) -> str:
    """The same for people."""
    error, effectivity = values["error_mm"], values["effectivity"]
    tip, update = values["tip_mm"], values["update_ms"]
    return "\n".join(
        [
            f"updates   {values['updates_per_s']:.0f} a second, bound and fall-backs included (median "
            f"{update['median']:.1f} ms, p95 {update['p95']:.1f}, worst {update['worst']:.0f}); {UPDATES} a load",
            f"loads     {values['loads']}, {100 * values['touching']:.0f} % with a bar; the tip moves by "
            f"{tip['median']:.0f} mm (median), {tip['worst']:.0f} mm at most",
            f"error     {error['median']:.3f} mm median, {error['p95']:.3f} p95, {error['worst']:.3f} worst "
            "(largest of all nodes)",
            f"bound     broken on {values['bound_violations']} loads; {_times(effectivity['median'])} the error in the "
            f"median, {_times(effectivity['p95'])} at p95",
            f"full      {100 * values['fallbacks']:.2f} % of updates fell back to the full model, which takes "
            f"{values['full_seconds']:.1f} s from rest",
            f"model     {values['unknowns']} unknowns, {values['points']} elements",
            "set-up    "
            + ", ".join(f"{name} {seconds:.0f} s" for name, seconds in _grouped(values["seconds"]).items()),
            f"beside    {_ANCHOR}",
        ]
    )


def _grouped(seconds: dict[str, float]) -> dict[str, float]:
    """Stages of the same kind together: their names up to a number."""
    groups: dict[str, float] = {}
    for words, value in seconds.items():
        name = " ".join(part for part in words.split(" of seed")[0].split() if not part[0].isdigit())
        groups[name] = groups.get(name, 0.0) + value
    return groups


def _times(number: float | None) -> str:
    return "an unknown share of" if number is None else f"{number:.1f} times"


def _of_some(numbers: FloatArray) -> dict[str, float] | None:
    """Of those that are numbers."""
    return distribution(numbers[np.isfinite(numbers)].tolist())
