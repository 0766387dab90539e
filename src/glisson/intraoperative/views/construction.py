"""Two-view reconstruction as the dissertation constructs it, with error bars by propagation."""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.observations import Observations
from glisson.core.protocols import Progress, Reconstruction, silent
from glisson.core.status import Status
from glisson.core.views import View, ViewSet
from glisson.intraoperative.cameras.projection import undistorted
from glisson.intraoperative.views.outcome import landmark_observations
from glisson.intraoperative.views.parallax import judged, parallax_rad, require_parallax
from glisson.intraoperative.views.parameters import ReconstructionParameters
from glisson.intraoperative.views.two_lines import Measured, lines, nearest_points

LEAST_ARM_PX = 20.0
"""Scale and roll come from H′T′: one that is shorter tells neither (design, section 3)."""

_STEP_MM, _STEP_RAD, _STEP_PX = 1e-4, 1e-6, 1e-3
_MISS = 4.0
"""Lines that miss each other by so many standard deviations do not lead to one point."""


class Construction:
    """S is midway between the lines that two views give; roll and scale come from the touched point alone."""

    name: ClassVar[str] = "construction"
    summary: ClassVar[str] = "The dissertation's construction: two views, scale and roll from the touched point."
    Parameters: ClassVar[type[ReconstructionParameters]] = ReconstructionParameters

    def __init__(self, parameters: ReconstructionParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def reconstruct(self, views: ViewSet, progress: Progress = silent) -> Reconstruction:
        """Reconstruct landmarks; see `glisson.core.protocols.SurfaceReconstructor`."""
        if not views.names:
            raise BadInput("The construction needs landmarks that are seen in two views.")
        first, second = _farthest_apart(views)
        seen = views.landmarks
        one, two = (np.flatnonzero(seen.view == number) for number in (first, second))
        chosen, left, right = np.intersect1d(seen.point[one], seen.point[two], return_indices=True)
        if not len(chosen):
            raise BadInput(f"{views.views[first].name} and {views.views[second].name} have no landmark in common.")
        pair = (views.views[first], views.views[second])
        require_parallax(pair, views.touched_mm, seen.sigma_px, self._parameters.worst_mm)
        pixels = [seen.pixels[one[left]], seen.pixels[two[right]]]
        measured = _measured(views, pair, pixels)
        points, gaps = nearest_points(measured.centres_mm, lines(measured))
        covariance, gap_variance = _propagated(views, pair, measured, gaps)
        angle = float(np.median(parallax_rad(measured.centres_mm, points)))
        notes = list(judged(covariance, angle, self._parameters.worst_mm, self._parameters.doubtful_mm))
        names = [views.names[number] for number in chosen]
        missed = np.linalg.norm(gaps, axis=1) / np.sqrt(gap_variance)
        wrong = [
            f"The two lines to {name!r} pass {np.linalg.norm(gap):.1f} mm from each other, {times:.0f} times what is "
            "expected; it, the touched point or a scope moved otherwise than was measured."
            for name, gap, times in zip(names, gaps, missed, strict=True)
            if times > _MISS
        ]
        if len(views.views) > 2 or len(chosen) < len(views.names):
            notes.append(f"Only {pair[0].name} and {pair[1].name} were used, and {len(chosen)} landmarks seen in both.")
        return Reconstruction(
            Observations(landmark_observations(names, points, covariance)),
            Status.AMBIGUOUS if wrong else Status.CONVERGED,
            tuple(wrong + notes),
            angle,
        )


def _farthest_apart(views: ViewSet) -> tuple[int, int]:
    """The two views from which the touched point is seen at the largest angle."""
    centres = np.stack([view.room_from_camera.translation_mm for view in views.views])
    pairs = [(i, j) for i in range(len(centres)) for j in range(i + 1, len(centres))]
    angles = [parallax_rad(centres[list(pair)], views.touched_mm[None])[0] for pair in pairs]
    return pairs[int(np.argmax(angles))]


def _measured(views: ViewSet, pair: tuple[View, View], pixels: list[FloatArray]) -> Measured:
    tips = np.stack([_from_principal_point(view, view.tip_px[None])[0] for view in pair])
    for view, arm in zip(pair, np.linalg.norm(tips, axis=1), strict=True):
        if arm < LEAST_ARM_PX:
            raise StageFailed(
                f"The tool's tip in {view.name} is {arm:.0f} px from the principal point, and {LEAST_ARM_PX:.0f} are "
                "needed for scale and roll; touch the surface farther from the image's middle.",
                Status.UNOBSERVABLE,
            )
    return Measured(
        np.stack([view.room_from_camera.translation_mm for view in pair]),
        np.stack([view.room_from_camera.rotation[:, 2] for view in pair]),
        views.touched_mm,
        tips,
        np.stack([_from_principal_point(view, seen) for view, seen in zip(pair, pixels, strict=True)]),
    )


def _from_principal_point(view: View, pixels: FloatArray) -> FloatArray:
    """Pixels (n, 2) after undistortion, square ones, from H′."""
    apart: FloatArray = undistorted(view.camera, pixels) * view.camera.focal_px.mean()
    return apart


def _propagated(
    views: ViewSet, pair: tuple[View, View], measured: Measured, gaps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Covariance (m, 3, 3) of the points and variance (m,) of the gaps' lengths, by central differences.

    All disturbances are constructed at once: of C, d, T, the tips' pixels, and the landmarks', of which each point
    feels its own only.
    """
    count = len(gaps)
    steps = np.concatenate([np.full(6, _STEP_MM), np.full(6, _STEP_RAD), np.full(3, _STEP_MM), np.full(8, _STEP_PX)])
    covariance = np.zeros((len(steps), len(steps)))
    for number, view in enumerate(pair):
        pose = view.room_from_camera.covariance
        assert pose is not None  # a view has one
        rows = np.r_[6 + 3 * number : 9 + 3 * number, 3 * number : 3 * number + 3]
        covariance[np.ix_(rows, rows)] = pose
    if views.hand_eye_covariance is not None:
        common = np.zeros((len(steps), 6))
        for number, view in enumerate(pair):
            turn = view.room_from_camera.rotation
            common[6 + 3 * number : 9 + 3 * number, :3] = common[3 * number : 3 * number + 3, 3:] = turn
        covariance += common @ views.hand_eye_covariance @ common.T
    covariance[12:15, 12:15] = views.touched_covariance_mm2
    covariance[15:19, 15:19] = views.tip_sigma_px**2 * np.eye(4)
    covariance[19:, 19:] = views.landmarks.sigma_px**2 * np.eye(4)
    signed = np.concatenate([np.diag(steps), -np.diag(steps)])
    moved = _disturbed(measured, signed, count)
    points, spans = nearest_points(moved.centres_mm, lines(moved))
    half = len(steps)
    by_all = (points[:half] - points[half:]) / (2.0 * steps[:, None, None])
    along = gaps / np.maximum(np.linalg.norm(gaps, axis=1, keepdims=True), 1e-12)
    by_gap = ((spans[:half] - spans[half:]) * along).sum(axis=2) / (2.0 * steps[:, None])
    return (
        np.einsum("ami,ab,bmj->mij", by_all, covariance, by_all),
        np.maximum(np.einsum("am,ab,bm->m", by_gap, covariance, by_gap), 1e-12),
    )


def _disturbed(measured: Measured, steps: FloatArray, count: int) -> Measured:
    """The measurements after each row of steps."""
    turns = steps[:, 6:12].reshape(-1, 2, 3)
    return Measured(
        measured.centres_mm + steps[:, :6].reshape(-1, 2, 3),
        measured.forward + np.cross(turns, measured.forward),
        measured.touched_mm + steps[:, 12:15],
        measured.tips + steps[:, 15:19].reshape(-1, 2, 2),
        measured.points + np.repeat(steps[:, 19:].reshape(-1, 2, 1, 2), count, axis=2),
    )
