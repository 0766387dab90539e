"""Layouts of crosses designed for a room and surveyed where they hang, from files to files."""

from collections.abc import Sequence
from pathlib import Path

from glisson.core.errors import BadInput
from glisson.core.protocols import Progress, silent
from glisson.intraoperative.trocar.layout_design import Design, DesignParameters, design_layout
from glisson.intraoperative.trocar.survey import Distance, Survey, survey_layout
from glisson.io.camera_files import read_camera
from glisson.io.layout_files import read_layout, write_layout
from glisson.io.photographs import read_photograph
from glisson.io.recommended import or_recommended_camera, or_recommended_room
from glisson.io.result_places import result_place


def design_for_room(
    out: str | Path,
    room: str | Path | None,
    camera: str | Path | None,
    parameters: DesignParameters,
    seed: int,
    progress: Progress = silent,
) -> Design:
    """Design a layout and write it; room and camera are those that come with Glisson where they are not given.

    Raises:
        BadInput: a file cannot be used or would be overwritten, or the room has too few places.
        WriteFailed: the disk is full.
    """
    place = result_place(out, (room, camera))
    design = design_layout(or_recommended_room(room), or_recommended_camera(camera), parameters, seed, progress)
    write_layout(place, design.layout)
    return design


def survey_room(
    out: str | Path, layout: str | Path, camera: str | Path, images: Sequence[str | Path], distance: Distance
) -> Survey:
    """Survey the crosses of a layout from pictures, and write where they hang.

    Raises:
        BadInput: a file cannot be used or would be overwritten, or a picture has another size than the camera's.
        StageFailed: a cross is not seen often enough.
        WriteFailed: the disk is full.
    """
    place = result_place(out, (layout, camera, *images))
    taken_by = read_camera(camera)
    taken = []
    for path in images:
        picture = read_photograph(path)
        if picture.shape[:2] != (taken_by.height, taken_by.width):
            raise BadInput(f"{path} is not of the camera's {taken_by.width} × {taken_by.height} px.")
        taken.append(picture)
    survey = survey_layout(taken, taken_by, read_layout(layout), distance)
    write_layout(place, survey.layout)
    return survey
