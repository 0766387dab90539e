"""Pictures of tracks and of breathing, as curves of markers over time, phase and rate."""

from collections.abc import Sequence

import cv2
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.tracks import Tracks
from glisson.intraoperative.breathing.cycles import Cycles
from glisson.intraoperative.breathing.displacement import Displacement
from glisson.intraoperative.breathing.motion_model import BreathingModel
from glisson.intraoperative.breathing.plateau import Plateau
from glisson.navigation.figures.colours import BLACK, BLUE, GREEN, ORANGE, SKY, VERMILLION
from glisson.navigation.figures.picture import Picture, new_figure, picture


def draw_tracks(tracks: Tracks, first: NDArray[np.uint8]) -> Picture:
    """The first frame with the way of each marker (px) in the colour of its time, and where it begins."""
    height, width = first.shape[:2]
    figure = new_figure(width, height + 70)
    axes = figure.add_axes((0.0, 70.0 / (height + 70), 1.0, height / (height + 70)))
    # A paler frame, so that the ways stand out.
    axes.imshow(
        cv2.addWeighted(first, 0.6, np.full_like(first, 255), 0.4, 0.0), extent=(-0.5, width - 0.5, height - 0.5, -0.5)
    )
    axes.set_axis_off()
    colours = matplotlib.colormaps["viridis"]
    span = tracks.times_s[-1] - tracks.times_s[0]
    for marker in range(tracks.states.shape[1]):
        u, v = tracks.places[:, marker, 0], tracks.places[:, marker, 1]
        axes.scatter(u, v, s=3.0, c=(tracks.times_s - tracks.times_s[0]) / span, cmap=colours, vmin=0.0, vmax=1.0)
        axes.plot(u[0], v[0], "o", ms=15.0, mfc="none", mec="white", mew=1.5)
        share = tracks.seen[:, marker].mean()
        lost = "" if share > 0.9995 else f" ({100.0 * share:.0f} %)"
        axes.text(u[0] + 12.0, v[0] + 4.0, f"{marker + 1}{lost}", fontsize=10.5, color="black", va="center")
    bar = figure.add_axes((0.3, 46.0 / (height + 70), 0.4, 14.0 / (height + 70)))
    bar.imshow(np.linspace(0.0, 1.0, 256)[None, :], cmap=colours, aspect="auto", extent=(0.0, span, 0.0, 1.0))
    bar.set_yticks([])
    bar.set_xlabel("time (s); in brackets the share of frames in which a marker was seen", fontsize=10.5, labelpad=1.0)
    return picture(
        figure,
        f"Ways of {tracks.states.shape[1]} markers over the first frame.",
        "The way of each marker over the first frame, coloured by time; circles where they begin.",
    )


