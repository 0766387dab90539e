"""Segments and resections of a real liver (3D-IRCADb-01, case 17) from its veins' masks and landmarks read off them."""

import numpy as np
import pytest

from glisson.core import LabelMap
from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.io.dicom import read_dicom_mask
from glisson.preoperative.segments.dividing_planes import DividingPlanes, DividingPlanesParameters
from glisson.preoperative.segments.nearest_branch import NearestBranch, NearestBranchParameters
from glisson.preoperative.segments.resections import TABLE_1, resection_volumes
from glisson.preoperative.vessels.centrelines import centreline_trees

pytestmark = pytest.mark.real

LANDMARKS_MM = {
    "portal bifurcation": (140, 148, 102), "hepatic confluence": (156, 148, 148),
    "RHV": (90, 180, 95), "MHV": (105, 95, 92), "LHV": (170, 112, 131),
    "right fissure": (85, 160, 40), "gallbladder fossa": (118, 90, 55), "umbilical fissure": (171, 112, 60),
    "right portal plane": (65, 150, 100), "umbilical portion": (172, 105, 120), "left portal plane": (235, 85, 132),
    "IVC": (162, 168, 125), "caudate left": (190, 150, 125), "caudate right": (140, 160, 125),
    "caudate front": (160, 135, 120),
    "P2": (218, 84, 142), "P3": (195, 60, 123), "P4": (162, 70, 92), "P5": (93, 125, 45), "P6": (80, 176, 45),
    "P7": (112, 212, 128), "P8": (84, 105, 122),
}  # fmt: skip


@pytest.fixture(scope="module")
def masks(ircad):
    return {name: read_dicom_mask(ircad / "MASKS_DICOM" / name) for name in ("liver", "portalvein")}


@pytest.mark.parametrize(
    "divider",
    [NearestBranch(NearestBranchParameters()), DividingPlanes(DividingPlanesParameters())],
    ids=lambda d: d.name,
)
def test_resections_of_a_real_liver(masks, divider, capsys):
    grid, mask = masks["liver"].grid, np.asarray(masks["liver"].voxels) > 0
    organ = LabelMap(mask.astype(np.uint8), grid, {1: "liver"})
    trees = centreline_trees((np.asarray(masks["portalvein"].voxels) > 0) & mask, grid, 10.0)
    portal = tuple(VesselTree(f"portal {n}", t.points_mm, t.radii_mm, t.edges) for n, t in enumerate(trees))
    landmarks = Landmarks({name: np.array([place], dtype=float) for name, place in LANDMARKS_MM.items()})
    segments = divider.divide(organ, portal, landmarks)
    found = {row.resection.name: row for row in resection_volumes(segments)}
    whole = organ.volume_ml("liver")
    assert all(variant.name in found for kind in TABLE_1 for variant in kind.variants())
    assert sum(found[f"segment {n}"].removed_ml for n in range(1, 9)) == pytest.approx(whole, rel=1e-9)
    assert all(row.removed_ml + row.remnant_ml == pytest.approx(whole, rel=1e-9) for row in found.values())
    for name, number in (("P2", 2), ("P3", 3), ("P4", 4), ("P5", 5), ("P6", 6), ("P7", 7), ("P8", 8)):
        cell = np.rint(grid.indices_from_points(landmarks.points_mm[name])[0]).astype(int)
        assert segments.voxels[tuple(cell)] == number
    with capsys.disabled():
        print(f"\n{divider.name}:")
        for row in found.values():
            print(f"  {row.resection.name:45s} {row.removed_ml:5.0f} ml, remains {100.0 * row.remnant_share:3.0f} %")
