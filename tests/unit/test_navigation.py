import json

import numpy as np
import pytest
from blocks import bent, block, rotation, sphere

from glisson.core import (
    BadInput,
    Curve,
    Deformation,
    Event,
    Grid,
    LabelMap,
    Material,
    Model,
    Plane,
    StageResult,
    Status,
    Structures,
    TriangleSurface,
    Tumour,
    VesselTree,
)
from glisson.geometry.planes import angle_between_deg
from glisson.geometry.wire import Wire
from glisson.navigation.guidance import navigate
from glisson.navigation.plan import Plan
from glisson.navigation.results import as_results
from glisson.navigation.volumes import label_parts, organ_volume_mm3, removed_volume_mm3

SIZE = (100.0, 40.0, 20.0)
CENTRE, RADIUS = np.array([70.0, 20.0, 10.0]), 6.0
"""The wire runs along x from the mouth at x = 0 through the tumour: the plane by the rule is x = 70 − 6 − 5."""


def model(cells=(10, 4, 2), quadratic=False, **changes) -> Model:
    mesh = block(cells, SIZE)
    parts = {
        "tumours": (Tumour("tumour1", sphere(CENTRE, RADIUS)), Tumour("tumour2", sphere([20.0, 30.0, 10.0], 3.0))),
        "duct": Curve([[0.0, 20.0, 10.0], [30.0, 20.0, 10.0], [90.0, 20.0, 10.0]]),
        "wire_length_mm": 90.0,
        "trees": (vessels(),),
    }
    structures = Structures(**{**parts, **changes})
    return Model(
        mesh.as_quadratic() if quadratic else mesh,
        {0: Material("neo-hookean", 7.0, 0.45)},
        {0: "liver"},
        {},
        structures,
    )


def vessels() -> VesselTree:
    """A trunk along x at y = 10, 4 mm thick at x = 0 and 2 mm at x = 100, with a branch that stays before x = 59."""
    points = [[0.0, 10.0, 10.0], [100.0, 10.0, 10.0], [50.0, 30.0, 10.0]]
    return VesselTree("portal", points, [2.0, 1.0, 0.5], [[0, 1], [0, 2]])


def deformed(of: Model, motion, status=Status.CONVERGED) -> Deformation:
    nodes = of.mesh.nodes
    stage = StageResult("lift", motion(nodes) - nodes, status)
    return Deformation(of.mesh, (stage,), status, status.sentence)


def rigid(axis, degrees, shift, about=(0.0, 0.0, 0.0)):
    turn, about = rotation(axis, np.radians(degrees)), np.asarray(about)
    return lambda points: (points - about) @ turn.T + about + np.asarray(shift)


@pytest.mark.parametrize("quadratic", [False, True])
def test_a_rigid_motion_takes_everything_along(quadratic):
    body, motion = model(quadratic=quadratic), rigid([1, -2, 0.5], 37.0, [5.0, -20.0, 8.0])
    told = navigate(body, deformed(body, motion), Plan())
    turn = rotation([1, -2, 0.5], np.radians(37.0))
    for plane in (told.carried, told.rule):
        assert abs(plane.before.distance_mm([[59.0, 3.0, 4.0]])[0]) < 1e-9
        np.testing.assert_allclose(plane.before.normal, [1.0, 0.0, 0.0], atol=1e-12)
        np.testing.assert_allclose(plane.after.normal, turn @ [1.0, 0.0, 0.0], atol=1e-9)
        assert abs(plane.after.distance_mm(motion(plane.before.point_mm[None]))[0]) < 1e-9
        assert plane.residual_mm < 1e-9
        assert plane.angle_deg == pytest.approx(np.degrees(np.arccos(turn[0, 0])), abs=1e-7)
        assert plane.error_deg is plane.error_mm is plane.error_points is None
    assert told.target == "tumour1"  # the larger one
    np.testing.assert_allclose(told.tumours[0].before_mm, CENTRE, atol=1e-9)
    np.testing.assert_allclose(told.tumours[0].after_mm, motion(CENTRE[None])[0], atol=1e-9)
    assert told.volume.liver_ml == pytest.approx(80.0, rel=1e-12)
    assert told.volume.removed_before == pytest.approx(0.41, rel=1e-9)
    assert told.volume.removed_after == pytest.approx(0.41, rel=1e-9)
    assert told.margin_mm == pytest.approx(5.0, abs=1e-9)
    assert told.wire.slide_mm == pytest.approx(0.0, abs=1e-9)
    assert told.wire.distance_mm == pytest.approx(90.0 - 76.0, abs=1e-9)


