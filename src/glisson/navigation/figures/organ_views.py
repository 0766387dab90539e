"""The organ from outside: displacement after each stage (Figures II.17, II.18), planes (Figure II.24)."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.scenario import Scenario
from glisson.core.structures import Plane
from glisson.core.tools import Lever
from glisson.geometry.planes import plane_basis
from glisson.navigation.figures.colours import LIVER, PLANE, REMOVED, displacement_colours, side_colours
from glisson.navigation.figures.organ_state import OrganState, inner_bodies, legend, liver_body, tool_bodies
from glisson.navigation.figures.picture import Picture, framed, picture
from glisson.navigation.rendering.bodies import Body
from glisson.navigation.rendering.camera import Camera, framing
from glisson.navigation.rendering.ray_casting import cast
from glisson.navigation.rendering.shapes import patch

_SIZE = (900, 620)
_PLANE_SIZE = (760, 560)
_PLANE_MARGIN_MM = 12.0


def manoeuvre_camera(states: list[OrganState], scenario: Scenario) -> Camera:
    """One point of view for all states: from the patient's feet, a little from above and from the lifted side."""
    up, arm, along = _directions(scenario)
    return framing(_shown(states, scenario), 0.80 * along - 0.55 * up - 0.35 * arm, up, _SIZE)


def plane_camera(states: list[OrganState], scenario: Scenario, plane: Plane) -> Camera:
    """One point of view for all states that looks at the plane obliquely from the removed side."""
    up, _, along = _directions(scenario)
    side = plane.normal - (plane.normal @ up) * up
    flat = along - (along @ side) * side / max(float(side @ side), 1e-9)
    return framing(_shown(states, scenario), 0.80 * flat - 0.55 * up - 0.62 * side, up, _PLANE_SIZE, border=0.09)


def _directions(scenario: Scenario) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors up, along the lever's arm, and along its axis towards the head."""
    up = np.array([0.0, -1.0, 0.0]) if scenario.surgery_gravity is None else -scenario.surgery_gravity
    for tool in scenario.tools:
        if isinstance(tool, Lever):
            return up, tool.arm, tool.axis if tool.axis[2] >= 0.0 else -tool.axis
    return up, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def _shown(states: list[OrganState], scenario: Scenario) -> FloatArray:
    """Everything that must be in the picture: organ and levers, not the whole board."""
    organs = [state.surface.vertices for state in states]
    tools = [body.vertices for state in states for body in tool_bodies(state, scenario) if body.values is None]
    return np.vstack(organs + tools)


def displacement_view(
    state: OrganState, model: Model, scenario: Scenario, camera: Camera, largest_mm: float, caption: str
) -> Picture:
    """The organ coloured by how far it moved from A, with what lies in it and the tools."""
    colours = displacement_colours(largest_mm)
    liver = liver_body(state, state.moved_mm, colours)
    image = cast([liver, *inner_bodies(state, model), *tool_bodies(state, scenario)], camera)
    figure, _ = framed(image, camera, state.title, legend(model, scenario))
    bar = figure.add_axes((0.58, 0.925, 0.38, 0.026))
    table = ListedColormap(colours(np.linspace(0.0, largest_mm, 256)))
    shown = figure.colorbar(ScalarMappable(Normalize(0.0, largest_mm), table), cax=bar, orientation="horizontal")
    shown.set_label("displacement from A (mm)", fontsize=12.5, labelpad=3)
    bar.tick_params(labelsize=11.5)
    moved = f"up to {state.moved_mm.max():.1f} mm"
    return picture(figure, f"3-D picture of the liver, {state.title}, coloured by displacement, {moved}.", caption)


def before_view(state: OrganState, model: Model, scenario: Scenario, camera: Camera, caption: str) -> Picture:
    """The scanned organ in its own colour."""
    image = cast([liver_body(state), *inner_bodies(state, model), *tool_bodies(state, scenario)], camera)
    figure, _ = framed(image, camera, state.title, {"liver": LIVER, **legend(model, scenario)})
    return picture(figure, "3-D picture of the liver as scanned, with tumour, vessels, wire and tools.", caption)


def plane_view(
    state: OrganState, model: Model, scenario: Scenario, plane: Plane, camera: Camera, title: str, caption: str
) -> Picture:
    """The organ in its two parts with the resection plane between them."""
    sides = plane.distance_mm(state.surface.vertices)
    liver = liver_body(state, sides, side_colours)
    bodies = [liver, plane_body(plane, state.surface.vertices), *inner_bodies(state, model)]
    image = cast([*bodies, *tool_bodies(state, scenario)], camera)
    colours = {"remaining": LIVER, "removed": REMOVED, "resection plane": PLANE}
    figure, _ = framed(image, camera, title, {**colours, **legend(model, scenario)})
    return picture(figure, f"3-D picture, {title}: the resection plane and the parts it leaves and removes.", caption)


def plane_body(plane: Plane, vertices: FloatArray) -> Body:
    """The plane as a translucent rectangle a little larger than the organ's cross-section there."""
    near = vertices[np.abs(plane.distance_mm(vertices)) < 6.0]
    near = near if len(near) >= 3 else vertices
    u, v = plane_basis(plane)
    spread = near - near.mean(axis=0)
    # Principal axes of the cross-section, so that the rectangle sits squarely on it.
    turn = np.linalg.svd(np.stack([spread @ u, spread @ v], axis=1), full_matrices=False)[2]
    a, b = turn[0, 0] * u + turn[0, 1] * v, turn[1, 0] * u + turn[1, 1] * v
    offset = near - plane.point_mm
    low, high = np.array([(offset @ a).min(), (offset @ b).min()]), np.array([(offset @ a).max(), (offset @ b).max()])
    middle, half = (low + high) / 2.0, (high - low) / 2.0 + _PLANE_MARGIN_MM
    centre = plane.point_mm + middle[0] * a + middle[1] * b
    return Body(*patch(centre, half[0] * a, half[1] * b), PLANE, opacity=0.45, smooth=False)
