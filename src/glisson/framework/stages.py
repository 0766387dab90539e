"""The stages of a case: segment → mesh → scenario (before surgery), simulate → navigate → report."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.errors import BadInput, StageFailed
from glisson.core.protocols import Progress
from glisson.core.status import Status
from glisson.framework.anatomy import VesselsStage
from glisson.framework.case import (
    GUIDANCE,
    MODEL,
    ORGAN,
    PARTS,
    REPORT,
    RESULTS,
    SCAN,
    SCENARIO,
    SETTINGS,
    STRUCTURES,
    TRUTH,
    TUMOURS,
    Case,
)
from glisson.framework.case_warnings import case_warnings
from glisson.framework.pipeline import Pipeline
from glisson.framework.preoperative_stages import MeshStage, ScenarioStage, SegmentStage, labels_of
from glisson.framework.provenance import StageRecord, read_record
from glisson.framework.settings import Settings
from glisson.framework.stage import Stage
from glisson.io.deformation_files import read_deformation, write_deformation
from glisson.io.images import read_labels, read_volume, write_labels
from glisson.io.model_files import read_model
from glisson.io.scenario_files import read_scenario
from glisson.navigation.guidance import navigate
from glisson.navigation.plan import Plan
from glisson.navigation.report import ReportInputs, write_report
from glisson.navigation.results import as_results
from glisson.navigation.volumes import label_parts

_BEFORE_NAVIGATE = ("segment", "mesh", "scenario", "simulate")

DEFORMATION = ("results/deformation.vtu", "results/deformation.json")


class SimulateStage(Stage):
    """What the scenario does to the model."""

    name = "simulate"
    inputs = (MODEL, SCENARIO)
    outputs = DEFORMATION
    packages = ("glisson.mechanics",)

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Parameters of the solver."""
        return asdict(settings.choices["simulate"].all_parameters(SETTINGS, settings.seed))

    def techniques(self, settings: Settings) -> Sequence[tuple[str, str]]:
        """The solver and the material laws."""
        laws = sorted({material.law for material in settings.materials.values()})
        return [("solver", settings.choices["simulate"].technique), *(("material", law) for law in laws)]

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Solve; facts: message, load steps, events, the largest estimated error.

        Raises:
            StageFailed: the solver did not converge.
        """
        solver = settings.choices["simulate"].make(SETTINGS, settings.seed)
        model, scenario = read_model(case.path(MODEL)), read_scenario(case.path(SCENARIO))
        deformation: Deformation = solver.solve(model, scenario, progress)
        if deformation.status is Status.BAD_INPUT:
            raise BadInput(deformation.message)
        if not deformation.status.is_good:
            raise StageFailed(deformation.message or deformation.status.sentence, deformation.status)
        write_deformation(out / RESULTS, deformation)
        error = deformation.estimated_error
        return {
            "status": str(deformation.status),
            "message": deformation.message,
            "load_steps": len(deformation.record),
            "iterations": sum(step.iterations for step in deformation.record),
            "events": [asdict(event) for event in deformation.events],
            "estimated_error_mm": None if error is None else float(error.max()),
        }


class NavigateStage(Stage):
    """What the surgeon is told."""

    name = "navigate"
    inputs = (SCAN, ORGAN, MODEL, *DEFORMATION, TRUTH)
    outputs = (GUIDANCE, PARTS)
    packages = ("glisson.navigation", "glisson.preoperative.imaging")

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Target and plane."""
        return {"target": settings.target, "plane": asdict(settings.plane)}

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Navigate; facts: the whole of `results.json`."""
        deformation = read_deformation(case.path(RESULTS))
        model, truth = read_model(case.path(MODEL)), _truth(case)
        guidance = navigate(model, deformation, plan_of(settings), truth, case_warnings(case))
        seconds = {name: record.seconds for name, record in _records(case).items() if name in _BEFORE_NAVIGATE}
        results = as_results(guidance, deformation, seconds)
        planned = guidance.carried or guidance.rule
        parts = label_parts(read_labels(case.path(ORGAN)), None if planned is None else planned.before)
        write_labels(out / PARTS, parts)
        (out / GUIDANCE).write_text(json.dumps(results, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        return results


class ReportStage(Stage):
    """The report for people."""

    name = "report"
    inputs = (SCAN, ORGAN, TUMOURS, STRUCTURES, MODEL, SCENARIO, *DEFORMATION, GUIDANCE, TRUTH)
    outputs = (REPORT,)
    packages = ("glisson.navigation", "glisson.preoperative.imaging")

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        """Target and plane."""
        return {"target": settings.target, "plane": asdict(settings.plane)}

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        """Write the report; no facts."""
        write_report(out / REPORT, report_inputs(case, settings))
        return {}


def report_inputs(case: Case, settings: Settings) -> ReportInputs:
    """What the report of a case is made of.

    Raises:
        BadInput: a result that it needs is missing or damaged.
    """
    model, deformation, truth = read_model(case.path(MODEL)), read_deformation(case.path(RESULTS)), _truth(case)
    plan, records = plan_of(settings), _records(case)
    return ReportInputs(
        title="Guidance for a liver",
        model=model,
        scenario=read_scenario(case.path(SCENARIO)),
        deformation=deformation,
        guidance=navigate(model, deformation, plan, truth, case_warnings(case)),
        plan=plan,
        volume=read_volume(case.path(SCAN)),
        organ=labels_of(case, ORGAN),
        tumours=labels_of(case, TUMOURS),
        structures=labels_of(case, STRUCTURES),
        truth=truth,
        provenance={name: record.summary() for name, record in records.items()},
        seconds={name: record.seconds for name, record in records.items()},
    )


def plan_of(settings: Settings) -> Plan:
    """The plan that the settings hold."""
    points = settings.plane.points_mm
    return Plan(settings.target, None if points is None else np.array(points), settings.plane.distance_mm)


def _records(case: Case) -> dict[str, StageRecord]:
    """Records of the stages whose results are in the case, in order."""
    found = {stage.name: read_record(case.path(stage.record_name)) for stage in STAGES}
    return {name: record for name, record in found.items() if record is not None}


def _truth(case: Case) -> Deformation | None:
    return read_deformation(case.path(TRUTH)) if case.has(f"{TRUTH}/deformation.json") else None


STAGES: tuple[Stage, ...] = (
    SegmentStage(),
    MeshStage(),
    ScenarioStage(),
    SimulateStage(),
    NavigateStage(),
    ReportStage(),
)
"""From the scan to the report."""

ANATOMY: tuple[Stage, ...] = (VesselsStage(),)
"""What the report does not need: it is made when somebody asks for it."""

PIPELINE = Pipeline((*STAGES, *ANATOMY))
