"""The vertical cut along the lever: outlines, tumour centroid and wire in A and B (Figure II.19)."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.scenario import Scenario
from glisson.core.structures import Plane
from glisson.core.tools import Board, Lever
from glisson.geometry.section import section
from glisson.navigation.figures.colours import BLUE, LEVER, VERMILLION
from glisson.navigation.figures.organ_state import OrganState, wire_in
from glisson.navigation.figures.picture import DOTS_PER_INCH, Picture, new_figure, picture

_WIDTH_PX, _LEAST_HEIGHT_PX, _SHARE = 1060, 350, 0.66
_STYLES: tuple[tuple[Any, str, float], ...] = (
    ("0.55", "dashed", 1.4),
    (BLUE, "solid", 2.0),
    (VERMILLION, "solid", 1.6),
)
"""Colour, line and width of A, of the simulation and of the truth."""


def lever_cut(
    before: OrganState,
    after: OrganState,
    true: OrganState | None,
    model: Model,
    scenario: Scenario,
    centre_mm: FloatArray,
) -> Picture:
    """Cut along the (first) lever's arm and its up direction through the hinge.

    Without a lever the cut is the axial plane through `centre_mm` (3,). Tumour centroids and the wire are
    projected onto the cut.
    """
    lever = next((tool for tool in scenario.tools if isinstance(tool, Lever)), None)
    if lever is None:
        origin, right, up = centre_mm, np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    else:
        origin, right, up = lever.hinge_mm, lever.arm, lever.up
    plane = Plane(origin, np.cross(right, up))
    figure = new_figure(_WIDTH_PX, _LEAST_HEIGHT_PX)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))

    def flat(points: FloatArray) -> FloatArray:
        return np.stack([(points - origin) @ right, (points - origin) @ up], axis=-1)

    names = ("before (A)", "after, simulated", "after, true")
    for state, name, style in zip((before, after, true), names, _STYLES, strict=True):
        if state is not None:
            _draw_state(axes, state, name, style, model, plane, flat)
    if lever is not None:
        _draw_lever(axes, lever, after.angles_deg[lever.name])
    _draw_boards(axes, scenario, plane, flat)
    axes.margins(0.04)
    height = _fitted(figure, axes)
    axes.set_xlabel(
        "along the lever from its hinge (mm)" if lever else "towards the patient's left (mm)", fontsize=11.5
    )
    axes.set_ylabel("up (mm)", fontsize=11.5)
    axes.grid(color="0.9", lw=0.7)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", bbox_to_anchor=(0.74, 0.99), fontsize=11, frameon=False)
    _draw_position(figure, before, plane, 0.38 * _LEAST_HEIGHT_PX / height)
    known = "before, simulated" + (" and true" if true is not None else "")
    return picture(
        figure,
        f"Cut along the lever with outlines of the liver, tumour centroids and wire: {known}.",
        "Vertical cut along the lever (the dissertation's Figure II.19): outlines of the liver, the tumour's centroid "
        "(circle) and the wire projected onto the cut. Right: where the cut is, seen from the front.",
    )


def _fitted(figure: Figure, axes: Axes) -> float:
    """Give the axes equal scales and the figure the height that this takes, which is returned in pixels."""
    axes.autoscale_view()
    across, along = (float(np.ptp(limits)) for limits in (axes.get_xlim(), axes.get_ylim()))
    drawn = min(_SHARE * _WIDTH_PX * along / across, 700.0)
    height = max(drawn + 70.0, _LEAST_HEIGHT_PX)
    figure.set_size_inches(_WIDTH_PX / DOTS_PER_INCH, height / DOTS_PER_INCH)
    axes.set_position((0.06, 1.0 - (drawn + 10.0) / height, _SHARE, drawn / height))
    axes.set_aspect("equal")
    return height


def _draw_state(
    axes: Axes, state: OrganState, name: str, style: tuple[Any, str, float], model: Model, plane: Plane, flat: Any
) -> None:
    colour, line, width = style
    axes.add_collection(LineCollection(list(flat(section(state.surface, plane))), colors=[colour], linewidths=width))
    axes.plot([], [], color=colour, lw=width, label=f"liver {name}")
    axes.update_datalim(flat(section(state.surface, plane)).reshape(-1, 2))
    wire = wire_in(state, model)
    if wire is not None:
        axes.plot(*flat(wire.points_mm).T, color=colour, lw=width, ls=(0, (4, 1.5)), label=f"wire {name}")
    for tumour in model.structures.tumours:
        centroid = type(tumour)(tumour.name, _moved(tumour.surface, state)).centroid_mm
        x, y = flat(centroid)
        axes.plot(x, y, "o", ms=9, mec=colour, mfc="none" if line == "dashed" else colour, mew=1.8, alpha=0.9)


def _moved(surface: Any, state: OrganState) -> Any:
    return type(surface)(state.place(surface.vertices), surface.triangles)


def _draw_lever(axes: Axes, lever: Lever, angle_deg: float) -> None:
    angle = np.radians(angle_deg)
    arm, top = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    end, below = lever.length_mm * arm, -lever.thickness_mm * top
    corners = np.array([np.zeros(2), end, end + below, below])
    axes.fill(
        *corners.T, facecolor=LEVER, edgecolor="0.3", lw=1.0, alpha=0.75, label=f"lever at {angle_deg:.0f}°", zorder=0
    )
    axes.update_datalim(corners)


def _draw_boards(axes: Axes, scenario: Scenario, plane: Plane, flat: Any) -> None:
    """Boards that stand across the cut, as lines."""
    for tool in scenario.tools:
        if not isinstance(tool, Board) or tool.conforming or abs(float(tool.normal @ plane.normal)) > 0.5:
            continue
        along = np.cross(tool.normal, plane.normal)
        point = flat(tool.point_mm - ((tool.point_mm - plane.point_mm) @ plane.normal) * plane.normal)
        direction = flat(tool.point_mm + along) - flat(tool.point_mm)
        axes.axline(point, point + direction, color="0.35", lw=1.2, label=tool.name, zorder=0)


def _draw_position(figure: Figure, before: OrganState, plane: Plane, share: float) -> None:
    """A small front view of the organ with the cut as a line."""
    axes = figure.add_axes((0.76, 0.02, 0.21, share))
    flat = before.surface.vertices[:, [0, 2]]
    axes.add_collection(PolyCollection(list(flat[before.surface.triangles]), facecolors="0.82", edgecolors="none"))
    axes.add_collection(
        LineCollection(list(section(before.surface, plane)[:, :, [0, 2]]), colors=[BLUE], linewidths=1.8)
    )
    axes.update_datalim(flat)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_axis_off()
    for letter, x, y in (("R", -0.04, 0.5), ("L", 1.04, 0.5), ("S", 0.5, 1.0)):
        axes.text(x, y, letter, transform=axes.transAxes, ha="center", va="center", fontsize=11, color="0.3")
