"""Libraries of instruments kept in files, and instruments recognised in pictures of a trocar's camera."""

from dataclasses import dataclass
from pathlib import Path

from glisson.core.errors import BadInput
from glisson.core.instruments import Instrument, InstrumentLibrary, SeenInstrument
from glisson.core.localisation import Localisation
from glisson.core.protocols import InstrumentRecogniser, Localiser
from glisson.core.registry import make_technique
from glisson.framework.instrument_figure import draw_instrument
from glisson.intraoperative.instruments.codes import alike_codes, free_code
from glisson.io.instrument_files import EXAMPLE_LIBRARY, read_instruments, read_trocar, write_instruments
from glisson.io.layout_files import read_layout
from glisson.io.photographs import read_photograph, write_photograph
from glisson.io.result_places import result_place

BY_WHEEL = "colour-wheel"
BY_CROSSES = "global"


@dataclass(frozen=True, eq=False)
class Recognised:
    """The instrument, where the trocar is in the room if that was asked for, and the picture of it."""

    seen: SeenInstrument
    place: Localisation | None
    picture: Path


def library_or_example(path: str | Path | None) -> InstrumentLibrary:
    """The library of a file, or the one that comes with Glisson; its codes may be alike.

    Raises:
        BadInput: it cannot be read.
    """
    return read_instruments(EXAMPLE_LIBRARY if path is None else path)


def checked_library(path: str | Path | None) -> InstrumentLibrary:
    """The same, refused where codes are alike.

    Raises:
        BadInput: it cannot be read, is empty, or has codes that may be mistaken for each other.
    """
    library = library_or_example(path)
    if not library.instruments:
        raise BadInput(f"{path} has no instrument; add some with glisson instruments add.")
    for alike in alike_codes(library):
        raise BadInput(alike.sentence)
    return library


def add_instrument(
    path: str | Path, name: str, length_mm: float, wheel_mm: float, colours: tuple[str, ...] | None
) -> Instrument:
    """Add an instrument to the library in a file, which is made where there is none.

    Args:
        path: of the library.
        name: of the instrument, one that the library does not have.
        length_mm: from the wheel to the tip.
        wheel_mm: the wheel's diameter.
        colours: its code; None: one that is far from all others.

    Raises:
        BadInput: the name is there already, or the code is like another one.
        WriteFailed: the disk is full.
    """
    before = read_instruments(path) if Path(path).exists() else InstrumentLibrary(())
    made = Instrument(name, length_mm, free_code(before) if colours is None else colours, wheel_mm)
    library = InstrumentLibrary((*before.instruments, made))
    for alike in alike_codes(library):
        if name in (alike.one, alike.other):
            raise BadInput(alike.sentence)
    write_instruments(path, library)
    return made


def recognise_picture(
    image: str | Path,
    trocar: str | Path,
    library: str | Path | None = None,
    layout: str | Path | None = None,
    out: str | Path | None = None,
) -> Recognised:
    """Recognise the instrument in a picture, and draw what was seen.

    Args:
        image: a picture of the trocar's camera.
        trocar: its `trocar.toml`.
        library: `instruments.toml`; by default the one that comes with Glisson.
        layout: `layout.toml` of the crosses in the room, which the same picture shows; None: no place in the room.
        out: the picture of what was seen, `.png`; by default beside the image, named `…-instrument.png`.

    Raises:
        BadInput: a file cannot be used or would be overwritten, or they do not belong together.
        StageFailed: see `glisson.core.protocols.InstrumentRecogniser`.
        WriteFailed: the disk is full.
    """
    beside = Path(image).with_name(f"{Path(image).stem}-instrument.png")
    picture = result_place(beside if out is None else out, (image, trocar, library, layout), ".png")
    taken, through, known = read_photograph(image), read_trocar(trocar), checked_library(library)
    recogniser: InstrumentRecogniser = make_technique("instrument-recogniser", BY_WHEEL, {}, "--technique")
    seen = recogniser.recognise(taken, through, known)
    place = None
    if layout is not None:
        localiser: Localiser = make_technique("localiser", BY_CROSSES, {}, "--technique")
        place = localiser.localise(taken, through.camera, read_layout(layout))
    write_photograph(picture, draw_instrument(taken, through, seen))
    return Recognised(seen, place, picture)
