import numpy as np
import pytest
import trimesh

from glisson.core import BadInput, Grid, LabelMap, Model, StageFailed, Status, TetMesh, TriangleSurface, Volume
from glisson.core.parameters import parameters_by_kind
from glisson.preoperative.contours.localized_contour import LocalizedContourParameters, evolve
from glisson.preoperative.liver.label_segmenter import LabelSegmenter, LabelSegmenterParameters
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.attachments import (
    ATTACHMENT_KINDS,
    BoxAttachment,
    node_sets,
)
from glisson.preoperative.model.material_presets import HUMAN_LIVER
from glisson.preoperative.model.model_building import ModelSettings, build_model
from glisson.preoperative.model.structures import build_structures
from glisson.preoperative.scenario.manoeuvre import propose_scenario
from preoperative_shapes import LIVER_GRID, ellipsoid, labels_of, mask_of, two_lobes

NO_SEED = np.zeros((0, 3))
EXTRACTOR = MarchingCubes(MarchingCubesParameters())
MESHER = Mmg(MmgParameters())


def volume_on(grid: Grid, modality: str = "CT", radius: float = 25.0) -> Volume:
    """A ball of 110 HU in fat, in air."""
    points = grid.points_from_indices(np.moveaxis(np.indices(grid.shape), 0, -1).reshape(-1, 3))
    distance = np.linalg.norm(points, axis=1).reshape(grid.shape)
    hu = np.select([distance < radius, distance < radius + 10.0], [110, -90], -1000).astype(np.int16)
    return Volume(hu, grid, modality)


GRID = Grid((40, 40, 40), [2.0, 2.0, 2.0], [-39.0, -39.0, -39.0])


def segment_labels(labels: LabelMap | None, label: str = "liver"):
    return LabelSegmenter(LabelSegmenterParameters(label)).segment(volume_on(GRID), labels, NO_SEED)


def test_a_mask_in_two_parts_is_refused_with_their_sizes_and_places():
    def parts(points):
        return ellipsoid((-20, 0, 0), (12, 12, 12))(points) | ellipsoid((25, 0, 10), (5, 5, 5))(points)

    with pytest.raises(
        BadInput, match=r"2 separate parts \(7\.\d ml at \(-20, 0, 0\) mm; 0\.45 ml at \(25, 0, 10\) mm\)"
    ):
        segment_labels(labels_of("liver", parts, GRID))


@pytest.mark.parametrize(
    ("labels", "label", "sentence"),
    [
        (None, "liver", "needs a label map"),
        (labels_of("liver", lambda p: p[:, 0] > 1e3, GRID), "liver", "mask of 'liver' is empty"),
        (labels_of("spleen", ellipsoid((0, 0, 0), (9, 9, 9)), GRID), "liver", "no label 'liver'"),
        (labels_of("liver", ellipsoid((0, 0, 0), (9, 9, 9)), LIVER_GRID), "liver", "another grid"),
    ],
    ids=["none", "empty", "missing", "grid"],
)
def test_labels_that_cannot_be_used(labels, label, sentence):
    with pytest.raises(BadInput, match=sentence):
        segment_labels(labels, label)


@pytest.mark.parametrize(
    ("seeds", "sentence"),
    [
        ([[500.0, 0.0, 0.0]], r"\(500, 0, 0\) mm lies outside the scan, which has x -39 to 39"),
        ([[38.0, 38.0, 38.0]], r"lies in air \(-\d+ HU\)"),
        ([[0.0, 30.0, 0.0]], r"lies in fat \(-\d+ HU\)"),
    ],
    ids=["outside", "air", "fat"],
)
def test_clicks_that_cannot_be_used(seeds, sentence):
    with pytest.raises(BadInput, match=sentence):
        SeededContour(SeededContourParameters()).segment(volume_on(GRID), None, np.array(seeds))


