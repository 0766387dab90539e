import json

import numpy as np
import pytest

from glisson.core import BadInput, Curve, Plane
from glisson.io.markups import NamedPoints, read_curve, read_plane, read_points, write_curve, write_plane, write_points

NORMAL = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])


def markup(path, **values):
    points = [{"id": "1", "label": "a", "position": p, "positionStatus": "defined"} for p in values.pop("points", [])]
    path.write_text(json.dumps({"markups": [{"controlPoints": points, **values}]}))
    return path


def test_round_trips(tmp_path):
    points = NamedPoints(("tip", "Gallenblase"), np.random.default_rng(1).random((2, 3)))
    write_points(tmp_path / "p.mrk.json", points)
    back = read_points(tmp_path / "p.mrk.json")
    assert back.labels == points.labels
    assert np.array_equal(back.points_mm, points.points_mm)
    curve = Curve(np.random.default_rng(2).random((6, 3)))
    write_curve(tmp_path / "c.mrk.json", curve)
    assert np.array_equal(read_curve(tmp_path / "c.mrk.json").points_mm, curve.points_mm)
    plane = Plane([10.0, -20.0, 30.5], NORMAL)
    write_plane(tmp_path / "r.mrk.json", plane)
    back = read_plane(tmp_path / "r.mrk.json")
    assert np.allclose(back.normal, NORMAL, atol=1e-15)
    assert np.array_equal(back.point_mm, plane.point_mm)


def test_the_coordinate_system_is_stated(tmp_path):
    write_curve(tmp_path / "c.mrk.json", Curve([[1, 2, 3], [4, 5, 6]]))
    content = json.loads((tmp_path / "c.mrk.json").read_text())
    assert content["@schema"].endswith("markups-schema-v1.0.3.json#")
    (curve,) = content["markups"]
    assert (curve["coordinateSystem"], curve["coordinateUnits"], curve["type"]) == ("LPS", "mm", "Curve")
    assert [point["position"] for point in curve["controlPoints"]] == [[1, 2, 3], [4, 5, 6]]


def test_a_plane_as_slicer_reads_it(tmp_path):
    """Slicer ignores `normal`: it flips the first two rows of both matrices and takes the third axis."""
    plane = Plane([10.0, -20.0, 30.5], NORMAL)
    write_plane(tmp_path / "r.mrk.json", plane)
    (found,) = json.loads((tmp_path / "r.mrk.json").read_text())["markups"]
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    base_to_node = flip @ np.reshape(found["baseToNode"], (4, 4))
    object_to_base = flip @ np.reshape(found["objectToBase"], (4, 4))
    object_to_node = base_to_node @ object_to_base
    assert np.allclose(object_to_node[:3, 2], NORMAL * [-1, -1, 1], atol=1e-12)  # in RAS
    assert np.allclose(object_to_node[:3, 3], plane.point_mm * [-1, -1, 1], atol=1e-12)
    assert np.allclose(object_to_node[:3, :3].T @ object_to_node[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(object_to_node[:3, :3]) == pytest.approx(1.0)
    assert found["planeType"] == "pointNormal"


@pytest.mark.parametrize(("stated", "sign"), [("LPS", 1), ("RAS", -1), (1, 1), (0, -1), ("1", 1), ("0", -1)])
def test_both_systems_and_the_old_numbers(tmp_path, stated, sign):
    path = markup(tmp_path / "a.mrk.json", type="Fiducial", coordinateSystem=stated, points=[[1.0, 2.0, 3.0]])
    assert read_points(path).points_mm.tolist() == [[sign * 1.0, sign * 2.0, 3.0]]
    path = markup(
        tmp_path / "b.mrk.json", type="Plane", coordinateSystem=stated, center=[1.0, 2.0, 3.0], normal=[1.0, 0, 0]
    )
    assert read_plane(path).normal.tolist() == [sign * 1.0, 0.0, 0.0]
    assert read_plane(path).point_mm.tolist() == [sign * 1.0, sign * 2.0, 3.0]


def test_units_and_points_not_yet_placed(tmp_path):
    path = markup(
        tmp_path / "a.mrk.json",
        type="Line",
        coordinateSystem="LPS",
        coordinateUnits="um",
        points=[[0, 0, 0], [1000.0, 0, 0]],
    )
    assert read_curve(path).length_mm == pytest.approx(1.0)
    path = markup(
        tmp_path / "b.mrk.json",
        type="Fiducial",
        coordinateSystem="LPS",
        coordinateUnits=["mm", "UCUM", "millimeter"],
        points=[[1, 2, 3]],
    )
    content = json.loads(path.read_text())
    content["markups"][0]["controlPoints"].append({"positionStatus": "undefined", "position": [0, 0, 0]})
    path.write_text(json.dumps(content))
    assert len(read_points(path).labels) == 1


def test_a_plane_of_three_points(tmp_path):
    path = markup(
        tmp_path / "a.mrk.json", type="Plane", coordinateSystem="LPS", points=[[0, 0, 5], [2, 0, 5], [0, 3, 5]]
    )
    assert read_plane(path).normal.tolist() == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"type": "Plane", "center": [0, 0, 0], "normal": [0, 0, 1]}, "does not state its coordinate system"),
        ({"type": "Plane", "coordinateSystem": "IJK"}, "'IJK' is neither LPS nor RAS"),
        ({"type": "Plane", "coordinateSystem": True}, "True is neither LPS nor RAS"),
        ({"type": "Plane", "coordinateSystem": "LPS", "coordinateUnits": "inch"}, "'inch' is neither mm nor um"),
        ({"type": "Plane", "coordinateSystem": "LPS", "points": [[0, 0, 0]]}, "needs three points, not 1"),
        ({"type": "Plane", "coordinateSystem": "LPS", "points": [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}, "lie on a line"),
        ({"type": "Plane", "coordinateSystem": "LPS", "center": [0, 0], "normal": [0, 0, 1]}, "center must be numbers"),
        ({"type": "Plane", "coordinateSystem": "LPS", "center": [0, 0, 0], "normal": [0, 0, 0]}, "zero vector"),
        ({"type": "Fiducial", "coordinateSystem": "LPS"}, "holds no Plane, only ['Fiducial']"),
    ],
)
def test_unusable_planes(tmp_path, values, complaint):
    with pytest.raises(BadInput) as caught:
        read_plane(markup(tmp_path / "a.mrk.json", **values))
    assert complaint in str(caught.value)


def test_the_ending_matters(tmp_path):
    with pytest.raises(BadInput, match=r"ending \.mrk\.json"):
        write_plane(tmp_path / "a.json", Plane([0, 0, 0], [0, 0, 1]))
