"""The computation of the study: one scan is segmented, scored, spoilt and looked at again."""

from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.image import Grid
from glisson.framework.segmentation_scores import segmentation_scores
from glisson.geometry.distance_map import distance_inside
from glisson.phantom.appearance import draw_ct, draw_mr
from glisson.phantom.body import body_solids
from glisson.phantom.canvas import Canvas, voxel_places
from glisson.phantom.family import assemble, build_anatomy, scan_grid
from glisson.phantom.phantom import Phantom
from glisson.phantom.scan import Anatomy
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.between_lungs import between_lungs
from glisson.preoperative.liver.intensity_prior import IntensityPrior, organ_prior
from glisson.preoperative.liver.reachable import reachable_region
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters
from glisson.preoperative.liver.slice_flags import suspicious_slices
from glisson.studies.point import Outcome, Task
from glisson.studies.segmentation.failures import KINDS, Surroundings, spoilt

EXAMINE = Task(
    f"{__name__}:examine_scan",
    ("glisson.core", "glisson.phantom", "glisson.preoperative", "glisson.framework.segmentation_scores",
     "glisson.studies.segmentation.failures", __name__),
)  # fmt: skip

_NEIGHBOURS = ("heart", "stomach wall", "duodenum", "colon", "spleen", "kidney")
_SOUND, _SOUND_MM2 = 0.1, 200.0
"""A slice is right where no more than this share of its area, or this area, is wrong."""

_NO_CLICK = np.zeros((0, 3))


def examine_scan(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """One scan of the family: `runs` without a click (CT only) and with one, and of a CT what is flagged (`flags`)."""
    member = inputs["member"]
    appearance = (draw_ct if inputs["modality"] == "CT" else draw_mr)(member)
    anatomy = build_anatomy(member)
    phantom = assemble(anatomy, member, scan_grid(inputs["spacing_mm"]), appearance=appearance)
    click = random_click(phantom, member)
    starts = {"one click": click} if inputs["modality"] == "MR" else {"no click": _NO_CLICK, "one click": click}
    values: dict[str, Any] = {
        "phase": appearance.name,
        "noise": appearance.noise,
        "metal": appearance.metal_streaks,
        "gas": appearance.gas_streaks,
        "tumours": len(phantom.tumours.names),
        "runs": [],
        "flags": [],
    }
    found = {}
    for start, seeds in starts.items():
        run, found[start] = _segmented(phantom, seeds)
        values["runs"].append({"start": start, **run})
    if inputs["modality"] == "CT" and (mask := found["one click"]) is not None:
        values["flags"] = _flag_rows(phantom, anatomy, mask)
    return Outcome(values)


def random_click(phantom: Phantom, member: int) -> FloatArray:
    """A click (1, 3), LPS mm, on any voxel of the liver, drawn from the member's number."""
    cells = np.argwhere(phantom.organ.mask("liver"))
    chosen = np.random.default_rng([member, 21]).integers(len(cells))
    return phantom.volume.grid.points_from_indices(cells[[chosen]])


def _segmented(phantom: Phantom, seeds: FloatArray) -> tuple[dict[str, Any], NDArray[np.bool_] | None]:
    """The row of a segmentation, and its mask; a failed one has a message and no scores."""
    started = perf_counter()
    try:
        found = SeededContour(SeededContourParameters()).segment(phantom.volume, None, seeds)
    except StageFailed as error:
        return {"message": str(error)}, None
    seconds = perf_counter() - started
    mask, grid = found.labels.mask("liver"), phantom.volume.grid
    scores = segmentation_scores(mask, phantom.organ.mask("liver"), grid)
    slices = np.flatnonzero(mask.any(axis=(0, 1)))
    return {
        "dice": scores.dice,
        "asd_mm": scores.asd_mm,
        "hd95_mm": scores.hd95_mm,
        "seconds": seconds,
        "slices": len(slices),
        "flagged": len({k for k, _ in found.flagged_slices} & set(slices.tolist())),
        "message": "",
    }, mask


def _flag_rows(phantom: Phantom, anatomy: Anatomy, found: NDArray[np.bool_]) -> list[dict[str, Any]]:
    """For each kind of failure how many of the failed and of the good slices are flagged."""
    grid = phantom.volume.grid
    working = WorkingGrid.of(grid, SeededContourParameters().resolution_mm)
    smooth = smoothed_ct(phantom.volume, working)
    mask, truth = (working.working(one) >= 0.5 for one in (found, phantom.organ.mask("liver")))
    prior = organ_prior(smooth, mask, working.spacing_mm, IntensityPrior(float(np.median(smooth[mask])), 0.0))
    depth = distance_inside(mask, working.spacing_mm)
    a, b, c = (int(place) for place in np.unravel_index(int(np.argmax(depth)), mask.shape))
    thorax = between_lungs(smooth, working, grid)
    region = reachable_region(smooth, prior, working.spacing_mm, [(a, b, c)], thorax=thorax)
    sound = _sound_slices(mask, truth, working.spacing_mm)
    around = Surroundings(
        neighbours=[working.working(one) >= 0.5 for one in neighbour_masks(anatomy, grid)],
        tumours=[working.working(phantom.tumours.mask(name)) >= 0.5 for name in phantom.tumours.names.values()],
        spacing_mm=working.spacing_mm,
    )
    rows = []
    for count, kind in enumerate(KINDS):
        failure = spoilt(kind, mask, around, np.random.default_rng([phantom.seed, 31, count]))
        if failure is not None:
            reasons = suspicious_slices(failure.mask, smooth, prior, around.spacing_mm, region)
            flagged = {k for k, why in reasons.items() if why}
            rows.append(
                {
                    "failure": kind,
                    "failed": len(failure.failed),
                    "failed_flagged": len(failure.failed & flagged),
                    "good": len(failure.good & sound),
                    "good_flagged": len(failure.good & sound & flagged),
                }
            )
    return rows


def _sound_slices(mask: NDArray[np.bool_], truth: NDArray[np.bool_], spacing_mm: FloatArray) -> set[int]:
    """Slices that are right already: a flag on another one is no false alarm, though nothing was put into it."""
    pixel = float(np.prod(spacing_mm[:2]))
    wrong, areas = ((one.sum(axis=(0, 1)) * pixel) for one in (mask ^ truth, truth))
    return set(np.flatnonzero(wrong <= np.maximum(_SOUND * areas, _SOUND_MM2)).tolist())


def neighbour_masks(anatomy: Anatomy, grid: Grid) -> list[NDArray[np.bool_]]:
    """Masks [i, j, k] of the organs beside the liver."""
    canvas = Canvas(grid, np.zeros(grid.shape, dtype=np.float32), voxel_places(grid), 0.0)
    masks = []
    for solid, tissue in body_solids(anatomy.proportions, anatomy.shape):
        if tissue in _NEIGHBOURS:
            box, distance = canvas.distance(solid)
            mask = np.zeros(grid.shape, dtype=bool)
            mask[box] = distance < 0.0
            masks.append(mask)
    return masks