def test_a_scan_without_anything_like_a_liver_is_told():
    """A ball of fat in air, and one of liver on the left."""
    for x, value in ((-20.0, -90), (20.0, 100)):
        scan = volume_on(LIVER_GRID)
        voxels = np.full(scan.grid.shape, -1000, dtype=np.int16)
        body = mask_of(ellipsoid((0.0, 0.0, 0.0), (38.0, 38.0, 38.0)), scan.grid)
        voxels[body] = -90
        voxels[mask_of(ellipsoid((x, 0.0, 0.0), (15.0, 30.0, 30.0)), scan.grid)] = value
        with pytest.raises(StageFailed, match="No organ like a liver was found"):
            SeededContour(SeededContourParameters()).segment(Volume(voxels, scan.grid), None, NO_SEED)


def test_an_mr_needs_a_click_and_a_click_something_like_a_liver():
    segmenter = SeededContour(SeededContourParameters())
    with pytest.raises(BadInput, match="In an MR the liver is not found without a click"):
        segmenter.segment(volume_on(GRID, "MR"), None, NO_SEED)
    signal = np.where(mask_of(ellipsoid((0, 0, 0), (30, 30, 30)), GRID), 400.0, 8.0).astype(np.float32)
    with pytest.raises(BadInput, match="A click lies in air: the signal there is 2 % of the body's"):
        segmenter.segment(Volume(signal, GRID, "MR"), None, np.full((1, 3), -37.0))
    small = np.full(GRID.shape, -90, dtype=np.int16)
    small[17:23, 17:23, 17:23] = 100
    with pytest.raises(StageFailed, match="ml of like tissue hang together"):
        segmenter.segment(Volume(small, GRID), None, np.zeros((1, 3)))


def test_a_liver_that_the_scan_cuts_is_flagged():
    grid = Grid((56, 56, 28), [2.0, 2.0, 2.0], [-55.0, -55.0, 0.0])
    scan = volume_on(grid, radius=45.0)
    found = SeededContour(SeededContourParameters()).segment(scan, None, np.array([[0.0, 0.0, 10.0]]))
    assert any(k == 0 and "closed there" in reason for k, reason in found.flagged_slices)
    assert any("Unusual volume for a liver: 19" in reason for _, reason in found.flagged_slices)


def test_masks_without_a_surface():
    labels = labels_of("liver", ellipsoid((0, 0, 0), (9, 9, 9)), GRID)
    with pytest.raises(BadInput, match="mask is empty"):
        EXTRACTOR.extract(np.zeros(GRID.shape, dtype=bool), labels)
    with pytest.raises(BadInput, match="has shape"):
        EXTRACTOR.extract(np.ones((3, 3, 3), dtype=bool), labels)


def open_sphere() -> TriangleSurface:
    made = trimesh.creation.icosphere(2, 20.0)
    return TriangleSurface(made.vertices, made.faces[1:])


def inward_sphere() -> TriangleSurface:
    made = trimesh.creation.icosphere(2, 20.0)
    return TriangleSurface(made.vertices, made.faces[:, ::-1])


def flat() -> TriangleSurface:
    vertices = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], dtype=float)
    return TriangleSurface(vertices, [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]])


@pytest.mark.parametrize(
    ("surface", "sentence"),
    [
        (open_sphere(), "open or has edges"),
        (inward_sphere(), "turn them outward"),
        (flat(), "flat|open"),
        (TriangleSurface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "at least four"),
    ],
    ids=["open", "inward", "flat", "one triangle"],
)
def test_surfaces_that_cannot_be_meshed(surface, sentence):
    with pytest.raises(BadInput, match=sentence):
        MESHER.mesh(surface)


def test_meshing_that_takes_too_long_is_given_up():
    made = trimesh.creation.icosphere(5, 100.0)
    slow = Mmg(MmgParameters(edge_length_mm=5.0, envelope_mm=0.3, time_limit_s=1.0))
    with pytest.raises(StageFailed, match="given up after 1 s") as failure:
        slow.mesh(TriangleSurface(made.vertices, made.faces))
    assert failure.value.status is Status.ITERATION_LIMIT


def test_a_plate_thinner_than_the_lattice_is_refused():
    made = trimesh.creation.box((100.0, 100.0, 1.0))
    with pytest.raises(StageFailed, match=r"thinner than the lattice.*smaller envelope_mm"):
        Mmg(MmgParameters(edge_length_mm=16.0, envelope_mm=3.0)).mesh(TriangleSurface(made.vertices, made.faces))


