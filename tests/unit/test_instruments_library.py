"""Codes of wheels, libraries in files, and wheels and boards on paper."""

from itertools import product

import cv2
import numpy as np
import pytest

from glisson.core.crosses import unit_corners
from glisson.core.errors import BadInput, StageFailed
from glisson.core.instruments import SECTORS, Instrument, InstrumentLibrary
from glisson.core.status import Status
from glisson.framework.instruments import add_instrument, checked_library
from glisson.framework.marker_sheets import INKS, board_sheet, cross_sheets, wheel_sheet
from glisson.intraoperative.cameras.board_detection import find_board
from glisson.intraoperative.cameras.boards import board_from_text
from glisson.intraoperative.instruments.codes import alike_codes, free_code, instrument_of
from glisson.io.instrument_files import EXAMPLE_LIBRARY, read_instruments, read_trocar, write_instruments
from glisson.io.recommended import recommended_layout

LETTERS = {"R": "red", "Y": "yellow", "G": "green", "B": "blue"}
EXAMPLE = read_instruments(EXAMPLE_LIBRARY)
PX_PER_MM = 10.0


def tool(name: str, code: str) -> Instrument:
    return Instrument(name, 330.0, tuple(LETTERS[letter] for letter in code))


def apart(one: tuple[str, ...], other: tuple[str, ...]) -> int:
    """By all twelve ways to lay one ring on the other."""
    ways = [np.roll(np.array(order), turn) for order in (other, other[::-1]) for turn in range(SECTORS)]
    return min(int((np.array(one) != way).sum()) for way in ways)


def test_the_example_has_ten_codes_of_which_one_sector_may_be_hidden():
    codes = [instrument.colours for instrument in EXAMPLE.instruments]
    assert len(codes) == 10
    assert min(apart(a, b) for n, a in enumerate(codes) for b in codes[:n]) >= 3
    assert not alike_codes(EXAMPLE)


@pytest.mark.parametrize(
    ("first", "second", "names"),
    [
        ("BGYGYR", "YGYRBG", "'one' differs from that of 'two' in 0"),
        ("BGYGYR", "RYGYGB", "'one' differs from that of 'two' in 0"),
        ("BGYGYR", "BGYGYB", "'one' differs from that of 'two' in 1"),
        ("BGYGYR", "RRRRRR", "'two' differs from its own mirror image in 0"),
    ],
)
def test_codes_that_are_alike_turned_or_mirrored_are_told(first, second, names):
    library = InstrumentLibrary((tool("one", first), tool("two", second)))
    assert any(names in alike.sentence for alike in alike_codes(library))


def test_every_single_misread_sector_is_no_name():
    """A reading with one wrong sector, in any rotation, is never taken for an instrument."""
    for instrument in EXAMPLE.instruments:
        for sector, colour in product(range(SECTORS), LETTERS.values()):
            reading = list(instrument.colours)
            reading[sector] = colour
            turned = reading[2:] + reading[:2]
            if tuple(reading) == instrument.colours:
                assert instrument_of(turned, EXAMPLE) == (instrument, 2)
                continue
            with pytest.raises(StageFailed, match="not in the library") as told:
                instrument_of(turned, EXAMPLE)
            assert told.value.status is Status.BAD_INPUT


def test_one_hidden_sector_is_enough_and_more_are_doubt():
    for instrument in EXAMPLE.instruments:
        for sector in range(SECTORS):
            reading: list[str | None] = list(instrument.colours)
            reading[sector] = None
            assert instrument_of(reading, EXAMPLE) == (instrument, 0)
            reading[(sector + 1) % SECTORS] = reading[(sector + 3) % SECTORS] = None
            with pytest.raises(StageFailed) as told:
                instrument_of(reading, EXAMPLE)
            assert told.value.status is Status.UNOBSERVABLE
    library = InstrumentLibrary((tool("one", "BGYGYR"), tool("two", "BGYGRB")))
    with pytest.raises(StageFailed, match="'one' or 'two'") as told:
        instrument_of(["blue", "green", "yellow", "green", None, None], library)
    assert told.value.status is Status.AMBIGUOUS


def test_a_mirrored_wheel_is_told():
    with pytest.raises(StageFailed, match="mirrored") as told:
        instrument_of(EXAMPLE.named("grasper").colours[::-1], EXAMPLE)
    assert told.value.status is Status.BAD_INPUT


def test_codes_are_given_until_there_are_ten(tmp_path):
    path = tmp_path / "instruments.toml"
    for number in range(10):
        add_instrument(path, f"tool {number}", 300.0 + number, 40.0, None)
    library = checked_library(path)
    assert [instrument.length_mm for instrument in library.instruments] == [300.0 + n for n in range(10)]
    assert not alike_codes(library)
    with pytest.raises(BadInput, match="twice"):
        add_instrument(path, "tool 3", 300.0, 40.0, None)
    taken = library.instruments[0].colours
    with pytest.raises(BadInput, match="differs from that of"):
        add_instrument(path, "another", 300.0, 40.0, taken[1:] + taken[:1])
    assert read_instruments(path) == library


