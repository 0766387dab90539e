"""Layouts designed and surveyed, and the commands."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trocar_views
from glisson.cli.main import main
from glisson.core import BadInput, StageFailed
from glisson.core.crosses import CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.bundle import in_frame_of
from glisson.intraoperative.trocar.layout_design import DesignParameters, design_layout
from glisson.intraoperative.trocar.survey import Distance, survey_layout
from glisson.io.camera_files import write_camera
from glisson.io.layout_files import read_layout, write_layout
from glisson.io.photographs import read_photograph, write_photograph
from trocar_views import CAMERA, ROOM

SMALL = DesignParameters(count=5, views=40, spacing_mm=500.0)


def test_a_designed_layout_is_better_than_any_of_fifty_drawn_ones():
    from glisson.intraoperative.trocar import layout_design

    design = design_layout(ROOM, CAMERA, SMALL, seed=1)
    assert len(design.layout) == 5
    rng = np.random.default_rng(1)
    places = layout_design._places(ROOM, SMALL)
    poses = [ROOM.draw_pose(rng) for _ in range(SMALL.views)]
    table = layout_design._Prediction(places, poses, CAMERA, SMALL, rng)
    draws = np.random.default_rng(2)
    others = [table.tip_errors(list(draws.choice(len(places), 5, replace=False))) for _ in range(50)]
    assert np.log(design.tip_mm).mean() < min(np.log(one).mean() for one in others)


def test_a_room_with_too_few_places_is_told():
    with pytest.raises(BadInput, match="fewer than 15"):
        design_layout(ROOM, CAMERA, DesignParameters(count=15, spacing_mm=2500.0))


@pytest.fixture(scope="module")
def hung():
    """Crosses that hang a little beside their places, prints 0.5 % too large, and eight views."""
    rng = np.random.default_rng(7)
    designed = trocar_views.layout()
    crosses = []
    for cross in designed.crosses:
        pose = cross.room_from_cross
        turned = Rotation.from_rotvec(rng.normal(size=3) * 0.02).as_matrix() @ pose.rotation
        place = RigidTransform("room", "cross", turned, pose.translation_mm + rng.normal(size=3) * 20.0)
        crosses.append(replace(cross, size_mm=402.0, room_from_cross=place))
    layout = CrossLayout(tuple(crosses))
    images = [trocar_views.view(layout, trocar_views.pose(20 + n), n) for n in range(8)]
    return designed, layout, images


def middles(layout):
    return np.array([cross.room_from_cross.translation_mm for cross in layout.crosses])


def test_a_survey_finds_where_crosses_hang(hung):
    designed, true, images = hung
    length = float(np.linalg.norm(middles(true)[3] - middles(true)[1]))
    survey = survey_layout(images, CAMERA, designed, Distance("cross 2", "cross 4", length, 0.5))
    assert survey.size_factor == pytest.approx(1.005, abs=4.0 * survey.size_sigma)
    assert survey.size_sigma < 0.002
    assert survey.notes == ()
    wrong = survey_layout(images, CAMERA, designed, Distance("cross 2", "cross 4", 1.05 * length, 0.5))
    assert "1.05" in wrong.notes[0]
    count = len(true)
    moved = in_frame_of(
        [cross.room_from_cross for cross in designed.crosses],
        [cross.room_from_cross for cross in true.crosses],
        np.zeros((6 * count, 6 * count)),
    )
    for found, place in zip(survey.layout.crosses, moved, strict=True):
        off = found.room_from_cross.translation_mm - place.translation_mm
        sigma = np.sqrt(np.diag(found.room_from_cross.covariance)[3:])
        assert (np.abs(off) < 4.0 * sigma).all()
        assert sigma.max() < 3.0


def test_what_a_survey_cannot_do(hung):
    designed, _, images = hung
    with pytest.raises(StageFailed, match="is not seen beside another in two images"):
        survey_layout([images[0], np.zeros_like(images[0])], CAMERA, designed, Distance("cross 1", "cross 2", 1000.0))
    with pytest.raises(BadInput, match="two images at least"):
        survey_layout(images[:1], CAMERA, designed, Distance("cross 1", "cross 2", 1000.0))
    with pytest.raises(BadInput, match="between two of the crosses"):
        survey_layout(images, CAMERA, designed, Distance("cross 1", "door", 1000.0))
    with pytest.raises(BadInput, match=r"mm apart, not 1.7 mm; give the measured distance of their middles in mm"):
        survey_layout(images, CAMERA, designed, Distance("cross 2", "cross 4", 1.7))
    with pytest.raises(BadInput, match="positive"):
        survey_layout(images, CAMERA, designed, Distance("cross 1", "cross 2", float("nan")))


def test_commands(hung, tmp_path, capfd):
    designed, true, images = hung
    write_camera(tmp_path / "camera.toml", CAMERA)
    write_layout(tmp_path / "designed.toml", designed)
    names = []
    for number, image in enumerate(images):
        names.append(str(tmp_path / f"view{number}.png"))
        write_photograph(names[-1], image)
    length = np.linalg.norm(middles(true)[3] - middles(true)[1])
    given = ["--camera", str(tmp_path / "camera.toml")]
    assert main([
        "layout", "survey", *names, *given, "--layout", str(tmp_path / "designed.toml"), "--distance",
        f"cross 2,cross 4,{length}", "--out", str(tmp_path / "hung.toml"), "--json",
    ]) == 0  # fmt: skip
    assert json.loads(capfd.readouterr().out)["views"] == 8
    assert len(read_layout(tmp_path / "hung.toml")) == 5
    write_layout(tmp_path / "true.toml", true)
    given += ["--layout", str(tmp_path / "true.toml"), "--out", str(tmp_path / "seen.png"), "--json"]
    assert main(["localize", names[0], *given]) == 0
    said = capfd.readouterr()
    assert "localize  running" in said.err
    told = json.loads(said.out)
    assert told["status"] == "converged"
    assert np.array(told["covariance"]).shape == (6, 6)
    assert read_photograph(tmp_path / "seen.png").shape == (544, 640, 3)
    assert len(told["notes"]) == 2
    given[-2] = names[0]
    before = (tmp_path / "view0.png").read_bytes()
    assert main(["localize", names[0], *given]) == 2
    assert "would be overwritten" in json.loads(capfd.readouterr().out)["message"]
    assert (tmp_path / "view0.png").read_bytes() == before
    given[-2] = str(tmp_path / "seen.jpg")
    assert main(["localize", names[0], *given]) == 2
    assert "ends in .png" in json.loads(capfd.readouterr().out)["message"]
    assert main([
        "layout", "survey", *names, *given[:2], "--layout", given[3], "--distance", "cross 2,cross 4,1000", "--out",
        names[3], "--json",
    ]) == 2  # fmt: skip
    assert "would be overwritten" in json.loads(capfd.readouterr().out)["message"]
    given[-2] = str(tmp_path / "seen.png")
    write_photograph(tmp_path / "mirrored.png", images[0][:, ::-1])
    assert main(["localize", str(tmp_path / "mirrored.png"), *given]) == 2
    told = json.loads(capfd.readouterr().out)
    assert (told["status"], told["position_mm"]) == ("bad_input", None)
    write_photograph(tmp_path / "black.png", np.zeros_like(images[0]))
    assert main(["localize", str(tmp_path / "black.png"), *given]) == 1
    assert json.loads(capfd.readouterr().out)["status"] == "unobservable"
    (tmp_path / "text.png").write_text("no picture", encoding="utf-8")
    assert main(["localize", str(tmp_path / "text.png"), *given]) == 2
    assert json.loads(capfd.readouterr().out)["status"] is not None


def test_the_command_that_designs(tmp_path, capfd):
    arguments = ["--count", "3", "--views", "10", "--spacing-mm", "1200", "--out", str(tmp_path / "layout.toml")]
    assert main(["layout", "design", *arguments, "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert (told["crosses"], set(told["tip_mm"])) == (3, {"median", "p95", "worst"})
    assert main(["layout", "design", *arguments, "--distance", "a,b,1"]) == 2
    assert main(["layout", "survey", "--out", str(tmp_path / "x.toml")]) == 2
