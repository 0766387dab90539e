"""A trocar localised from a picture and the files of its camera and of the crosses."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glisson.core.localisation import Localisation
from glisson.core.protocols import Localiser
from glisson.core.registry import make_technique
from glisson.framework.cross_figure import draw_localisation
from glisson.io.camera_files import read_camera
from glisson.io.layout_files import read_layout
from glisson.io.photographs import read_photograph, write_photograph
from glisson.io.result_places import result_place

GLOBAL = "global"


@dataclass(frozen=True)
class Localised:
    """The outcome, and the picture of it."""

    found: Localisation
    picture: Path


def localise_trocar(
    image: str | Path,
    camera: str | Path,
    layout: str | Path,
    technique: str = GLOBAL,
    parameters: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
) -> Localised:
    """Localise a trocar, and draw what was seen.

    Args:
        image: a picture of the trocar's camera.
        camera: its `camera.toml`.
        layout: the crosses' `layout.toml`.
        technique: of the kind localiser.
        parameters: of the technique.
        out: the picture of what was seen, `.png`; by default beside the image, named `…-crosses.png`.

    Raises:
        BadInput: a file cannot be used or would be overwritten, or they do not belong together.
        WriteFailed: the disk is full.
    """
    beside = Path(image).with_name(f"{Path(image).stem}-crosses.png")
    place = result_place(beside if out is None else out, (image, camera, layout), ".png")
    maker: Localiser = make_technique("localiser", technique, parameters or {}, "--technique")
    taken, seen_by, crosses = read_photograph(image), read_camera(camera), read_layout(layout)
    found = maker.localise(taken, seen_by, crosses)
    write_photograph(place, draw_localisation(taken, seen_by, crosses, found))
    return Localised(found, place)
