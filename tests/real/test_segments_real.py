"""Segments and resections of real livers from their veins and landmarks read off them.

3D-IRCADb-01, case 17, has masks of the portal vein with branches of every segment. SciKit-SurgeryVTK's patient has
surfaces; its portal branches of the segments 2 and 3 are not followed, so that it is divided by planes.
"""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from glisson.core import BadInput, Grid, LabelMap, TriangleSurface
from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.geometry.distance import SurfaceTree
from glisson.io.dicom import read_dicom_mask
from glisson.io.surfaces import read_surface
from glisson.preoperative.segments.dividing_planes import DividingPlanes, DividingPlanesParameters
from glisson.preoperative.segments.nearest_branch import NearestBranch, NearestBranchParameters
from glisson.preoperative.segments.proposal import propose_landmarks
from glisson.preoperative.segments.resections import TABLE_1, ResectionVolumes, resection_volumes
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


SURFACE_LANDMARKS_MM = {
    "portal bifurcation": (-51, -183, -282), "hepatic confluence": (-24, -163, -232),
    "RHV": (-112, -178, -346), "MHV": (-70, -199, -262), "LHV": (19, -183, -252),
    "right fissure": (-85, -173, -280), "gallbladder fossa": (-79, -215, -308), "umbilical fissure": (14, -218, -276),
    "right portal plane": (-74, -170, -289),
    "umbilical portion": (5, -211, -271), "left portal plane": (50, -220, -252),
    "IVC": (-30, -157, -265), "caudate left": (-10, -160, -265), "caudate right": (-48, -160, -265),
    "caudate front": (-30, -182, -265),
}  # fmt: skip
BRANCH_ENDS_MM = {7: (-64, -114, -276), 6: (-94, -148, -308), 8: (-87, -193, -256), 4: (-48, -252, -292)}
"""Ends of the surface model's portal branches far from the hepatic veins, by the segment that they lie in."""


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
    check_table(found, whole)
    for name, number in (("P2", 2), ("P3", 3), ("P4", 4), ("P5", 5), ("P6", 6), ("P7", 7), ("P8", 8)):
        cell = np.rint(grid.indices_from_points(landmarks.points_mm[name])[0]).astype(int)
        assert segments.voxels[tuple(cell)] == number
    with capsys.disabled():
        print_table(divider.name, found)


def check_table(found: dict[str, ResectionVolumes], whole: float) -> None:
    """All of Table 1 is there; volumes add up to the liver, and a resection that takes more leaves less."""
    assert all(variant.name in found for kind in TABLE_1 for variant in kind.variants())
    assert sum(found[f"segment {n}"].removed_ml for n in range(1, 9)) == pytest.approx(whole, rel=1e-9)
    assert all(row.removed_ml + row.remnant_ml == pytest.approx(whole, rel=1e-9) for row in found.values())
    right, left = (found[f"{side} liver resection"].removed_ml for side in ("right", "left"))
    assert right + left + found["segment 1"].removed_ml == pytest.approx(whole, rel=1e-9)
    for smaller, larger in permutations(found.values(), 2):
        if set(smaller.resection.removed) < set(larger.resection.removed):
            assert smaller.removed_ml < larger.removed_ml
            assert smaller.remnant_ml > larger.remnant_ml


def print_table(title: str, found: dict[str, ResectionVolumes]) -> None:
    print(f"\n{title}:")
    for row in found.values():
        print(f"  {row.resection.name:45s} {row.removed_ml:5.0f} ml, remains {100.0 * row.remnant_share:3.0f} %")


@pytest.fixture(scope="module")
def surfaces(shared_data: Path) -> dict[str, TriangleSurface]:
    folder = shared_data / "open" / "sksurgeryvtk-liver-models" / "Liver"
    return {name: read_surface(folder / f"{name}.vtk") for name in ("liver", "portal_vein", "hepatic_veins")}


def filled(surface: TriangleSurface, grid: Grid) -> np.ndarray:
    """Voxels [i, j, k] whose centres lie inside."""
    centres = grid.points_from_indices(np.indices(grid.shape).reshape(3, -1).T.astype(float))
    return SurfaceTree(surface.vertices, surface.triangles).contains(centres).reshape(grid.shape)


def test_resections_of_a_surface_model(surfaces, capsys):
    liver = surfaces["liver"]
    low, high = liver.vertices.min(axis=0) - 3.0, liver.vertices.max(axis=0) + 3.0
    i, j, k = np.ceil((high - low) / 1.5).astype(int)
    grid = Grid((int(i), int(j), int(k)), [1.5, 1.5, 1.5], low)
    organ = LabelMap(filled(liver, grid).astype(np.uint8), grid, {1: "liver"})
    whole = organ.volume_ml("liver")
    assert whole == pytest.approx(1e-3 * liver.volume_mm3, rel=0.001)
    portal, hepatic = (
        tuple(VesselTree(f"{name} {n}", t.points_mm, t.radii_mm, t.edges) for n, t in enumerate(trees))
        for name in ("portal_vein", "hepatic_veins")
        for trees in [centreline_trees(filled(surfaces[name], grid), grid, 10.0)]
    )
    with pytest.raises(BadInput, match="too few branches to propose P2, P3, P4"):
        propose_landmarks(organ, portal, hepatic)
    landmarks = Landmarks({name: np.array([place], dtype=float) for name, place in SURFACE_LANDMARKS_MM.items()})
    segments = DividingPlanes(DividingPlanesParameters()).divide(organ, portal, landmarks)
    found = {row.resection.name: row for row in resection_volumes(segments)}
    check_table(found, whole)
    # The ends of portal branches that are followed lie in their own segments.
    for number, end in BRANCH_ENDS_MM.items():
        assert cKDTree(np.concatenate([tree.points_mm for tree in portal])).query(end)[0] < 3.0
        cell = np.rint(grid.indices_from_points(np.array([end], dtype=float))[0]).astype(int)
        assert segments.voxels[tuple(cell)] == number
    with capsys.disabled():
        print_table("SciKit-SurgeryVTK's patient, planes", found)
