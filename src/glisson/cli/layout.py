"""`glisson layout`: where crosses should hang in a room, and where they do."""

import argparse
import time
from dataclasses import fields

import numpy as np

from glisson.cli.command import Command
from glisson.cli.console import Answer
from glisson.cli.options import add_seed
from glisson.cli.progress import StageLines
from glisson.core.errors import BadInput
from glisson.core.parameters import build_parameters
from glisson.core.protocols import Progress
from glisson.framework.layouts import design_for_room, survey_room
from glisson.intraoperative.trocar.layout_design import DesignParameters
from glisson.intraoperative.trocar.survey import Distance

_KEYS = (
    "layout", "crosses", "tip_mm", "three_or_more", "size_factor", "residual_px", "views", "sigma_mm", "notes",
    "seconds",
)  # fmt: skip


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "action", metavar="ACTION", choices=("design", "survey"),
        help="design: propose places by the predicted error of a tool's tip; survey: measure where the crosses hang",
    )  # fmt: skip
    parser.add_argument("images", metavar="IMAGE", nargs="*", help="pictures of the crosses (survey)")
    parser.add_argument("--out", metavar="FILE", required=True, help="the layout that is written, layout.toml")
    parser.add_argument("--camera", metavar="FILE", help="camera.toml (design: by default that of Glisson)")
    parser.add_argument("--room", metavar="FILE", help="room.toml (design; by default that of Glisson)")
    for field in fields(DesignParameters):
        words = str(field.metadata["help"]).rstrip(".")
        flag = f"--{field.name.replace('_', '-')}"
        parser.add_argument(flag, metavar="VALUE", help=f"{words}, default {field.default:g} (design)")
    add_seed(parser)
    parser.add_argument("--layout", metavar="FILE", help="layout.toml as designed (survey)")
    parser.add_argument(
        "--distance", metavar="NAME,NAME,MM", help="two crosses and the measured distance of their middles (survey)"
    )


def _run(arguments: argparse.Namespace, lines: StageLines) -> Answer:
    started = time.perf_counter()
    progress = lines.begun(arguments.action, "it was asked for")
    answer = _survey(arguments) if arguments.action == "survey" else _design(arguments, progress)
    seconds = time.perf_counter() - started
    lines.ended(arguments.action, seconds)
    return Answer({**answer.values, "seconds": seconds}, answer.text)


def _design(arguments: argparse.Namespace, progress: Progress) -> Answer:
    if arguments.images or arguments.distance or arguments.layout:
        raise BadInput("design takes no images, no --layout and no --distance; these are for survey.")
    given = {field.name: getattr(arguments, field.name) for field in fields(DesignParameters)}
    parameters = build_parameters(
        DesignParameters, {name: value for name, value in given.items() if value is not None}, "glisson layout design"
    )
    if arguments.seed is not None and not arguments.seed.isdecimal():
        raise BadInput(f"--seed must be a whole number of at least 0, not {arguments.seed!r}.")
    design = design_for_room(
        arguments.out, arguments.room, arguments.camera, parameters, int(arguments.seed or 0), progress
    )
    tip = {
        "median": float(np.median(design.tip_mm)),
        "p95": float(np.percentile(design.tip_mm, 95)),
        "worst": float(design.tip_mm.max()),
    }
    three = float(np.mean(design.visible >= 3))
    text = [
        f"crosses   {len(design.layout)}; {100.0 * three:.1f} % of {len(design.visible)} views show three or more",
        f"tip       predicted error median {tip['median']:.2f} mm, 95th percentile {tip['p95']:.2f} mm, "
        f"worst {tip['worst']:.2f} mm",
        f"written   {arguments.out}",
    ]
    values = {"layout": str(arguments.out), "crosses": len(design.layout), "tip_mm": tip, "three_or_more": three}
    return Answer(values, "\n".join(text))


def _survey(arguments: argparse.Namespace) -> Answer:
    if not arguments.images or arguments.layout is None or arguments.camera is None or arguments.distance is None:
        raise BadInput("survey needs images, --layout, --camera and --distance.")
    survey = survey_room(
        arguments.out, arguments.layout, arguments.camera, arguments.images, _distance(arguments.distance)
    )
    sigmas = [
        float(np.sqrt(np.linalg.eigvalsh(place.covariance[3:, 3:])[-1]))
        for place in (cross.room_from_cross for cross in survey.layout.crosses)
        if place.covariance is not None
    ]
    text = [
        f"crosses   {len(survey.layout)}, from {survey.views} of {len(arguments.images)} images; corners "
        f"{survey.residual_px:.3f} px off",
        f"size      {survey.size_factor:.4f} ± {survey.size_sigma:.4f} times that of the layout",
        f"places    standard deviation median {np.median(sigmas):.2f} mm, worst {max(sigmas):.2f} mm",
        *(f"look at   {note}" for note in survey.notes),
        f"written   {arguments.out}",
    ]
    values = {
        "layout": str(arguments.out),
        "crosses": len(survey.layout),
        "size_factor": survey.size_factor,
        "residual_px": survey.residual_px,
        "views": survey.views,
        "sigma_mm": {"median": float(np.median(sigmas)), "worst": max(sigmas)},
        "notes": list(survey.notes),
    }
    return Answer(values, "\n".join(text))


def _distance(text: str) -> Distance:
    parts = [part.strip() for part in text.split(",")]
    try:
        first, second, length = parts
        return Distance(first, second, float(length))
    except ValueError:
        raise BadInput(
            f"A distance is written NAME,NAME,MM, for example 'ceiling 1,ceiling 9,2410', not {text!r}."
        ) from None


COMMAND = Command(
    "layout",
    "  glisson layout design --room room.toml --camera camera.toml --out layout.toml\n"
    "  glisson layout survey view*.png --layout layout.toml --camera camera.toml "
    "--distance 'ceiling 1,ceiling 9,2410' --out hung.toml",
    _add_arguments,
    _run,
    _KEYS,
)