class Shrinking:
    """A mesher whose mesh is 3 % too small."""

    def mesh(self, surface, progress=None, finer=()):
        mesh = Mmg(MmgParameters(edge_length_mm=25.0, envelope_mm=0.4)).mesh(surface)
        return TetMesh(mesh.nodes * 0.99, mesh.tetrahedra)


def test_a_mesh_of_another_volume_than_the_mask_is_refused():
    organ = labels_of("liver", ellipsoid((0, 0, 0), (30, 25, 28)), GRID)
    with pytest.raises(StageFailed, match=r"mesh's volume is -\d\.\d % off the mask's 8\d ml"):
        build_model(organ, None, None, EXTRACTOR, Shrinking(), ModelSettings())


def test_maps_on_different_grids_and_tumours_elsewhere():
    organ = labels_of("liver", ellipsoid((0, 0, 0), (20, 20, 20)), GRID)
    elsewhere = labels_of("tumour1", ellipsoid((30, 0, 0), (8, 8, 8)), GRID)
    with pytest.raises(BadInput, match="different grids"):
        build_model(organ, labels_of("tumour1", two_lobes, LIVER_GRID), None, EXTRACTOR, MESHER, ModelSettings())
    with pytest.raises(BadInput, match="'tumour1' lies mostly outside"):
        build_structures(organ, elsewhere, None)


def test_an_attachment_without_nodes_says_where_the_organ_is():
    made = trimesh.creation.box((10.0, 20.0, 30.0))
    mesh = Mmg(MmgParameters(edge_length_mm=10.0, envelope_mm=0.1)).mesh(TriangleSurface(made.vertices, made.faces))
    away = BoxAttachment(low_mm=(100.0, 0.0, 0.0), high_mm=(120.0, 10.0, 10.0))
    with pytest.raises(BadInput, match=r"'back' holds no node.*x -5 to 5, y -10 to 10, z -15 to 15 mm"):
        node_sets(mesh, (away,))


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ({"kind": "rope"}, "kind must be one of"),
        ({"kind": "box", "low_mm": [0, 0, 0]}, "needs"),
        ({"kind": "box", "low_mm": [0, 0, 5], "high_mm": [1, 1, 1]}, "needs low_mm below high_mm"),
        ({"directions": ["up"]}, "needs directions among"),
        ({"directions": []}, "needs directions among"),
        ({"reach": 2.0}, "reach must"),
        ({"side": 2.0}, "does not know"),
    ],
)
def test_attachment_tables_that_cannot_be_used(table, sentence):
    with pytest.raises(BadInput, match=sentence):
        parameters_by_kind(ATTACHMENT_KINDS, [table], "direction", "case.toml: attachments")


def test_settings_without_a_liver_and_a_model_without_a_back():
    with pytest.raises(BadInput, match="needs a material for 'liver'"):
        ModelSettings({"tumours": HUMAN_LIVER})
    mesh = TetMesh([[0, 0, 0], [30, 0, 0], [0, 30, 0], [0, 0, 30]], [[0, 1, 2, 3]])
    with pytest.raises(BadInput, match="Nothing holds the organ"):
        propose_scenario(Model(mesh, {0: HUMAN_LIVER}, {0: "liver"}, {}))
    with pytest.raises(BadInput, match="offers no underside"):
        propose_scenario(Model(mesh, {0: HUMAN_LIVER}, {0: "liver"}, {"back": np.array([0, 1, 2])}))


def test_contours_that_cannot_start():
    mask = mask_of(ellipsoid((0, 0, 0), (9, 9, 9)), GRID)
    image = np.zeros(GRID.shape)
    for start, spacing in ((mask[:-1], np.ones(3)), (mask, np.ones(2))):
        with pytest.raises(BadInput, match="do not fit"):
            evolve(image, start, spacing, LocalizedContourParameters())
    for start in (np.zeros_like(mask), np.ones_like(mask)):
        with pytest.raises(BadInput, match="neither empty nor the whole"):
            evolve(image, start, np.ones(3), LocalizedContourParameters())