def test_a_uniform_stretch_along_the_wire_has_its_closed_form():
    body, stretch = model(), 1.2
    told = navigate(body, deformed(body, lambda p: p * [stretch, 1.0, 1.0]), Plan())
    hilar = stretch * 64.0
    assert told.rule.after.point_mm[0] == pytest.approx(hilar - 5.0, abs=1e-9)
    assert told.carried.after.point_mm[0] == pytest.approx(stretch * 59.0, abs=1e-9)
    assert told.margin_mm == pytest.approx(stretch * 5.0, abs=1e-9)
    assert told.wire.slide_mm == pytest.approx(90.0 - stretch * 90.0, abs=1e-9)  # the tissue leaves the tip behind
    assert 0.0 < told.wire.distance_mm <= stretch * 76.0 - 90.0 + 1e-9  # the tip is now within the tumour
    assert told.volume.removed_before == pytest.approx(0.41, rel=1e-12)
    assert told.volume.removed_after == pytest.approx(1.0 - (hilar - 5.0) / (stretch * 100.0), rel=1e-12)


def test_shortening_slides_the_wire_inward():
    body = model()
    told = navigate(body, deformed(body, lambda p: p * [0.9, 1.0, 1.0]), Plan())
    assert told.wire.slide_mm == pytest.approx(9.0, abs=1e-9)
    assert told.wire.distance_mm == pytest.approx(90.0 - 0.9 * 76.0, abs=1e-9)


def test_a_bend_turns_the_plane_by_the_arc_it_stands_at():
    """Cross-sections of the bent bar stay plane and the wire keeps its length, so both planes turn by 59 / 60 rad."""
    body = model((40, 4, 4), quadratic=True)
    told = navigate(body, deformed(body, bent), Plan())
    for plane in (told.carried, told.rule):
        assert plane.angle_deg == pytest.approx(np.degrees(59.0 / 60.0), abs=0.01)
        expected = bent(np.array([[59.0, 20.0, 10.0]]))
        assert abs(plane.after.distance_mm(expected)[0]) < 2e-3
    assert told.carried.residual_mm < 1e-3
    assert told.wire.slide_mm == pytest.approx(0.0, abs=2e-3)
    # Pappus: a slice of angle dθ has the volume of its centroid's path, which lies on the layer z = 10.
    assert told.volume.removed_after == pytest.approx(0.41, abs=1e-4)


def test_the_same_deformation_on_another_mesh_is_no_error():
    ours, theirs = model((40, 4, 4), quadratic=True), model((30, 5, 3), quadratic=True)
    told = navigate(ours, deformed(ours, bent), Plan(), deformed(theirs, bent))
    assert told.tumours[0].error_mm < 2e-3
    for plane in (told.carried, told.rule):
        assert plane.error_deg < 0.01
        assert plane.error_mm < 5e-3
        assert plane.error_points < 0.01


