"""The study of ventilation: phases and residuals of breaths, and the rate from which on the liver stands still."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.studies.page import png
from glisson.studies.point import Outcome, Point
from glisson.studies.study import Conclusion
from glisson.studies.tables import as_csv, distribution
from glisson.studies.ventilation.figures import draw_all
from glisson.studies.ventilation.tasks import BREATHS, CONVENTIONAL, MEASURE, SWEEP
from glisson.studies.ventilation.telling import as_lines, as_page

FIRST_SEED, OF_A_SEED = 5000, 10000
"""Recordings of `--seed N` have seeds from 5000 + 10000 N on; earlier ones served to write the programs."""

WITHIN_HZ = 0.3
_BATCH = 5
_SIMULATED_S, _PIXEL_S = 60.0, 30.0
_FRAMES_PER_S = 25.0


@dataclass(frozen=True)
class VentilationStudy:
    """So many sweeps and recordings of breaths with simulated tracks, and taken all the way from rendered pixels."""

    name: ClassVar[str] = "ventilation"

    seed: int = 0
    sweeps: int = 200
    pixel_sweeps: int = 4
    breaths: int = 40
    pixel_breaths: int = 4
    conventional: int = 2

    @classmethod
    def of(cls, quick: bool, seed: int) -> "VentilationStudy":
        """The quick or the usual form."""
        return cls(seed, 20, 0, 6, 0, 1) if quick else cls(seed)

    def preparations(self) -> Sequence[Point]:
        """How well markers are followed in a rendered video."""
        return [Point(MEASURE, {"seed": self._first})]

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """Simulated sweeps, breaths, conventional ventilation, and what is rendered."""
        (measured,) = prepared.values()
        if not measured.is_good:
            raise StageFailed(f"Markers could not be followed: {measured.message}", Status.STAGNATED)
        noise = measured.values["noise_px"]
        sweeps = [self._sweeps(range(n, min(n + _BATCH, self.sweeps)), noise) for n in range(0, self.sweeps, _BATCH)]
        breaths = [self._breaths(range(n, min(n + 2, self.breaths)), noise) for n in range(0, self.breaths, 2)]
        pixel_sweeps = [self._sweeps([n], None) for n in range(self.pixel_sweeps)]
        pixel_breaths = [self._breaths([n], None) for n in range(self.pixel_breaths)]
        return [
            *sweeps[:1],
            *self._conventional,
            *breaths[:1],
            *sweeps[1:],
            *breaths[1:],
            *pixel_breaths,
            *pixel_sweeps,
        ]

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """What was found against what is true."""
        (measured,) = prepared.values()
        points = self.points(prepared)
        sweeps = _rows(points, done, SWEEP.function)
        breaths = _rows(points, done, BREATHS.function)
        ventilated = [done[point.key] for point in self._conventional if point.key in done]
        good = [outcome.values["displacement_mm"] for outcome in ventilated if outcome.is_good]
        values: dict[str, Any] = {
            "conventional_mm": float(np.mean(good)) if good else None,
            "plateau_hz": [{"true": row["true"], "found": row["found"]} for row in sweeps],
            **_plateaus(sweeps),
            "rates": sweeps[0]["displacements"] if sweeps else [],
            "phase": _breath_errors(breaths),
            "noise_px": measured.values["noise_px"],
            "tracked_per_s": measured.values["frames_per_s"],
            "sweeps": _counted(sweeps),
            "breaths": _counted(breaths),
            "failed": [outcome.message for outcome in done.values() if not outcome.is_good],
            "unfinished": len(points) - len(done),
        }
        shown = draw_all(points, done)
        table = [{name: row[name] for name in row if name not in ("displacements", "true_mm")} for row in sweeps]
        files = {f"{name}.png": png(drawn) for name, drawn in shown.items()} | {
            "sweeps.csv": as_csv(table),
            "report.html": as_page(values, table, tuple(shown.values())),
        }
        return Conclusion(values, "\n".join(as_lines(values)), files)

    @property
    def _first(self) -> int:
        return FIRST_SEED + OF_A_SEED * self.seed

    @property
    def _conventional(self) -> list[Point]:
        recording = {"duration_s": 24.0, "frames_per_s": 12.5}
        return [Point(CONVENTIONAL, {"seed": self._first + n, **recording}) for n in range(self.conventional)]

    def _sweeps(self, numbers: Sequence[int], noise_px: float | None) -> Point:
        seeds = [self._first + n for n in numbers]
        cost = float(len(seeds)) if noise_px is not None else 120.0
        return Point(SWEEP, {"seeds": seeds, "first": self._first, "noise_px": noise_px}, cost)

    def _breaths(self, numbers: Sequence[int], noise_px: float | None) -> Point:
        seeds = [self._first + n for n in numbers]
        duration = _PIXEL_S if noise_px is None else _SIMULATED_S
        recording = {"duration_s": duration, "frames_per_s": _FRAMES_PER_S}
        cost = 4.0 if noise_px is not None else 50.0
        return Point(BREATHS, {"seeds": seeds, "noise_px": noise_px, **recording}, cost)


def _rows(points: Sequence[Point], done: Mapping[str, Outcome], function: str) -> list[dict[str, Any]]:
    """The rows of all points of a task, each told whether it is from pixels."""
    return [
        {"from_pixels": point.inputs["noise_px"] is None, **row}
        for point in points
        if point.task.function == function and point.key in done
        for row in done[point.key].values.get("rows", ())
    ]


def _counted(rows: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    pixels = sum(row["from_pixels"] for row in rows)
    return {"simulated": len(rows) - pixels, "from_pixels": pixels}


def _plateaus(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares over the sweeps: those that a recording can show (`resolvable`), and the others."""
    can = [row for row in rows if row["resolvable"]]
    near = [row["found"] is not None and abs(row["found"] - row["true"]) <= WITHIN_HZ for row in can]
    answered = [row for row in can if row["found"] is not None]
    held = [row["interval"][0] <= row["true"] <= row["interval"][1] for row in answered]
    pixels = [hit for hit, row in zip(near, can, strict=True) if row["from_pixels"]]
    rates = sum(len(row["displacements"]) for row in rows)
    good_rates = sum(row["rates_resolvable"] for row in rows)
    return {
        "found_within": _share(sum(near), len(can)),
        "found_within_from_pixels": _share(sum(pixels), len(pixels)),
        "error_hz": distribution([abs(row["found"] - row["true"]) for row in answered]),
        "interval_holds": _share(sum(held), len(held)),
        "resolvable": len(can),
        "false_flags": _share(len(can) - len(answered), len(can)),
        "unresolvable": len(rows) - len(can),
        "silent_wrong": sum(
            row["found"] is not None and abs(row["found"] - row["true"]) > WITHIN_HZ for row in rows if row not in can
        ),
        "rate_false_flags": _share(sum(row["false_flags"] for row in rows), good_rates),
        "rate_missed_flags": _share(sum(row["missed_flags"] for row in rows), rates - good_rates),
    }


def _breath_errors(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Distributions over recordings: of a recording's worst frame for the phase, its worst phase for the residual."""
    errors: dict[str, Any] = {}
    for name, from_pixels in (("simulated", False), ("from_pixels", True)):
        here = [row for row in rows if row["from_pixels"] == from_pixels and not row["message"]]
        errors[name] = {
            "phase_worst": distribution([row["phase_worst"] for row in here]),
            "residual_mm": distribution([row["residual_mm"] for row in here]),
            "residual_worst_mm": distribution([row["residual_worst_mm"] for row in here]),
            "failed": sum(bool(row["message"]) for row in rows if row["from_pixels"] == from_pixels),
        }
    return errors


def _share(part: int, whole: int) -> float | None:
    return part / whole if whole else None
