"""The bar charts of the dissertation's figures II.20 to II.23: the tumour's error by mesh, for two or three levels."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes

from glisson.navigation.figures.colours import BLUE, ORANGE, SKY
from glisson.navigation.figures.picture import Picture, new_figure, picture
from glisson.studies.sensitivity.choices import LEVELS, Choice
from glisson.studies.sensitivity.rows import MILLIMETRES_PER_PIXEL, Row, Truth

_CHARTS = {
    "model": ("II.20", "model", "Law"),
    "young-modulus": ("II.21", "young_modulus_kpa", "Young's modulus (kPa)"),
    "poisson-ratio": ("II.22", "poisson_ratio", "Poisson's ratio"),
    "friction": ("II.23", "friction", "Coefficient of friction"),
}
_COLOURS = (BLUE, ORANGE, SKY)


def draw_charts(rows: Sequence[Row], truths: Sequence[Truth], meshes: Sequence[str]) -> dict[str, Picture]:
    """The charts by file name: a panel for each truth, mm on the left and pixels on the right.

    A panel's models have the truth's own parameters but for the one that is varied.
    """
    return {
        f"figure-{number.replace('.', '-')}-{name}.png": _chart(rows, truths, meshes, factor, title, number)
        for name, (number, factor, title) in _CHARTS.items()
    }


def _chart(
    rows: Sequence[Row], truths: Sequence[Truth], meshes: Sequence[str], factor: str, title: str, number: str
) -> Picture:
    figure = new_figure(420 * len(truths) + 60, 430)
    panels = figure.subplots(1, len(truths), sharey=True, squeeze=False)[0]
    for axes, truth in zip(panels, truths, strict=True):
        _panel(axes, rows, truth, meshes, factor)
    panels[0].set_ylabel("error of the tumour's centroid (mm)", fontsize=11.5)
    highest = max((row["tumour_mm"] or 0.0 for row in _charted(rows, truths, meshes, factor)), default=0.0)
    panels[0].set_ylim(0.0, 1.15 * highest or 1.0)
    pixels = panels[-1].secondary_yaxis(
        "right", functions=(lambda mm: mm / MILLIMETRES_PER_PIXEL, lambda px: px * MILLIMETRES_PER_PIXEL)
    )
    pixels.set_ylabel(f"pixels of {MILLIMETRES_PER_PIXEL:g} mm", fontsize=11.5)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, title=title, loc="upper center", ncols=len(labels), frameon=False, fontsize=11)
    figure.subplots_adjust(left=0.07, right=0.93, bottom=0.11, top=0.77, wspace=0.06)
    return picture(
        figure,
        f"Bars of the tumour's error for each mesh and each level of: {title}.",
        f"Figure {number} of the dissertation: error of the tumour's centroid by mesh. {title} as shown, all other "
        "parameters those of the truth.",
    )


def _panel(axes: Axes, rows: Sequence[Row], truth: Truth, meshes: Sequence[str], factor: str) -> None:
    levels = _levels(factor)
    width = 0.8 / len(levels)
    for number, level in enumerate(levels):
        errors: list[float] = []
        for place, mesh in enumerate(meshes):
            row = _row(rows, truth, truth.tissue.choice(mesh), factor, level)
            error = None if row is None else row["tumour_mm"]
            errors.append(0.0 if error is None else error)
            x = place + (number - 0.5 * (len(levels) - 1)) * width
            words = "not done" if row is None else row["status"] or "failed"
            if error is not None:
                axes.text(x, error, f"{error:.1f}", ha="center", va="bottom", fontsize=9.5)
            else:
                axes.text(x, 0.0, f" {words}", ha="center", va="bottom", fontsize=9.5, rotation=90, color="0.35")
        places = [place + (number - 0.5 * (len(levels) - 1)) * width for place in range(len(meshes))]
        axes.bar(
            places,
            errors,
            0.92 * width,
            color=_COLOURS[number],
            label=level if isinstance(level, str) else f"{level:g}",
        )
    axes.set_xticks(range(len(meshes)), [_mesh_words(rows, mesh) for mesh in meshes], fontsize=10.5)
    axes.set_title(f"against {truth.name}", fontsize=11.5)
    axes.spines[["top", "right"]].set_visible(False)


def _levels(factor: str) -> tuple[Any, ...]:
    levels = LEVELS[factor]
    return levels if isinstance(levels[0], str) else tuple(sorted(levels))


def _charted(rows: Sequence[Row], truths: Sequence[Truth], meshes: Sequence[str], factor: str) -> list[Row]:
    found = (
        _row(rows, truth, truth.tissue.choice(mesh), factor, level)
        for truth in truths
        for mesh in meshes
        for level in _levels(factor)
    )
    return [row for row in found if row is not None]


def _row(rows: Sequence[Row], truth: Truth, base: Choice, factor: str, level: Any) -> Row | None:
    """The row of a model that differs from `base` in one parameter."""
    wanted: Mapping[str, Any] = {
        "mesh": base.mesh,
        **base.parameters,
        factor: level,
        "truth": truth.kind,
        "truth_young_modulus_kpa": truth.tissue.young_modulus_kpa,
    }
    return next((row for row in rows if all(row[name] == value for name, value in wanted.items())), None)


def _mesh_words(rows: Sequence[Row], mesh: str) -> str:
    elements = next((row["elements"] for row in rows if row["mesh"] == mesh), None)
    return mesh if elements is None else f"{mesh}\n{elements:,}"