def test_known_offsets_are_the_errors_told():
    ours, theirs = model(), model((7, 3, 2))
    still = deformed(ours, lambda p: p)
    shifted = navigate(ours, still, Plan(), deformed(theirs, rigid([0, 0, 1], 0.0, [2.0, 3.0, -1.0])))
    assert shifted.tumours[0].error_mm == pytest.approx(np.sqrt(14.0))
    for plane in (shifted.carried, shifted.rule):
        assert plane.error_deg == pytest.approx(0.0, abs=1e-9)
        assert plane.error_mm == pytest.approx(2.0, abs=1e-9)
        assert plane.error_points == pytest.approx(0.0, abs=1e-9)
    turned = navigate(ours, still, Plan(), deformed(theirs, rigid([0, 0, 1], 4.0, [0, 0, 0], about=CENTRE)))
    assert turned.tumours[0].error_mm == pytest.approx(0.0, abs=1e-9)
    for plane in (turned.carried, turned.rule):
        assert plane.error_deg == pytest.approx(4.0, abs=1e-9)
        assert plane.error_mm == pytest.approx(11.0 * (1.0 / np.cos(np.radians(4.0)) - 1.0), abs=1e-9)
    longer = navigate(ours, still, Plan(), deformed(theirs, lambda p: p * [2.0, 1.0, 1.0]))
    assert longer.rule.error_points == pytest.approx(100.0 * abs(0.41 - (1.0 - 123.0 / 200.0)), abs=1e-9)


def test_removed_and_remaining_are_the_whole():
    body = model(quadratic=True)
    nodes = bent(body.mesh.nodes)
    rng = np.random.default_rng(7)
    whole = organ_volume_mm3(body.mesh, nodes)
    for _ in range(5):
        plane = Plane(nodes.mean(axis=0), rng.normal(size=3))
        flipped = Plane(plane.point_mm, -plane.normal)
        parts = removed_volume_mm3(body.mesh, nodes, plane) + removed_volume_mm3(body.mesh, nodes, flipped)
        assert parts == pytest.approx(whole, rel=1e-9)


def test_vessels_that_the_plane_crosses():
    body = model()
    told = navigate(body, deformed(body, rigid([0, 1, 0], 20.0, [1.0, 2.0, 3.0])), Plan())
    (vessel,) = told.crossed
    assert vessel.tree == "portal"
    assert vessel.diameter_mm == pytest.approx(2.0 * (2.0 - 0.59), abs=1e-9)
    np.testing.assert_allclose(vessel.point_mm, [59.0, 10.0, 10.0], atol=1e-9)


def test_a_planned_plane_is_carried_and_its_removed_side_holds_the_target():
    body = model(duct=None, wire_length_mm=None)
    for points in ([[40, 0, 0], [40, 1, 0], [40, 0, 1]], [[40, 0, 0], [40, 0, 1], [40, 1, 0]]):
        told = navigate(body, deformed(body, rigid([0, 0, 1], 10.0, [0, 0, 0])), Plan(plane_points_mm=points))
        np.testing.assert_allclose(told.carried.before.normal, [1.0, 0.0, 0.0], atol=1e-12)
        assert told.carried.angle_deg == pytest.approx(10.0, abs=1e-9)
        assert told.volume.removed_before == told.volume.removed_after == pytest.approx(0.6, rel=1e-9)
        assert told.rule is None
        assert told.wire is None
        assert any("three points" in note for note in told.notes)
        assert any("no wire" in note for note in told.notes)
        other = navigate(body, deformed(body, lambda p: p), Plan("tumour2", plane_points_mm=points))
        assert other.volume.removed_before == pytest.approx(0.4, rel=1e-9)


def test_nothing_is_invented_without_wire_and_plane():
    body = model(duct=None, wire_length_mm=None)
    told = navigate(body, deformed(body, lambda p: p), Plan())
    assert told.carried is told.rule is told.volume is told.wire is told.margin_mm is None
    assert any("Without a wire" in note for note in told.notes)
    bare = model(tumours=())
    told = navigate(bare, deformed(bare, lambda p: p), Plan())
    assert told.target is None
    assert told.tumours == ()
    assert any("Without a tumour" in note for note in told.notes)


