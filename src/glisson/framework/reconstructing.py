"""Surface points from a session of laparoscope views: what was not clicked is found in the pictures."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput, StageFailed
from glisson.core.protocols import Progress, Reconstruction, SurfaceReconstructor, silent
from glisson.core.registry import make_technique
from glisson.core.views import Sightings, View, ViewSet
from glisson.framework.view_figure import draw_views
from glisson.intraoperative.views.features import match_features
from glisson.intraoperative.views.tip import find_tip
from glisson.io.observation_files import write_observations
from glisson.io.photographs import read_photograph
from glisson.io.result_places import result_place
from glisson.io.view_session_files import SessionView, ViewSession, read_view_session

JOINT = "bundle"
OBSERVATIONS, PICTURE = "observations.json", "views.png"

Images = tuple[NDArray[np.uint8] | None, ...]


@dataclass(frozen=True, eq=False)
class Reconstructed:
    """What came of a session; `tips_found` names the views whose tip was found in the picture."""

    found: Reconstruction
    views: ViewSet
    tips_found: tuple[str, ...]
    observations: Path
    picture: Path


def reconstruct_session(
    session: str | Path,
    out: str | Path,
    technique: str = JOINT,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> Reconstructed:
    """Reconstruct a session, and write the observations and a picture of what was seen into a folder.

    Raises:
        BadInput: the session or a picture cannot be used or would be overwritten.
        StageFailed: a tip was not found, or the views are too close to each other; the picture is there all the same.
        WriteFailed: the disk is full.
    """
    maker: SurfaceReconstructor = make_technique("surface-reconstructor", technique, parameters or {}, "--technique")
    given = read_view_session(session)
    folder = Path(out)
    read = (session, *(view.image for view in given.views))
    picture, file = (result_place(folder / name, read) for name in (PICTURE, OBSERVATIONS))
    progress(0.0, "reading the pictures")
    images = tuple(_image(view) for view in given.views)
    _check_different(given, images)
    views, found_tips = _view_set(given, images, progress)
    draw_views(views, images, picture)
    progress(0.6, "reconstructing")
    found = maker.reconstruct(views, progress)
    write_observations(file, found.observations)
    return Reconstructed(found, views, found_tips, file, picture)


def _image(view: SessionView) -> NDArray[np.uint8] | None:
    if view.image is None:
        return None
    image = read_photograph(view.image)
    if image.shape[:2] != (view.camera.height, view.camera.width):
        raise BadInput(
            f"{view.image} has {image.shape[1]} × {image.shape[0]} px, its camera "
            f"{view.camera.width} × {view.camera.height}; give the picture as the camera took it."
        )
    return image


def _check_different(session: ViewSession, images: Images) -> None:
    for (one, first), (other, second) in combinations(zip(session.views, images, strict=True), 2):
        if first is not None and second is not None and np.array_equal(first, second):
            raise BadInput(f"{one.name} and {other.name} have the same picture; give each view its own.")


def _view_set(session: ViewSession, images: Images, progress: Progress) -> tuple[ViewSet, tuple[str, ...]]:
    progress(0.1, "finding tips")
    views, found = [], []
    for view, image in zip(session.views, images, strict=True):
        tip = view.tip_px
        if tip is None:
            tip = _tip(view, image)
            found.append(view.name)
        views.append(View(view.name, view.camera, view.room_from_camera, tip))
    seen = [image for image in images if image is not None]
    features = Sightings.none()
    if session.find_features and len(seen) == len(images):
        progress(0.2, "matching features")
        features = match_features(seen, views, session.hand_eye_covariance)
    names, landmarks = _landmarks(session)
    return ViewSet(
        tuple(views),
        session.touched_mm,
        session.touched_covariance_mm2,
        session.tip_sigma_px,
        names,
        landmarks,
        features,
        session.hand_eye_covariance,
    ), tuple(found)


def _tip(view: SessionView, image: NDArray[np.uint8] | None) -> NDArray[np.float64]:
    if image is None:
        raise BadInput(f"{view.name} has neither tip_px nor an image in which the tip could be found.")
    try:
        return find_tip(image)
    except StageFailed as error:
        raise StageFailed(f"{view.name}: {error}", error.status) from error


def _landmarks(session: ViewSession) -> tuple[tuple[str, ...], Sightings]:
    """Landmarks in the order in which they first appear."""
    names = tuple(dict.fromkeys(name for view in session.views for name in view.landmarks_px))
    rows = [
        (names.index(name), number, pixel)
        for number, view in enumerate(session.views)
        for name, pixel in view.landmarks_px.items()
    ]
    if not rows:
        return (), Sightings.none()
    points, views, pixels = zip(*rows, strict=True)
    return names, Sightings(
        np.array(points, dtype=np.int64),
        np.array(views, dtype=np.int64),
        np.array(pixels),
        session.landmark_sigma_px,
    )
