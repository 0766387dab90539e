"""A case of the twin as a picture: how the liver is deformed, what is seen of it, and the targets inside."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize

from glisson.core.arrays import FloatArray
from glisson.navigation.figures.colours import BLACK, BLUE, ORANGE, PURPLE, VERMILLION, Rgb, displacement_colours
from glisson.navigation.figures.picture import Picture, framed, picture
from glisson.navigation.rendering.bodies import Body
from glisson.navigation.rendering.camera import framing
from glisson.navigation.rendering.ray_casting import cast
from glisson.navigation.rendering.shapes import network
from glisson.phantom.sparse_data.case import SparseCase
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.phantom.sparse_data.liver import FALCIFORM, LEFT_RIDGE, RIGHT_RIDGE, SparseLiver, build_sparse_liver
from glisson.phantom.sparse_data.observing import FRONT
from glisson.studies.point import Outcome, Task
from glisson.studies.registration.truths import PACKAGES, build_case, carry_of

PICTURE = Task(f"{__name__}:picture_of_case", (*PACKAGES, "glisson.navigation", "glisson.studies.registration"))

_COLOURS: Mapping[str, Rgb] = {FRONT: BLACK, FALCIFORM: VERMILLION, LEFT_RIDGE: ORANGE, RIGHT_RIDGE: PURPLE}
_POINT_MM, _TARGET_MM = 1.1, 1.6
_SIZE = (900, 650)
_VIEW, _UP = (0.15, 1.0, 0.35), (0.0, 0.0, 1.0)
"""From in front of the patient, a little from the feet."""


def picture_of_case(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """The fields of a `Picture` as values."""
    design = CaseDesign(**inputs["case"])
    liver = build_sparse_liver(design.member)
    deformed = carry_of(design, folder, inputs["truth"])(liver.surface.vertices)
    return Outcome(asdict(draw_case(build_case(design, folder, inputs["truth"]), liver, deformed)))


def draw_case(case: SparseCase, liver: SparseLiver, deformed: FloatArray) -> Picture:
    """The liver with its surface's vertices at `deformed` (v, 3), before it was moved as a whole."""
    moved = np.linalg.norm(deformed - liver.surface.vertices, axis=1)
    largest = float(np.ceil(moved.max()))
    colours = displacement_colours(largest)
    patient_from_room = case.room_from_patient.inverse()
    seen = {item.name: patient_from_room.apply(item.points_mm) for item in case.observations.items}
    bodies = [Body(deformed, liver.surface.triangles, opacity=0.6, values=moved, palette=colours)]
    bodies.append(_balls(case.deformed_targets_mm, _TARGET_MM, BLUE, inner=True))
    bodies += [_balls(points, _POINT_MM, _COLOURS[name], inner=False) for name, points in seen.items()]
    camera = framing(np.vstack([deformed, *seen.values()]), _VIEW, _UP, _SIZE, border=0.1)
    design = case.design
    title = f"case {design.number} ({design.origin}): {100.0 * case.swab.coverage:.0f} % is seen"
    legend = {"targets": BLUE, **{name: _COLOURS[name] for name in seen}}
    figure, _ = framed(cast(bodies, camera), camera, title, legend)
    bar = figure.add_axes((0.58, 0.925, 0.38, 0.026))
    table = ListedColormap(colours(np.linspace(0.0, largest, 256)))
    shown = figure.colorbar(ScalarMappable(Normalize(0.0, largest), table), cax=bar, orientation="horizontal")
    shown.set_label("displacement from the scanned shape (mm)", fontsize=12.5, labelpad=3)
    wrong = f", {100.0 * design.outlier_share:.0f} % outliers" if design.outlier_share else ""
    return picture(
        figure,
        "3-D picture of a deformed liver with the points seen on its front and the targets inside.",
        f"A case of the twin, seen from the front: noise {design.noise_mm:g} mm{wrong}.",
    )


def _balls(points: FloatArray, radius_mm: float, colour: Rgb, inner: bool) -> Body:
    """Balls at points (n, 3), as very short rods with round ends."""
    count = len(points)
    ends = np.vstack([points, points + [0.01, 0.0, 0.0]])
    edges = np.stack([np.arange(count), count + np.arange(count)], axis=1)
    return Body(*network(ends, np.full(2 * count, radius_mm), edges), colour, inner=inner, ink=False)