def test_notes_say_where_the_rule_had_to_assume():
    def notes(**changes):
        body = model(**changes)
        return " ".join(navigate(body, deformed(body, lambda p: p), Plan()).notes)

    assert "wire" not in notes()
    assert "Before: the wire ends 24.0 mm before the tumour" in notes(wire_length_mm=40.0)
    near = (Tumour("near", sphere([10.0, 20.0, 10.0], RADIUS)),)
    assert "begins 4.0 mm inward of the duct's mouth" in notes(tumours=near)
    away = Curve([[0.0, 20.0, 60.0], [90.0, 20.0, 60.0]])
    assert "never comes nearer to the tumour than 44 mm" in notes(duct=away)
    assert "50 mm outside the liver's mesh" in notes(duct=Curve([[-50.0, 20.0, 10.0], [90.0, 20.0, 10.0]]))


def test_extensions_are_straight():
    body = model(wire_length_mm=40.0)
    told = navigate(body, deformed(body, lambda p: p), Plan())
    assert told.rule.before.point_mm == pytest.approx([59.0, 20.0, 10.0])
    near = model(tumours=(Tumour("near", sphere([6.0, 20.0, 10.0], 4.0)),))
    told = navigate(near, deformed(near, lambda p: p), Plan())
    assert told.rule.before.point_mm == pytest.approx([-3.0, 20.0, 10.0])
    assert told.carried is None
    assert told.volume.removed_after == pytest.approx(1.0)
    assert any("does not meet the liver" in note for note in told.notes)


def test_repeated_points_of_the_duct_change_nothing():
    twice = model(duct=Curve([[0, 20, 10], [0, 20, 10], [30, 20, 10], [30, 20, 10], [90, 20, 10], [90, 20, 10]]))
    told = navigate(twice, deformed(twice, lambda p: p), Plan())
    for plane in (told.rule, told.carried):
        np.testing.assert_allclose(plane.before.point_mm, [59.0, 20.0, 10.0], atol=1e-9)
        assert abs(plane.after.distance_mm([[59.0, 0.0, 0.0]])[0]) < 1e-9


@pytest.mark.parametrize("steps", range(20, 40))
def test_a_wire_as_long_as_its_duct_keeps_its_tip(steps):
    """The sum of a duct's steps and its length differ by rounding, once it has moved."""
    points = np.column_stack([np.linspace(1.3, 59.7, steps), np.full(steps, 20.0), np.full(steps, 10.0)])
    body = model(duct=Curve(points), wire_length_mm=Curve(points).length_mm)
    turn = rigid([1, -2, 0.5], 37.0, [5.0, -20.0, 8.0])
    told = navigate(body, deformed(body, turn), Plan())
    np.testing.assert_allclose(told.rule.after.point_mm, turn(np.array([[59.0, 20.0, 10.0]]))[0], atol=1e-9)


def test_a_curved_wire_is_not_short_cut_by_its_extension():
    """A wire that goes up, across and down beside its own beginning: the tumour lies at its end, not at its mouth."""
    turns = Curve([[30.0, 20.0, 2.0], [30.0, 20.0, 18.0], [80.0, 20.0, 18.0], [80.0, 20.0, 10.0], [60.0, 20.0, 10.0]])
    wire = Wire(turns.points_mm, turns.length_mm)
    arcs, distance = wire.project(np.array([[30.0, 20.0, -5.0], [55.0, 21.0, 10.0], [45.0, 20.0, 19.0]]))
    np.testing.assert_allclose(arcs, [-7.0, turns.length_mm + 5.0, 31.0], atol=1e-9)
    np.testing.assert_allclose(distance, [0.0, 1.0, 1.0], atol=1e-9)


def test_a_failed_solve_keeps_its_status():
    body = model()
    told = navigate(body, deformed(body, lambda p: p, Status.STAGNATED), Plan())
    assert told.status is Status.STAGNATED
    nothing = Deformation(body.mesh, (), Status.SINGULAR, "Nothing holds the liver along x.")
    told = navigate(body, nothing, Plan())
    assert told.status is Status.SINGULAR
    assert told.tumours == ()
    assert told.carried is told.rule is told.volume is told.wire is None
    results = as_results(told, nothing, {})
    assert results["message"] == "Nothing holds the liver along x."
    assert results["tumour"] is results["margin_mm"] is None


