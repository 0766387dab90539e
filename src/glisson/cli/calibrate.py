"""`glisson calibrate …`: a camera, hand and eye, a tool's tip, and the geometry of a scope."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from glisson.cli.calibration_text import camera_answer, hand_eye_answer, pivot_answer, scope_answer
from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import point_from_text
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.framework.calibrating import (
    BoardImages,
    boards_in_corner_files,
    boards_in_images,
    camera_from_boards,
    hand_eye_from_boards,
)
from glisson.intraoperative.cameras.boards import board_from_text
from glisson.intraoperative.cameras.pivot import calibrate_pivot
from glisson.intraoperative.cameras.scope import calibrate_shaft, scope_geometry
from glisson.io.camera_files import read_camera
from glisson.io.pose_files import read_pose, read_poses

_EXAMPLES = {
    "camera": "  glisson calibrate camera --board charuco:19x26:5:4:4X4_250 --images boards/\n"
    "  glisson calibrate camera --board chessboard:13x8:3 --images boards/*.png --out scope --json\n"
    "  glisson calibrate camera --corners corners/*.txt --points points/*.txt --size 1920x1080",
    "hand-eye": "  glisson calibrate hand-eye --camera calibration/camera.toml --board charuco:19x26:5:4:4X4_250 \\\n"
    "      --images boards/ --poses scope-poses/ --board-poses board-poses/",
    "pivot": "  glisson calibrate pivot --poses pivot-poses/ --json",
    "scope": "  glisson calibrate scope --hand-eye calibration/hand-eye.toml --tip-poses pivot/ --spin-poses spin/\n"
    "  glisson calibrate scope --hand-eye calibration/hand-eye.toml --tip 0,0,-310",
}


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    kinds = parser.add_subparsers(dest="kind", required=True, metavar="WHAT", parser_class=type(parser))
    about = {
        "camera": (_add_camera, "focal lengths, principal point and distortion from images of a board"),
        "hand-eye": (_add_hand_eye, "where the camera is in the frame of the tracked marker on it"),
        "pivot": (_add_pivot, "the tip of a tracked tool, from poses while it turns about its resting tip"),
        "scope": (_add_scope, "glass tip and shaft of a scope before its camera, and how oblique it looks"),
    }
    for name, (add, summary) in about.items():
        made = kinds.add_parser(
            name, help=summary, description=summary, allow_abbrev=False, epilog=f"examples:\n{_EXAMPLES[name]}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        add(made)
        made.add_argument("--json", action="store_true", help="print one JSON object on stdout, all else on stderr")
        made.add_argument("--debug", action="store_true", help=argparse.SUPPRESS)


def _add_boards(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--board", metavar="BOARD",
        help="chessboard:COLUMNSxROWS:MM (inner corners), dots:…, asymmetric-dots:… or "
        "charuco:COLUMNSxROWS:MM:MARKER_MM:DICTIONARY (squares)",
    )  # fmt: skip
    parser.add_argument("--images", metavar="PATH", nargs="+", default=[], help="images of the board, or folders")
    parser.add_argument("--corners", metavar="FILE", nargs="+", default=[], help="instead: text files of pixels u v")
    parser.add_argument("--points", metavar="FILE", nargs="+", default=[], help="and of their board points x y z, mm")
    parser.add_argument("--out", metavar="DIR", default="calibration", help="folder for results (default: calibration)")


def _add_camera(parser: argparse.ArgumentParser) -> None:
    _add_boards(parser)
    parser.add_argument("--size", metavar="WxH", help="size of the images in px, where only corner files are given")


def _add_hand_eye(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--camera", metavar="FILE", required=True, help="camera.toml")
    _add_boards(parser)
    parser.add_argument("--poses", metavar="PATH", nargs="+", required=True, help="tracked 4 × 4 poses, one an image")
    parser.add_argument(
        "--board-poses", metavar="PATH", nargs="+", default=[], help="the same of a marker on the board"
    )


def _add_pivot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", metavar="PATH", nargs="+", required=True, help="tracked 4 × 4 poses, or folders")


def _add_scope(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--hand-eye", metavar="FILE", required=True, help="hand-eye.toml")
    parser.add_argument("--tip", metavar="X,Y,Z", help="the glass tip in the marker's frame, mm, where it is known")
    parser.add_argument("--tip-poses", metavar="PATH", nargs="+", default=[], help="or poses while it turns about it")
    parser.add_argument(
        "--spin-poses", metavar="PATH", nargs="+", default=[], help="poses while it is spun about its shaft in a sleeve"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    runs: dict[str, Callable[[argparse.Namespace, StageLines], Answer]] = {
        "camera": _camera, "hand-eye": _hand_eye, "pivot": _pivot, "scope": _scope,
    }  # fmt: skip
    return runs[arguments.kind](arguments, lines)


def _camera(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    boards = _boards(arguments, lines)
    folder = Path(arguments.out)
    made = camera_from_boards(boards, _size(arguments.size), folder)
    return camera_answer(made, boards, folder)


def _hand_eye(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    camera = read_camera(arguments.camera)
    boards = _boards(arguments, lines)
    folder = Path(arguments.out)
    made = hand_eye_from_boards(camera, boards, arguments.poses, arguments.board_poses, folder)
    upside_down = arguments.board is not None and board_from_text(arguments.board).looks_the_same_upside_down
    return hand_eye_answer(made, boards, folder, upside_down)


def _pivot(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    return pivot_answer(calibrate_pivot(read_poses(arguments.poses, "room", "marker")))


def _scope(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    if (arguments.tip is None) == (not arguments.tip_poses):
        raise BadInput("Give the glass tip either by --tip or by --tip-poses.")
    hand_eye = read_pose(arguments.hand_eye)
    if (hand_eye.target, hand_eye.source) != ("camera", "marker"):
        raise BadInput(f"{arguments.hand_eye} tells {hand_eye.target} from {hand_eye.source}, not camera from marker.")
    tip: Any = np.zeros(3)
    covariance = np.zeros((3, 3))
    if arguments.tip is not None:
        tip = np.array(point_from_text(arguments.tip))
    else:
        pivot = calibrate_pivot(read_poses(arguments.tip_poses, "room", "marker"))
        tip, covariance = pivot.tip_mm, pivot.covariance_mm2[:3, :3]
    shaft = calibrate_shaft(read_poses(arguments.spin_poses, "room", "marker")) if arguments.spin_poses else None
    return scope_answer(scope_geometry(hand_eye, tip, covariance, shaft), shaft)


def _boards(arguments: argparse.Namespace, lines: StageLines) -> BoardImages:
    if bool(arguments.images) == bool(arguments.corners):
        raise BadInput("Give either --images with --board, or --corners with --points.")
    if arguments.corners:
        return boards_in_corner_files(arguments.corners, arguments.points)
    if arguments.board is None:
        raise BadInput("Say with --board which board is in the images, for example --board chessboard:9x6:5.")
    return boards_in_images(
        arguments.images, board_from_text(arguments.board), lines.begun("boards", "they are sought")
    )


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise BadInput(f"--size is written WIDTHxHEIGHT in px, for example 1920x1080, not {text!r}.")
    return int(width), int(height)


COMMAND = Command("calibrate", "\n".join(_EXAMPLES.values()), _add_arguments, _run, ("notes",))
