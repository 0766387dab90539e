"""The report's pictures, made from what there is."""

from dataclasses import dataclass

from glisson.core.tools import Lever
from glisson.navigation.figures.convergence import convergence_plot
from glisson.navigation.figures.lever_cut import lever_cut
from glisson.navigation.figures.organ_state import OrganState, state_after, state_before, wire_in
from glisson.navigation.figures.organ_views import (
    before_view,
    displacement_view,
    manoeuvre_camera,
    plane_camera,
    plane_view,
)
from glisson.navigation.figures.picture import Picture
from glisson.navigation.figures.slices import slice_views
from glisson.navigation.report_inputs import ReportInputs
from glisson.navigation.survey import Survey


@dataclass(frozen=True)
class ReportFigures:
    """Pictures by section; None or empty where there is nothing to show."""

    manoeuvre: tuple[Picture, ...]
    planes: tuple[Picture, ...]
    cut: Picture | None
    slices: Picture | None
    convergence: Picture | None


def report_figures(inputs: ReportInputs, true: Survey | None) -> ReportFigures:
    """All pictures of a report; `true` is the truth's survey where there is one."""
    deformation, scenario = inputs.deformation, inputs.scenario
    before = state_before(deformation, scenario)
    stages = [state_after(deformation, stage, scenario, f"After {stage.name}") for stage in deformation.stages]
    truth = None
    if inputs.truth is not None and true is not None:
        truth = state_after(inputs.truth, inputs.truth.stages[-1], scenario, "After (truth)")
    return ReportFigures(
        _manoeuvre(inputs, before, stages, truth),
        _planes(inputs, before, stages, truth, true),
        _cut(inputs, before, stages, truth),
        _slices(inputs, before),
        convergence_plot(deformation) if deformation.record else None,
    )


def _manoeuvre(
    inputs: ReportInputs, before: OrganState, stages: list[OrganState], truth: OrganState | None
) -> tuple[Picture, ...]:
    after = stages if truth is None else [*stages, truth]
    camera = manoeuvre_camera([before, *after], inputs.scenario)
    largest = max((float(state.moved_mm.max()) for state in after), default=0.0)
    caption = "The liver as scanned, levers at 0°. L, A, S: the patient's left, front (anterior) and head (superior)."
    pictures = [before_view(before, inputs.model, inputs.scenario, camera, caption)]
    for state in after:
        levers = [
            f"{tool.name} at {state.angles_deg[tool.name]:.1f}°"
            for tool in inputs.scenario.tools
            if isinstance(tool, Lever)
        ]
        told = f"{', '.join([state.title, *levers])}: displacement from A, up to {state.moved_mm.max():.1f} mm."
        pictures.append(displacement_view(state, inputs.model, inputs.scenario, camera, largest, told))
    return tuple(pictures)


def _planes(
    inputs: ReportInputs, before: OrganState, stages: list[OrganState], truth: OrganState | None, true: Survey | None
) -> tuple[Picture, ...]:
    """Before, after, and where it is known truly after: the plane by the rule, else the carried one."""
    told = inputs.guidance.rule or inputs.guidance.carried
    if told is None or not stages:
        return ()
    kind = "by the rule" if told is inputs.guidance.rule else "carried along"
    after = stages[-1]
    camera = plane_camera([before, after], inputs.scenario, told.before)
    states = [(before, told.before, "Before (A)", "Planned resection plane in A.")]
    states.append((after, told.after, "After, simulated", f"The plane {kind}, in the simulated deformation."))
    if truth is not None and true is not None:
        carried = None if true.carried is None else true.carried.plane
        plane = true.rule if told is inputs.guidance.rule else carried
        if plane is not None:
            states.append((truth, plane, "After, truth", f"The plane {kind}, in the true deformation."))
    return tuple(plane_view(s, inputs.model, inputs.scenario, p, camera, title, text) for s, p, title, text in states)


def _cut(
    inputs: ReportInputs, before: OrganState, stages: list[OrganState], truth: OrganState | None
) -> Picture | None:
    if not stages:
        return None
    return lever_cut(
        before, stages[-1], truth, inputs.model, inputs.scenario, inputs.deformation.mesh.nodes.mean(axis=0)
    )


def _slices(inputs: ReportInputs, before: OrganState) -> Picture | None:
    if inputs.volume is None or inputs.organ is None:
        return None
    target = next((t for t in inputs.model.structures.tumours if t.name == inputs.guidance.target), None)
    centre = inputs.deformation.mesh.nodes.mean(axis=0) if target is None else target.centroid_mm
    plane = inputs.guidance.rule or inputs.guidance.carried
    wire = wire_in(before, inputs.model)
    return slice_views(
        inputs.volume,
        inputs.organ,
        inputs.tumours,
        inputs.structures,
        centre,
        None if plane is None else plane.before,
        None if wire is None else wire.points_mm,
    )
