"""Frames in sequence: followed, missing, late, jumping, refused; and observations that contradict each other."""

from dataclasses import replace

import numpy as np
import pytest
from lumps import lump_model, prepared, registered, seen_surface
from scipy.spatial.transform import Rotation

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.observations import Observation, Observations
from glisson.core.status import Status
from glisson.mechanics.registration.following import Followed, Following


@pytest.fixture(scope="module")
def model() -> Model:
    return lump_model()


def moved(model: Model, time_s: float) -> FloatArray:
    """The nodes on a known path: 4 mm and 3° a second, from far away in the room."""
    turn = Rotation.from_rotvec([0.3, -1.0 + np.radians(3.0) * time_s, 0.5]).as_matrix()
    return model.mesh.nodes @ turn.T + [200.0 + 4.0 * time_s, -50.0, 30.0]


def swab(model: Model, time_s: float, there: FloatArray | None = None) -> Observation:
    rng = np.random.default_rng(round(10 * time_s))
    there = moved(model, time_s) if there is None else there
    return replace(seen_surface(model, there, rng, 0.3), time_s=time_s)


def off(model: Model, answer: Followed, time_s: float) -> float:
    return float(np.linalg.norm(answer.found.positions_mm - moved(model, time_s), axis=1).mean())


def test_a_body_is_followed_through_gaps(model: Model) -> None:
    following = Following(model, prepared("rigid", model), drift_mm_per_s=5.0)
    assert following.next(Observations(())).found.status is Status.UNOBSERVABLE
    for time_s in (0.0, 1.0, 2.0):
        answer = following.next(Observations((swab(model, time_s),)))
        assert answer.found.status is Status.CONVERGED, answer.found.deformation.message
        assert not answer.jumped
        assert off(model, answer, time_s) < 1.0
    assert answer.moved_mm == pytest.approx(
        np.sqrt(((moved(model, 2.0) - moved(model, 1.0)) ** 2).sum(axis=1).mean()), abs=0.5
    )
    gap = following.next(Observations(()), now_s=3.0)
    assert off(model, gap, 2.0) < 1.0
    assert np.linalg.norm(gap.found.spread_mm) > np.linalg.norm(answer.found.spread_mm)
    late = following.next(Observations((swab(model, 1.0),)), now_s=3.1)
    assert "came after" in late.found.notes[0]
    assert off(model, late, 2.0) < 1.0
    assert off(model, following.next(Observations((swab(model, 4.0),))), 4.0) < 1.0
    lost = following.next(Observations(()), now_s=60.0)
    assert lost.found.status is Status.UNOBSERVABLE
    assert off(model, lost, 4.0) < 1.0


def test_a_jump_is_told_and_the_body_found_again(model: Model) -> None:
    following = Following(model, prepared("rigid", model))
    following.next(Observations((swab(model, 0.0),)))
    answer = following.next(Observations((swab(model, 1.0, moved(model, 40.0)),)))
    assert answer.jumped
    assert "jumped by" in answer.found.notes[-1]
    assert off(model, answer, 40.0) < 1.0
    # What was seen before the jump is forgotten, and the next frame is an ordinary one.
    after = following.next(Observations((swab(model, 1.5, moved(model, 40.0)),)))
    assert not after.jumped
    assert off(model, after, 40.0) < 1.0


def test_a_refused_frame_leaves_the_sequence_as_it_was(model: Model) -> None:
    following = Following(model, prepared("rigid", model))
    following.next(Observations((swab(model, 0.0),)))
    metres = swab(model, 0.5)
    with pytest.raises(BadInput, match="metres"):
        following.next(Observations((replace(metres, points_mm=1e-3 * metres.points_mm),)))
    with pytest.raises(BadInput, match="frame"):
        following.next(Observations((replace(metres, frame="trocar"),)))
    assert off(model, following.next(Observations((swab(model, 1.0),))), 1.0) < 1.0


@pytest.mark.parametrize("technique", ["rigid", "tractions"])
def test_tools_that_contradict_each_other_are_named(model: Model, technique: str) -> None:
    rng = np.random.default_rng(4)
    surface = seen_surface(model, model.mesh.nodes, rng, 0.5)
    place = surface.points_mm[:3]
    outward = place + 40.0 * (place - model.mesh.nodes.mean(axis=0)) / 50.0
    touches = (
        Observation("contact", "hook", place, 0.5, "room"),
        Observation("contact", "probe", outward, 0.5, "room"),
    )
    found = registered(technique, model, Observations((surface, *touches)))
    assert found.status is Status.AMBIGUOUS
    assert "Without surface 'upper' or contact 'probe' the rest fits" in found.deformation.message
