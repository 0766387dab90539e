"""Model from the masks of a real CT (3D-IRCADb-01, case 17); labels and one click on TotalSegmentator's CT."""

import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy import ndimage
from skimage.measure import marching_cubes

from glisson.core import LabelMap, TriangleSurface
from glisson.geometry.distance import closest_points
from glisson.geometry.normals import vertex_normals
from glisson.io.dicom import read_dicom_mask
from glisson.io.images import read_labels, read_volume
from glisson.io.surfaces import read_surface
from glisson.preoperative.liver.label_segmenter import LabelSegmenter, LabelSegmenterParameters
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters
from glisson.preoperative.meshing.mesh_quality import mesh_quality
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.ligaments import LIGAMENTS
from glisson.preoperative.model.model_building import ModelSettings, build_model
from preoperative_shapes import dice

pytestmark = pytest.mark.real


@pytest.fixture(scope="module")
def masks(ircad: Path) -> dict[str, LabelMap]:
    found = {}
    for name in ("liver", "livertumor1", "livertumor2", "portalvein"):
        image = read_dicom_mask(ircad / "MASKS_DICOM" / name)
        found[name] = LabelMap((np.asarray(image.voxels) > 0).astype(np.uint8), image.grid, {1: name})
    return found


def border_faces(mask: np.ndarray, labels: LabelMap) -> np.ndarray:
    """Centres (n, 3) mm of the voxel faces between inside and outside."""
    centres = []
    for axis in range(3):
        changes = np.argwhere(np.diff(mask, axis=axis)).astype(float)
        changes[:, axis] += 0.5
        centres.append(labels.grid.points_from_indices(changes))
    return np.concatenate(centres)


def test_model_from_masks(masks: dict[str, LabelMap], capsys: pytest.CaptureFixture[str]) -> None:
    grid = masks["liver"].grid
    organ = LabelMap(masks["liver"].voxels, grid, {1: "liver"})
    tumours = np.zeros(grid.shape, dtype=np.uint8)
    for number in (1, 2):
        tumours[masks[f"livertumor{number}"].voxels > 0] = number
    tumour_map = LabelMap(tumours, grid, {1: "tumour1", 2: "tumour2"})
    vessels = LabelMap(masks["portalvein"].voxels, grid, {1: "portal"})
    extractor = MarchingCubes(MarchingCubesParameters())
    mesher = Mmg(MmgParameters(envelope_mm=1.5))
    model, report = build_model(organ, tumour_map, vessels, extractor, mesher, ModelSettings())
    assert abs(report.volume_error) < 0.01
    assert (model.mesh.corner_volumes_mm3 > 0.0).all()
    assert model.mesh.surface().is_closed == (report.quality.pinched_edges == 0)
    assert report.quality.pinched_edges < 10
    assert report.region_elements["tumour1"] > 0 < report.region_elements["tumour2"]
    for tumour in model.structures.tumours:
        assert tumour.volume_mm3 == pytest.approx(1e3 * tumour_map.volume_ml(tumour.name), rel=0.01)
    portal = model.structures.trees[0]
    assert portal.name == "portal"
    # Intrahepatic branches of the first order are 5 to 10 mm wide.
    assert 2.5 < portal.radii_mm.max() < 5.0
    back = model.mesh.nodes[model.node_set("back")]
    middle = model.mesh.nodes.mean(axis=0)
    assert back[:, 2].mean() > middle[2]
    assert back[:, 0].mean() < middle[0]
    with capsys.disabled():
        print(f"\nmesh of 3D-IRCADb-01 case 17: {report.quality}, volume {100.0 * report.volume_error:+.2f} %")


def test_surface_keeps_within_half_a_voxel_of_the_mask(masks: dict[str, LabelMap]) -> None:
    labels = masks["liver"]
    mask = labels.mask("liver")
    surface = MarchingCubes(MarchingCubesParameters()).extract(mask, labels)
    assert surface.is_closed
    assert surface.volume_mm3 == pytest.approx(1e3 * labels.volume_ml("liver"), rel=1e-6)
    faces = border_faces(mask, labels)
    chosen = np.random.default_rng(0).choice(len(faces), 5000, replace=False)
    distance, _ = closest_points(faces[chosen], surface)
    assert np.percentile(distance, 95) < 0.5 * labels.grid.spacing_mm.max()