def test_no_code_is_left_in_the_end():
    """By brute force: a code that is left would differ from all others, and from itself mirrored, in two sectors."""
    library = InstrumentLibrary(())

    def filled() -> None:
        nonlocal library
        while True:
            made = Instrument(f"{len(library.instruments)}", 300.0, free_code(library))
            library = InstrumentLibrary((*library.instruments, made))

    with pytest.raises(BadInput, match="No colour code is left"):
        filled()
    assert not alike_codes(library)
    for code in list(product(LETTERS.values(), repeat=SECTORS))[::37]:
        mirrored = min(sum(a != b for a, b in zip(code, np.roll(code[::-1], turn), strict=True)) for turn in range(6))
        turned = min(sum(a != b for a, b in zip(code, np.roll(code, turn), strict=True)) for turn in range(1, 6))
        left = all(apart(code, one.colours) >= 2 for one in library.instruments)
        assert not (left and mirrored >= 2 and turned >= 2)


def test_libraries_are_read_as_written(tmp_path):
    write_instruments(tmp_path / "copy.toml", EXAMPLE)
    assert read_instruments(tmp_path / "copy.toml") == EXAMPLE


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ('colours = ["red", "red", "blue", "pink", "red", "blue"]', "instruments[0]: .* 6 colours"),
        ('colours = ["red", "blue"]', "6 colours"),
        ('colours = ["red", "blue", "red", "red", "red", "green"]\nlength_mm = -3.0', "length"),
        ('colours = ["red", "blue", "red", "red", "red", "green"]\nlength_mm = nan', "finite"),
        ('colours = ["red", "blue", "red", "red", "red", "green"]\nwheel = 40.0', "unknown key"),
    ],
)
def test_libraries_that_cannot_be(tmp_path, line, sentence):
    length = "" if "length_mm" in line else "length_mm = 330.0\n"
    path = tmp_path / "bad.toml"
    path.write_text(f'schema = 1\n[[instruments]]\nname = "a"\n{length}{line}\n', encoding="utf-8")
    with pytest.raises(BadInput, match=sentence.replace("[", r"\[").replace("]", r"\]")):
        read_instruments(path)


def test_a_trocar_without_its_camera_is_told(tmp_path):
    path = tmp_path / "trocar.toml"
    path.write_text('schema = 1\ncamera = "none.toml"\npivot_mm = [0, 0, 0]\naxis = [0, 0, 1]\n', encoding="utf-8")
    with pytest.raises(BadInput, match=r"none\.toml does not exist"):
        read_trocar(path)


def painted(sheet, width_mm=210.0, height_mm=297.0) -> np.ndarray:
    """A sheet as a picture, as one looks at it."""
    picture = np.full((round(height_mm * PX_PER_MM), round(width_mm * PX_PER_MM), 3), 255, dtype=np.uint8)
    for area in sheet.areas:
        pixels = (area.corners_mm * [1.0, -1.0] + 0.5 * np.array([width_mm, height_mm])) * PX_PER_MM - 0.5
        colour = tuple(round(255.0 * part) for part in area.colour)
        cv2.fillPoly(picture, [np.rint(pixels * 256.0).astype(np.int32)], colour, cv2.LINE_AA, 8)
    return picture


@pytest.mark.parametrize("text", ["chessboard:9x6:20", "charuco:7x9:20:15:4X4_250", "dots:8x9:18"])
def test_printed_boards_are_found_with_their_measures(text):
    board = board_from_text(text)
    view = find_board(painted(board_sheet(board)), board, "printed")
    assert view is not None
    assert len(view.points_mm) == len(board.points_mm)
    # Flat paper: pixels are the points but for a shift, x to the right and y down.
    # Nobody can tell which end of a board of even dots is the first.
    orders = [view.pixels, view.pixels[::-1]] if board.looks_the_same_upside_down else [view.pixels]
    shifts = [pixels - view.points_mm[:, :2] * PX_PER_MM for pixels in orders]
    assert min(np.abs(shift - shift.mean(axis=0)).max() for shift in shifts) < 0.3


def test_unknown_dictionaries_are_told():
    with pytest.raises(BadInput, match="no ArUco dictionary"):
        board_sheet(board_from_text("charuco:7x9:20:15:NONE"))
    with pytest.raises(BadInput, match="too few markers"):
        board_sheet(board_from_text("charuco:20x20:5:4:4X4_50"))


def test_a_printed_wheel_has_its_colours_anticlockwise():
    instrument = EXAMPLE.named("hook")
    picture = painted(wheel_sheet(instrument))
    middle = np.array(picture.shape[1::-1]) / 2.0
    for sector, colour in enumerate(instrument.colours):
        angle = np.radians(60.0 * sector + 30.0)
        column, row = middle + 0.59 * 20.0 * PX_PER_MM * np.array([np.cos(angle), -np.sin(angle)])
        assert np.allclose(picture[int(row), int(column)], np.array(INKS[colour]) * 255.0, atol=1.0)
    black = np.flatnonzero(picture[picture.shape[0] // 2].max(axis=1) < 10)
    assert np.ptp(black) / PX_PER_MM == pytest.approx(40.0, abs=0.2)


def test_crosses_are_printed_whole_or_square_by_square():
    large = recommended_layout().crosses[0]
    sheets = cross_sheets(large)
    assert len(sheets) == 5
    assert all(sheet.size_mm == pytest.approx((large.size_mm / 3.0,) * 2) for sheet in sheets)
    small = type(large)(large.name, large.colours, 150.0, large.room_from_cross)
    (sheet,) = cross_sheets(small)
    corners = np.concatenate([area.corners_mm for area in sheet.areas]) * [1.0, -1.0]
    for corner in unit_corners() * 150.0:
        assert np.linalg.norm(corners - corner, axis=1).min() < 1e-9
