"""`glisson register` on the small case: where the tumour is after a known motion, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core.observations import Observation, Observations
from glisson.framework.case import MODEL, OBSERVATIONS, Case
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


def seen(case: Case, share: float, scale: float = 1.0) -> Observations:
    """The surface nodes of one side, turned and shifted."""
    mesh = read_model(case.path(MODEL)).mesh
    nodes = mesh.nodes[np.unique(mesh.boundary()[0])]
    nodes = nodes[nodes[:, 0] <= np.quantile(nodes[:, 0], share)]
    return Observations((Observation("surface", "swab", scale * (nodes @ TURN.T + SHIFT), 0.5, "room"),))


def test_a_tumour_is_where_the_liver_was_moved_to(case: Case, glisson: Glisson) -> None:
    write_observations(case.path(OBSERVATIONS), seen(case, 1.0))
    code, said = glisson("register", case.folder, "--technique", "rigid")
    model = read_model(case.path(MODEL))
    written = read_deformation(said["folder"])
    there = model.mesh.nodes @ TURN.T + SHIFT
    # The block is its own image after half turns, of which nothing tells which one it was.
    assert (code, said["status"]) in ((0, "converged"), (1, "ambiguous"))
    assert said["frame"] == "room"
    off = np.linalg.norm(written.mesh.moved(written.displacement) - there, axis=1)
    if said["status"] == "converged":
        assert off.max() < 0.5
        tumour = model.structures.tumours[0]
        assert said["tumours"][0]["after_mm"] == pytest.approx(TURN @ tumour.centroid_mm + SHIFT, abs=0.5)
        assert said["tumours"][0]["radius95_mm"] > 0.0


def test_what_cannot_be_registered_is_refused(case: Case, glisson: Glisson, tmp_path: Path) -> None:
    file = tmp_path / "swab.json"
    write_observations(file, seen(case, 1.0, scale=1e-3))
    code, said = glisson("register", case.folder, "--observations", file)
    assert code == 2
    assert "metres" in said["message"]
    code, said = glisson("register", case.folder, "--observations", tmp_path / "none.json")
    assert code == 2
    write_observations(file, seen(case, 1.0))
    code, said = glisson("register", case.folder, "--observations", file, "--technique", "rigid", "--strain", "0.1")
    assert code == 2
    assert "strain" in said["message"]
    assert not case.has("results/registered")
