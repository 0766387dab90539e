"""`glisson markers`: wheels of instruments, crosses and calibration boards as PDF at true scale."""

import argparse

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.progress import StageLines
from glisson.core.status import Status
from glisson.framework.instruments import library_or_example
from glisson.framework.marker_sheets import board_sheet, cross_sheets, wheel_sheet
from glisson.intraoperative.cameras.boards import board_from_text
from glisson.io.layout_files import read_layout
from glisson.io.result_places import result_place
from glisson.io.true_scale_pdf import SENTENCE, Sheet, write_true_scale_pdf

_EXAMPLES = {
    "wheel": "  glisson markers wheel grasper hook --library instruments.toml",
    "crosses": "  glisson markers crosses layout.toml --out crosses.pdf",
    "board": "  glisson markers board charuco:9x12:20:15:4X4_250 --json",
}

_KEYS = ("status", "message", "file", "pages", "papers")


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    kinds = parser.add_subparsers(dest="kind", required=True, metavar="WHAT", parser_class=type(parser))
    about = {
        "wheel": "wheels of instruments", "crosses": "the crosses of a layout", "board": "a calibration board",
    }  # fmt: skip
    wheel, crosses, board = (
        kinds.add_parser(
            name, help=summary, description=summary, allow_abbrev=False, epilog=f"examples:\n{_EXAMPLES[name]}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for name, summary in about.items()
    )  # fmt: skip
    wheel.add_argument("names", metavar="NAME", nargs="*", help="of instruments; by default all of the library")
    wheel.add_argument("--library", metavar="FILE", help="instruments.toml; by default the one that comes with Glisson")
    crosses.add_argument("layout", metavar="LAYOUT", help="layout.toml")
    board.add_argument(
        "board", metavar="BOARD", help="such as chessboard:9x6:20, dots:10x8:15 or charuco:9x12:20:15:4X4_250"
    )
    for made in (wheel, crosses, board):
        made.add_argument("--out", metavar="PDF", help="by default wheel.pdf, crosses.pdf or board.pdf")
        made.add_argument("--json", action="store_true", help="print one JSON object on stdout, all else on stderr")
        made.add_argument("--debug", action="store_true", help=argparse.SUPPRESS)


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    read = (vars(arguments).get("layout"), vars(arguments).get("library"))
    file = result_place(arguments.out or f"{arguments.kind}.pdf", read, ".pdf")
    sheets = _sheets(arguments)
    papers = write_true_scale_pdf(file, sheets)
    listed = [f"{sheet.title} on {paper}" for sheet, paper in zip(sheets, papers, strict=True)]
    values = {
        "status": Status.CONVERGED, "message": Status.CONVERGED.sentence,
        "file": str(file), "pages": len(sheets), "papers": list(papers),
    }  # fmt: skip
    return Answer(values, "\n".join([*listed, SENTENCE, f"written   {file}"]))


def _sheets(arguments: argparse.Namespace) -> list[Sheet]:
    if arguments.kind == "crosses":
        return [sheet for cross in read_layout(arguments.layout).crosses for sheet in cross_sheets(cross)]
    if arguments.kind == "board":
        return [board_sheet(board_from_text(arguments.board))]
    library = library_or_example(arguments.library)
    chosen = [library.named(name) for name in arguments.names] or library.instruments
    return [wheel_sheet(instrument) for instrument in chosen]


COMMAND = Command("markers", "\n".join(_EXAMPLES.values()), _add_arguments, _run, _KEYS)