def draw_breathing(tracks: Tracks, cycles: Cycles, model: BreathingModel, marker: int) -> Picture:
    """One marker: its displacement over time with and without breathing, and over phase."""
    figure = new_figure(1000, 620)
    upper, lower = figure.add_axes((0.08, 0.58, 0.89, 0.36)), figure.add_axes((0.08, 0.09, 0.52, 0.37))
    ring = figure.add_axes((0.70, 0.09, 0.27, 0.37))
    way = model.way(np.linspace(0.0, 1.0, 201))[:, marker]
    main = _main_way(way)
    home = np.nanmean(model.drift(tracks.times_s)[:, marker], axis=0)
    places = tracks.places[:, marker] - home
    rest = places - model.breathing(tracks.times_s)[:, marker]
    upper.plot(tracks.times_s, places @ main, color=BLUE, lw=1.2, label="as seen")
    upper.plot(tracks.times_s, rest @ main, color=VERMILLION, lw=1.2, label="without breathing")
    for name, moments, colour, style in (
        ("full exhalation", cycles.exhalations_s, GREEN, "--"),
        ("full inhalation", cycles.inhalations_s, ORANGE, ":"),
    ):
        for n, moment in enumerate(moments):
            upper.axvline(moment, color=colour, lw=1.2, ls=style, label=name if n == 0 else None)
    upper.set(xlabel="time (s)", ylabel=f"displacement ({tracks.unit})", xlim=(tracks.times_s[0], tracks.times_s[-1]))
    upper.legend(fontsize=10, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    phase = cycles.phase % 1.0
    drift = model.drift(tracks.times_s)[:, marker] - home
    lower.plot(phase, (places - drift) @ main, ".", ms=2.5, color=SKY, label="each frame, without drift")
    lower.plot(np.linspace(0.0, 1.0, 201), way @ main, color=BLACK, lw=1.6, label="a breath of mean depth")
    lower.axvline(cycles.inhalation_phase, color=ORANGE, lw=1.2, ls=":")
    lower.set(xlabel="phase", ylabel=f"displacement ({tracks.unit})", xlim=(0.0, 1.0))
    lower.legend(fontsize=10, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    ring.plot(way[:, 0], way[:, 1], color=BLACK, lw=1.6)
    ring.plot(0.0, 0.0, "o", color=GREEN, ms=8)
    top = way[np.argmin(np.abs(np.linspace(0.0, 1.0, 201) - cycles.inhalation_phase))]
    ring.plot(*top, "s", color=ORANGE, ms=8)
    ring.set_aspect("equal", adjustable="datalim")
    ring.invert_yaxis()
    ring.set(xlabel=f"u ({tracks.unit})", ylabel=f"v ({tracks.unit})", title=f"way of marker {marker + 1}")
    return picture(
        figure,
        f"Marker {marker + 1} over time and phase, with and without breathing.",
        f"Marker {marker + 1} along its main way over time and over phase; right its way in a breath, from full "
        "exhalation (dot) to full inhalation (square) and back.",
    )


def draw_moves(tracks: Tracks, marker: int, exhalations_s: FloatArray) -> Picture:
    """How a marker moves in x and y from its place at the first full exhalation (the dissertation's Figure II.34)."""
    figure = new_figure(1000, 520)
    home = tracks.places[np.nanargmin(np.abs(tracks.times_s - exhalations_s[0])), marker]
    apart = tracks.places[:, marker] - home
    for row, name in enumerate(("x", "y")):
        axes = figure.add_axes((0.09, 0.58 - 0.48 * row, 0.88, 0.36))
        axes.plot(tracks.times_s, apart[:, row], color=BLUE, lw=1.4)
        for n, moment in enumerate(exhalations_s):
            axes.axvline(moment, color=GREEN, lw=1.2, ls="--", label="full exhalation" if n == 0 and row == 0 else None)
        axes.set(xlabel="time (s)", ylabel=f"moved in {name} ({tracks.unit})")
        axes.set_xlim(tracks.times_s[0], tracks.times_s[-1])
    figure.legend(fontsize=10, loc="upper right", frameon=False)
    return picture(
        figure,
        f"How marker {marker + 1} moves in x and y from where it was at the first full exhalation.",
        f"How marker {marker + 1} moves in x (right) and y (down) from where it was at the first full exhalation (as "
        "Figure II.34, which shows the distance from another marker).",
    )


def draw_trajectories(named: Sequence[tuple[str, FloatArray, FloatArray]], unit: str) -> Picture:
    """Three displacements of a marker, each a name, times (n,) and values (n,) (the dissertation's Figure II.45)."""
    figure = new_figure(1000, 360)
    axes = figure.add_axes((0.08, 0.15, 0.89, 0.72))
    for (name, times, values), colour in zip(named, (BLUE, VERMILLION, BLACK), strict=True):
        axes.plot(times, values, color=colour, lw=1.3, label=name)
    axes.set(xlabel="time (s)", ylabel=f"displacement ({unit})")
    axes.legend(fontsize=10.5, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return picture(
        figure, "Trajectory of one marker under several ventilations.", "One marker's trajectory (as Figure II.45)."
    )


def draw_rates(displacements: Sequence[Displacement], plateau: Plateau, unit: str) -> Picture:
    """Displacement against rate with the plateau (the dissertation's Figure II.46)."""
    figure = new_figure(860, 440)
    axes = figure.add_axes((0.09, 0.13, 0.88, 0.72))
    good = [d for d in displacements if d.status.is_good]
    bad = [d for d in displacements if not d.status.is_good]
    axes.errorbar(
        [d.rate_hz for d in good], [d.value for d in good], [2.0 * d.sigma for d in good],
        fmt="o", color=BLUE, ms=6, label="measured",
    )  # fmt: skip
    if plateau.rate_hz and plateau.interval_hz and plateau.rates_hz is not None and plateau.curve is not None:
        axes.plot(plateau.rates_hz, plateau.curve, color=BLACK, lw=1.5, label="broken curve")
        axes.axvspan(*plateau.interval_hz, color=ORANGE, alpha=0.35, label="90 % interval of the break")
        axes.axvline(plateau.rate_hz, color=VERMILLION, lw=1.5, ls="--", label=f"plateau from {plateau.rate_hz:.1f} Hz")
    for n, d in enumerate(bad):
        axes.plot(d.rate_hz, 0.0, "x", color=VERMILLION, ms=9, mew=2, label="not resolved" if n == 0 else None)
    axes.set(xlabel="rate (Hz)", ylabel=f"peak-to-peak displacement ({unit})")
    axes.set_ylim(bottom=0.0)
    _per_minute(axes)
    axes.legend(fontsize=10.5, loc="upper center")
    return picture(figure, "Displacement against rate.", "Displacement of the markers against rate (as Figure II.46).")


def _per_minute(axes: Axes) -> None:
    upper = axes.twiny()
    upper.set_xlim(*(60.0 * limit for limit in axes.get_xlim()))
    upper.set_xlabel("breaths per minute")


def _main_way(way: FloatArray) -> FloatArray:
    """The direction (2,) in which a way (n, 2) is longest, from full exhalation on."""
    centred = way - way.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    far = way[np.argmax(np.abs(way @ direction))]
    return np.asarray(direction * np.sign(far @ direction))
