"""The study of trocar poses: what counts as silently wrong, and a small run."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core.transform import RigidTransform
from glisson.studies.point import Outcome
from glisson.studies.trocar.rooms import ANY, RECOMMENDED, SURVEYED, draw_view, errors
from glisson.studies.trocar.study import TrocarStudy
from glisson.studies.trocar.tasks import localise_corners, localise_images


def row(source="corners", layout=RECOMMENDED, visible=4, status="converged", position=0.2, angle=0.01, **more):
    return {
        "source": source, "layout": layout, "number": 0, "visible": visible, "status": status,
        "position_mm": position, "angle_deg": angle, "tip_mm": 2.0 * (position or 0.0), "inside90": True,
        "used": visible, "bound_mm": 1.0, "noise_px": 0.05, "milliseconds": 0.5, "message": "", **more,
    }  # fmt: skip


def test_silent_errors_are_counted_in_all_views_and_flags_where_three_crosses_are_seen():
    study = TrocarStudy(seed=1, images=10, corners=50)
    points = study.points({})
    database = {f"database_{name}": 9.0 for name in ("position_mm", "angle_deg", "tip_mm")}
    rows = [
        row(),
        row(position=6.0, visible=2),
        row(layout=ANY, angle=1.5),
        row(status="ambiguous", position=40.0),
        row(visible=1, status="unobservable", position=None, angle=None) | {"inside90": None, "milliseconds": None},
        row(source="image", database_status="converged", **database),
    ]
    wheel = {"in_room": False, "right": True, "tip_mm": 0.5, "axis_deg": 0.1, "inside90": True, "milliseconds": 50.0,
             "other_size_status": "bad_input", "room_tip_mm": None, "room_inside90": None}  # fmt: skip
    hidden = wheel | dict.fromkeys(("right", "tip_mm", "axis_deg", "inside90"))
    wheels = [
        wheel,
        hidden,
        wheel | {"right": False},
        wheel | {"in_room": True, "room_tip_mm": 1.0, "room_inside90": True},
    ]
    point = next(point for point in points if "in_room" in point.inputs)
    done = {points[0].key: Outcome({"rows": rows}), point.key: Outcome({"rows": wheels})}
    found = study.conclude({}, done)
    values = found.values
    assert (values["views"], values["rendered"], values["silent_wrong"]) == (6, 1, 2)
    assert values["flagged"] == pytest.approx(1.0 / 3.0)
    assert values["position_mm"] == {"median": 0.2, "p95": pytest.approx(0.2 + 0.9 * 5.8), "worst": 6.0}
    assert values["database"]["silent_wrong"] == 1
    assert values["recognised"] == 0.5
    told = values["recognition"]
    assert (told["views"], told["right"], told["wrong"], told["flagged"], told["placed"]) == (4, 2, 1, 1, 1)
    assert told["other_size_flagged"] == 1.0
    assert set(found.files) == {"rows.csv", "instruments.csv", "report.html", "tips.png"}


def test_all_views_are_asked_for_once():
    study = TrocarStudy.of(False, 3)
    points = study.points({})
    views = [
        (p.task.function, p.inputs.get("layout", p.inputs.get("in_room")), n)
        for p in points
        for n in range(p.inputs["first"], p.inputs["first"] + p.inputs["count"])
    ]
    assert len(views) == len(set(views)) == 11_000
    assert sum("images" in function for function, _, _ in views) == 1000
    assert sum("recognise" in function for function, _, _ in views) == 1000


def test_errors_of_a_pose_that_is_turned_by_two_degrees():
    true = RigidTransform("room", "trocar", np.eye(3), np.zeros(3))
    turned = Rotation.from_euler("x", 2.0, degrees=True).as_matrix()
    position, angle, tip = errors(RigidTransform("room", "trocar", turned, [0.0, 0.0, 0.0]), true, 300.0)
    assert position == 0.0
    assert angle == pytest.approx(2.0)
    assert tip == pytest.approx(2.0 * 300.0 * np.sin(np.deg2rad(1.0)))


@pytest.mark.parametrize("layout", [RECOMMENDED, ANY, SURVEYED])
def test_a_few_views(layout):
    inputs = {"stream": 5, "layout": layout, "first": 0}
    rows = localise_corners({**inputs, "count": 60}, Path()).values["rows"]
    rows += localise_images({**inputs, "count": 2}, Path()).values["rows"]
    good = [one for one in rows if one["status"] == "converged"]
    assert len(good) >= (30 if layout == RECOMMENDED else 3)
    assert all(one["position_mm"] < 5.0 and one["angle_deg"] < 1.0 for one in good)
    if layout == RECOMMENDED:
        assert np.median([one["position_mm"] for one in good]) < 1.0


def test_what_is_given_of_a_surveyed_layout_differs_as_its_covariance_says():
    rng = np.random.default_rng(8)
    squares = []
    for _ in range(40):
        view = draw_view(SURVEYED, rng)
        for true, given in zip(view.layout.crosses, view.given_layout.crosses, strict=True):
            off = given.room_from_cross.translation_mm - true.room_from_cross.translation_mm
            squares.append(off @ np.linalg.solve(given.room_from_cross.covariance[3:, 3:], off))
    # A mean of chi² with 3 degrees of freedom over 600 crosses.
    assert np.mean(squares) == pytest.approx(3.0, abs=4.0 * np.sqrt(6.0 / 600.0))
