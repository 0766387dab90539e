from dataclasses import replace

import numpy as np
import pytest
from blocks import block
from scipy.spatial.transform import Rotation

from glisson.core import BadInput, Grid, LabelMap, Material, TetMesh
from glisson.core.parameters import parameters_by_kind
from glisson.preoperative.liver.label_segmenter import LabelSegmenter, LabelSegmenterParameters
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.attachments import (
    ATTACHMENT_KINDS,
    BoxAttachment,
    DirectionAttachment,
    ligaments,
    node_sets,
)
from glisson.preoperative.model.model_building import ModelSettings, build_model
from glisson.preoperative.model.regions import element_regions
from glisson.preoperative.scenario.lever_placement import LeverLiftParameters, place_lever
from glisson.preoperative.scenario.manoeuvre import propose_scenario
from preoperative_shapes import LIVER_GRID, ellipsoid, labels_of, mask_of, two_lobes

TUMOUR_MM = np.array([-35.0, 0.0, 5.0])


@pytest.fixture(scope="module")
def built():
    organ = labels_of("liver", two_lobes, LIVER_GRID)
    tumours = labels_of("tumour1", ellipsoid(tuple(TUMOUR_MM), (14.0, 14.0, 14.0)), LIVER_GRID)
    mesher = Mmg(MmgParameters(edge_length_mm=12.0, envelope_mm=0.6))
    extractor = MarchingCubes(MarchingCubesParameters(edge_length_mm=5.0))
    return organ, build_model(organ, tumours, None, extractor, mesher, ModelSettings())


def test_model_of_two_lobes(built):
    organ, (model, report) = built
    assert model.mesh.volume_mm3 == pytest.approx(1e3 * organ.volume_ml("liver"), rel=0.01)
    assert report.volume_error == pytest.approx(model.mesh.volume_mm3 * 1e-3 / report.mask_volume_ml - 1.0)
    assert (model.mesh.corner_volumes_mm3 > 0.0).all()
    assert model.region_names == {0: "liver", 1: "tumour1"}
    assert report.region_elements["liver"] + report.region_elements["tumour1"] == report.quality.elements
    assert report.notes == ()


def test_elements_of_the_tumour_lie_in_it(built):
    _, (model, _) = built
    mesh = model.mesh
    tumour = mesh.region_numbers == 1
    centres = mesh.nodes[mesh.corners].mean(axis=1)
    assert tumour.any()
    assert np.linalg.norm(centres[tumour] - TUMOUR_MM, axis=1).max() < 14.0 + 3.0
    assert mesh.corner_volumes_mm3[tumour].sum() == pytest.approx(4.0 / 3.0 * np.pi * 14.0**3, rel=0.35)


def test_a_material_of_no_region_is_refused(built):
    organ, _ = built
    materials = {"liver": Material("linear-elastic", 13.0, 0.4), "tumor1": Material("linear-elastic", 20.0, 0.4)}
    mesher = Mmg(MmgParameters(edge_length_mm=30.0, envelope_mm=3.0))
    extractor = MarchingCubes(MarchingCubesParameters(edge_length_mm=8.0))
    with pytest.raises(BadInput, match=r"no region 'tumor1' to be of a material; there are \['liver'\]"):
        build_model(organ, None, None, extractor, mesher, ModelSettings(materials))


def test_tumour_is_stiffer_unless_told_otherwise(built):
    _, (model, _) = built
    assert model.materials[1].young_modulus_kpa == 3.0 * model.materials[0].young_modulus_kpa
    liver, tumour = Material("linear-elastic", 13.0, 0.4), Material("linear-elastic", 20.0, 0.4)
    settings = ModelSettings({"liver": liver, "tumours": tumour})
    assert settings.material_of("liver") is liver
    assert settings.material_of("tumour7") is tumour


def test_back_is_held_behind_and_above_but_not_in_the_left_lobe(built):
    _, (model, _) = built
    back = model.mesh.nodes[model.node_set("back")]
    low, high = model.mesh.nodes.min(axis=0), model.mesh.nodes.max(axis=0)
    x, y, z = ((back - low) / (high - low)).T
    assert len(back) > 20
    assert x.max() <= 0.55
    assert (y + z).min() > 0.9
    triangles, _ = model.mesh.boundary()
    assert np.isin(model.node_set("back"), triangles).all()


def test_regions_of_a_block_follow_the_label():
    mesh = block((6, 6, 6), (60.0, 60.0, 60.0))
    grid = Grid((60, 60, 60), [1.0, 1.0, 1.0], [0.5, 0.5, 0.5])
    labels = LabelMap(2 * mask_of(lambda p: p[:, 0] < 30.0, grid).astype(np.uint8), grid, {2: "tumour2"})
    regions, names = element_regions(mesh, labels)
    centres = mesh.nodes[mesh.corners].mean(axis=1)
    np.testing.assert_array_equal(regions == 2, centres[:, 0] < 30.0)
    assert names == {0: "liver", 2: "tumour2"}


def test_attachments_by_box_and_direction():
    mesh = block((4, 4, 4), (40.0, 40.0, 40.0))
    box = BoxAttachment(low_mm=(-1.0, -1.0, -1.0), high_mm=(1.0, 41.0, 41.0), name="side")
    top = DirectionAttachment("top", ("superior",), reach=0.01, left_limit=1.0)
    sets = node_sets(mesh, (box, top))
    assert set(sets["side"]) == set(np.flatnonzero(mesh.nodes[:, 0] == 0.0))
    assert set(sets["top"]) == set(np.flatnonzero(mesh.nodes[:, 2] == 40.0))
    both = node_sets(mesh, (box, DirectionAttachment("side", ("superior",), 0.01, 1.0)))
    assert set(both["side"]) == set(sets["side"]) | set(sets["top"])


