"""`glisson register` on the small case: where the tumour is after a known motion, and what is refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core.observations import Observation, Observations
from glisson.framework.case import MODEL, OBSERVATIONS, SCENARIO, Case
from glisson.io.deformation_files import read_deformation
from glisson.io.model_files import read_model
from glisson.io.observation_files import write_observations
from small_case import make_small_case, offer_bending

Glisson = Callable[..., tuple[int, dict[str, Any]]]
TURN = Rotation.from_rotvec([0.4, -0.2, 0.7]).as_matrix()
SHIFT = np.array([120.0, -40.0, 300.0])


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, glisson: Glisson) -> Case:
    offer_bending(monkeypatch)
    made = make_small_case(tmp_path / "case")
    assert glisson("mesh", made.folder)[0] == 0
    return made


def seen(case: Case, scale: float = 1.0) -> Observations:
    """The surface's nodes and the duct, turned and shifted; the duct lies off the ellipsoid's planes of symmetry."""
    model = read_model(case.path(MODEL))
    nodes = model.mesh.nodes[np.unique(model.mesh.boundary()[0])]
    assert model.structures.duct is not None
    swab, wire = (scale * (points @ TURN.T + SHIFT) for points in (nodes, model.structures.duct.points_mm))
    return Observations(
        (Observation("surface", "swab", swab, 0.5, "room"), Observation("curve", "wire", wire, 0.5, "room"))
    )


def test_a_tumour_is_where_the_liver_was_moved_to(case: Case, glisson: Glisson) -> None:
    write_observations(case.path(OBSERVATIONS), seen(case))
    code, said = glisson("register", case.folder, "--technique", "rigid")
    assert (code, said["status"], said["frame"]) == (0, "converged", "room"), said
    model, written = read_model(case.path(MODEL)), read_deformation(said["folder"])
    off = np.linalg.norm(written.mesh.moved(written.displacement) - model.mesh.nodes @ TURN.T - SHIFT, axis=1)
    assert off.max() < 0.5
    tumour = model.structures.tumours[0]
    assert said["tumours"][0]["after_mm"] == pytest.approx(TURN @ tumour.centroid_mm + SHIFT, abs=0.5)
    # It is known about as well as the nodes are: 2.8 standard deviations hold 95 % of a normal distribution in space.
    assert 0.5 < said["tumours"][0]["radius95_mm"] / (2.795 * said["sigma_mm"]) < 1.5


def test_what_cannot_be_registered_is_refused(case: Case, glisson: Glisson, tmp_path: Path) -> None:
    file = tmp_path / "swab.json"
    write_observations(file, seen(case, scale=1e-3))
    code, said = glisson("register", case.folder, "--observations", file)
    assert code == 2
    assert "metres" in said["message"]
    code, said = glisson("register", case.folder, "--observations", tmp_path / "none.json")
    assert code == 2
    write_observations(file, seen(case))
    code, said = glisson("register", case.folder, "--observations", file, "--technique", "rigid", "--strain", "0.1")
    assert code == 2
    assert "strain" in said["message"]
    assert not case.has("results/registered")


def test_where_to_touch_next_is_on_the_side_that_was_seen(case: Case, glisson: Glisson) -> None:
    model = read_model(case.path(MODEL))
    swab, wire = seen(case).items
    scan = (swab.points_mm - SHIFT) @ TURN
    front = replace(swab, points_mm=swab.points_mm[scan[:, 1] < np.percentile(scan[:, 1], 25.0)])
    write_observations(case.path(OBSERVATIONS), Observations((front, wire)))
    code, said = glisson("register", case.folder)
    assert code == 0, said
    written = read_deformation(said["folder"])
    nodes = written.mesh.moved(written.displacement)
    triangles = written.mesh.boundary()[0]
    assert np.linalg.norm(nodes[triangles].mean(axis=1) - said["next_touch_mm"], axis=1).min() < 1e-6
    assert ((np.array(said["next_touch_mm"]) - SHIFT) @ TURN)[1] < model.mesh.nodes[:, 1].mean()
    touch = said["next_touch"]
    assert touch["tumour"] == model.structures.tumours[0].name
    assert 0.0 < touch["rms_after_mm"] < touch["rms_before_mm"]
    write_observations(case.path(OBSERVATIONS), Observations((wire,)))
    assert glisson("register", case.folder, "--technique", "rigid")[1]["next_touch_mm"] is None


def test_frames_follow_one_another(case: Case, glisson: Glisson, tmp_path: Path) -> None:
    files = []
    for number, shift in enumerate((0.0, 3.0)):
        items = tuple(replace(i, points_mm=i.points_mm + shift, time_s=float(number)) for i in seen(case).items)
        files.append(tmp_path / f"frame-{number}.json")
        write_observations(files[-1], Observations(items))
    code, said = glisson("register", case.folder, "--technique", "rigid", "--observations", *files)
    assert code == 0, said
    assert [frame["time_s"] for frame in said["frames"]] == [0.0, 1.0]
    assert said["moved_mm"] == pytest.approx(3.0 * np.sqrt(3.0), abs=0.2)
    assert not said["jumped"]
    write_observations(files[0], Observations(()))
    code, said = glisson("register", case.folder, "--observations", files[0])
    assert code == 2
    assert "holds no observations" in said["message"]


def test_forces_on_a_held_liver_are_found_or_told_why_not(case: Case, glisson: Glisson) -> None:
    """The liver of the small case as it was scanned: nothing pulls at it. In a room nothing is known to hold it."""
    model = read_model(case.path(MODEL))
    nodes = model.mesh.nodes[np.unique(model.mesh.boundary()[0])]
    write_observations(case.path(OBSERVATIONS), Observations((Observation("surface", "swab", nodes, 0.5),)))
    code, said = glisson("register", case.folder, "--technique", "forces", "--loads", "4", "--reach-mm", "5")
    assert (code, said["status"]) == (0, "converged"), said
    written = read_deformation(said["folder"])
    assert np.linalg.norm(written.displacement, axis=1).max() < 0.1
    write_observations(case.path(OBSERVATIONS), seen(case))
    code, said = glisson("register", case.folder, "--technique", "forces", "--loads", "1")
    assert code == 2
    assert "held" in said["message"]
    code, said = glisson("register", case.folder, "--technique", "forces", "--held", "nowhere")
    assert (code, "no node set" in said["message"]) == (2, True)


def test_there_is_nothing_to_adjust_without_a_scenario(case: Case, glisson: Glisson) -> None:
    write_observations(case.path(OBSERVATIONS), seen(case))
    case.path(SCENARIO).unlink(missing_ok=True)
    code, said = glisson("register", case.folder, "--technique", "scenario")
    assert code == 2
    assert "scenario.toml" in said["message"]