def test_figures_of_the_mesh(masks: dict[str, LabelMap], capsys: pytest.CaptureFixture[str]) -> None:
    """The mesh's surface keeps to the border halfway between the mask's voxels; in narrow clefts the border is farther
    from the mesh, which is printed beside it."""
    labels = masks["liver"]
    mask, grid = labels.mask("liver"), labels.grid
    surface = MarchingCubes(MarchingCubesParameters()).extract(mask, labels)
    start = time.perf_counter()
    mesh = Mmg(MmgParameters()).mesh(surface)
    seconds = time.perf_counter() - start
    indices, triangles, _, _ = marching_cubes(np.pad(mask.astype(np.float32), 1), 0.5)
    border = TriangleSurface(grid.points_from_indices(indices.astype(np.float64) - 1.0), triangles.astype(np.int64))
    there, back = (
        np.percentile(closest_points(sampled(one), other)[0], 95)
        for one, other in ((mesh.surface(), border), (border, mesh.surface()))
    )
    quality = mesh_quality(mesh)
    volume_error = quality.volume_ml / labels.volume_ml("liver") - 1.0
    with capsys.disabled():
        print(
            f"\nmesh of case 17: volume {100.0 * volume_error:+.2f} %, 95 % of the mesh within {there:.2f} mm of the "
            f"border and of the border within {back:.2f} mm of the mesh, smallest dihedral "
            f"{quality.smallest_dihedral_deg:.1f}°, {quality.elements} elements in {seconds:.1f} s"
        )
    assert abs(volume_error) < 0.005
    assert there < 0.5 * grid.spacing_mm.max()
    assert quality.smallest_dihedral_deg > 5.0


def sampled(surface: TriangleSurface) -> np.ndarray:
    """Points (20000, 3) spread evenly over a surface."""
    points, _ = trimesh.sample.sample_surface(trimesh.Trimesh(surface.vertices, surface.triangles), 20000, seed=0)
    return np.asarray(points)


@pytest.mark.parametrize("patient", ["3D-IRCADb-01 case 17", "SciKit-SurgeryVTK's patient"])
def test_the_hilum_lies_where_the_portal_vein_enters(
    patient: str, request: pytest.FixtureRequest, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if patient.startswith("3D"):
        masks = request.getfixturevalue("masks")
        liver, portal = masks["liver"].mask("liver"), masks["portalvein"].mask("portalvein")
        surface = MarchingCubes(MarchingCubesParameters()).extract(liver, masks["liver"])
        beside = ndimage.binary_dilation(liver) & ~liver & portal
        entrance = masks["liver"].grid.points_from_indices(np.argwhere(beside))
    else:
        folder = shared_data / "open" / "sksurgeryvtk-liver-models" / "Liver"
        surface, vein = (read_surface(folder / f"{name}.vtk") for name in ("liver", "portal_vein"))
        entrance = vein.vertices[closest_points(vein.vertices, surface)[0] < 1.5]
    points = surface.vertices
    chosen = points[LIGAMENTS["hilum"].chosen(points, vertex_normals(points, surface.triangles))]
    apart = np.linalg.norm(chosen.mean(axis=0) - entrance.mean(axis=0))
    with capsys.disabled():
        print(f"\n{patient}: hilum {apart:.0f} mm from the middle of the portal vein's entrance")
    assert apart < 25.0  # half the length of the porta hepatis, some 5 cm


def test_totalsegmentator_labels_and_one_click(shared_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A scan that ends within the liver, without contrast agent, stored with axes that run backwards."""
    folder = shared_data / "open" / "totalsegmentator-example"
    volume = read_volume(folder / "example_ct.nii.gz")
    given = read_labels(folder / "example_seg_fast_force_split.nii.gz", scheme="totalsegmentator")
    organ = LabelSegmenter(LabelSegmenterParameters()).segment(volume, given, np.zeros((0, 3)))
    reference = organ.labels.mask("liver")
    assert any("touches the scan's last layer along axis k" in reason for _, reason in organ.flagged_slices)
    assert organ.labels.volume_ml("liver") == pytest.approx(1126.0, rel=0.01)
    inside = volume.grid.points_from_indices(np.array([[90, 55, 104]]))
    found = SeededContour(SeededContourParameters()).segment(volume, None, inside).labels.mask("liver")
    with capsys.disabled():
        print(f"\nTotalSegmentator's CT from one click: Dice {dice(found, reference):.3f} against its automatic labels")
    assert dice(found, reference) > 0.93