def test_a_truth_that_did_not_converge_gives_no_errors():
    body = model()
    still = deformed(body, lambda p: p)
    told = navigate(body, still, Plan(), deformed(body, lambda p: p, Status.STAGNATED))
    assert told.tumours[0].error_mm is None
    assert told.rule.error_deg is None
    assert any("truth did not converge" in note for note in told.notes)


def test_results_are_json_with_the_agreed_keys():
    body = model()
    lost = Event("lost_contact", "lever", 21.0)
    motion = deformed(body, rigid([0, 1, 0], 20.0, [1.0, 2.0, 3.0]))
    motion = Deformation(motion.mesh, motion.stages, motion.status, motion.message, events=(lost,))
    truth = deformed(body, rigid([0, 1, 0], 21.0, [1.0, 2.0, 4.0]))
    for told in (
        navigate(body, motion, Plan(), truth),
        navigate(model(duct=None, wire_length_mm=None), motion, Plan()),
    ):
        results = json.loads(json.dumps(as_results(told, motion, {"solve": 12.5, "mesh": 0}), allow_nan=False))
        assert set(results) >= {"status", "tumours", "tumour", "plane", "volume", "wire", "margin_mm", "elements"}
        assert set(results["tumour"]) >= {"before_mm", "after_mm", "radius95_mm", "error_mm"}
        assert results["status"] == "converged"
        assert results["events"] == [{"kind": "lost_contact", "tool": "lever", "at_deg": 21.0}]
        assert set(results["plane"]) == {"carried", "rule"}
        assert results["volume"]["liver_ml"] == pytest.approx(80.0)
        assert results["elements"] == 480
        assert results["seconds"] == {"solve": 12.5, "mesh": 0.0}
    assert results["wire"] is results["plane"]["rule"] is None


def test_parts_are_labelled_on_the_scan():
    grid = Grid((20, 10, 5), [2.0, 2.0, 2.0], [1.0, 1.0, 1.0])
    organ = np.zeros(grid.shape, dtype=np.uint8)
    organ[2:18, 2:8, 1:4] = 1
    parts = label_parts(LabelMap(organ, grid, {1: "liver"}), Plane([12.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    assert parts.mask("removed").sum() == 12 * 6 * 3
    assert parts.mask("remaining").sum() == 4 * 6 * 3
    assert np.array_equal(parts.voxels > 0, organ > 0)


def test_bad_plans_are_refused_with_a_sentence():
    body = model()
    still = deformed(body, lambda p: p)
    with pytest.raises(BadInput, match=r"not a tumour of the model \(it has: tumour1, tumour2"):
        navigate(body, still, Plan(target="tumour9"))
    with pytest.raises(BadInput, match="one line"):
        Plan(plane_points_mm=[[0, 0, 0], [1, 1, 1], [2, 2, 2]])
    with pytest.raises(BadInput, match="positive"):
        Plan(distance_mm=-1.0)
    with pytest.raises(BadInput, match="does not cut the liver"):
        navigate(body, still, Plan(plane_points_mm=[[-40, 0, 0], [-40, 1, 0], [-40, 0, 1]]))
    with pytest.raises(BadInput, match="wire's length must be positive"):
        navigate(model(wire_length_mm=0.0), still, Plan())
    leaky = sphere(CENTRE, RADIUS)
    leaky = model(tumours=(Tumour("open", TriangleSurface(leaky.vertices, leaky.triangles[1:])),))
    with pytest.raises(BadInput, match="not closed"):
        navigate(leaky, still, Plan())


def test_a_plane_through_the_target_has_a_negative_margin():
    body = model()
    points = [[68.0, 0, 0], [68.0, 1, 0], [68.0, 0, 1]]
    told = navigate(body, deformed(body, lambda p: p), Plan(plane_points_mm=points))
    assert told.margin_mm == pytest.approx(-4.0)
    assert any("cuts through tumour1" in note for note in told.notes)
    assert angle_between_deg(told.carried.before, Plane([68.0, 0, 0], [1.0, 0, 0])) == pytest.approx(0.0)