def test_attachments_from_tables():
    tables = [
        {"kind": "box", "name": "a", "low_mm": [0, 0, 0], "high_mm": [1, 2, 3]},
        {"name": "b", "directions": ["inferior"], "reach": 0.2},
    ]
    first, second = parameters_by_kind(ATTACHMENT_KINDS, tables, "direction", "case.toml: attachments")
    assert first == BoxAttachment(low_mm=(0.0, 0.0, 0.0), high_mm=(1.0, 2.0, 3.0), name="a")
    assert second == DirectionAttachment("b", ("inferior",), reach=0.2)


def test_an_attachment_with_a_stiffness_gives_way_and_all_others_are_fixed(built):
    _, (model, _) = built
    softer = replace(model, node_sets={**model.node_sets, "dome": model.node_set("back")}, ligaments={"dome": 3.0})
    assert [stage.fixed for stage in propose_scenario(softer).stages] == [("back",), ("back",)]
    assert ligaments((DirectionAttachment("dome", stiffness_kpa_mm=3.0), DirectionAttachment())) == {"dome": 3.0}
    with pytest.raises(BadInput, match="need the same stiffness_kpa_mm"):
        ligaments((DirectionAttachment(stiffness_kpa_mm=3.0), DirectionAttachment()))
    with pytest.raises(BadInput, match="Nothing holds the organ"):
        propose_scenario(replace(model, node_sets={}))


def lowest_gap(lever, mesh: TetMesh) -> float:
    """Smallest height of the organ over the lever's top face, above its footprint (in the lever's own axes)."""
    triangles, _ = mesh.boundary()
    weights = np.random.default_rng(0).dirichlet(np.ones(3), 400)
    points = np.einsum("sc,tci->tsi", weights, mesh.nodes[triangles]).reshape(-1, 3) - lever.hinge_mm
    along, across = points @ lever.arm, points @ lever.axis
    over = (along > 0.0) & (along < lever.length_mm) & (np.abs(across) < lever.width_mm / 2.0)
    return float((points @ lever.up)[over].min())


def test_lever_lies_under_the_left_lobe_and_just_does_not_touch(built):
    _, (model, _) = built
    scenario = propose_scenario(model)
    board, lever = scenario.tools
    low, high = model.mesh.nodes.min(axis=0), model.mesh.nodes.max(axis=0)
    assert 0.6 < lowest_gap(lever, model.mesh) < 1.0
    assert lever.arm[0] > 0.85
    assert lever.up[1] < -0.85
    assert (low + high)[0] / 2.0 < lever.hinge_mm[0] < high[0] - 25.0
    assert lever.hinge_mm[0] + lever.length_mm * lever.arm[0] > high[0]
    np.testing.assert_array_equal(board.normal, [0.0, -1.0, 0.0])
    assert high[1] - 1.0 <= board.point_mm[1] <= high[1]
    first, second = scenario.stages
    assert (first.contact.friction, first.contact.cohesion_kpa) == (0.1, 10.0)
    assert (second.contact.friction, second.contact.cohesion_kpa) == (0.1, 0.0)
    assert first.drives[0].angle_deg == 22.0
    assert second.drives == ()
    assert scenario.scan_supports == ("board",)
    assert scenario.rest_shape == "from-gravity"


@pytest.mark.parametrize(("axis", "along_deg", "across_deg"), [("z", -20.0, 0.0), ("x", 0.0, 20.0)])
def test_lever_follows_a_lobe_that_hangs_in_the_air(built, axis, along_deg, across_deg):
    """A body turned by 20°: the bar's top is laid against the sloping underside, not under the body."""
    _, (model, _) = built
    turned = Rotation.from_euler(axis, -20.0, degrees=True).apply(np.array(model.mesh.nodes))
    mesh = TetMesh(turned, model.mesh.tetrahedra)
    lever = place_lever(mesh, LeverLiftParameters(gap_mm=0.5))
    assert 0.4 < lowest_gap(lever, mesh) < 0.7
    assert np.degrees(np.arctan2(lever.arm[1], lever.arm[0])) == pytest.approx(along_deg, abs=4.0)
    assert np.degrees(np.arctan2(lever.up[2], -lever.up[1])) == pytest.approx(across_deg, abs=6.0)


def test_label_segmenter_fills_pinholes_and_takes_off_crumbs():
    mask = mask_of(two_lobes, LIVER_GRID)
    holed = mask.copy()
    holed[20, 15, 18] = False
    holed[1:3, 1:3, 1:3] = True
    labels = LabelMap(3 * holed.astype(np.uint8), LIVER_GRID, {3: "liver"})
    volume = scan_of(LIVER_GRID)
    found = LabelSegmenter(LabelSegmenterParameters()).segment(volume, labels, np.zeros((0, 3)))
    np.testing.assert_array_equal(found.labels.voxels > 0, mask)
    assert dict(found.labels.names) == {1: "liver"}
    ((k, reason),) = found.flagged_slices
    assert k in (1, 2)
    assert "crumb" in reason
    assert "0.22 ml" in reason


def scan_of(grid: Grid):
    from glisson.core import Volume

    return Volume(np.zeros(grid.shape, dtype=np.int16), grid)
